#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>

#include "commands.h"
#include "common.h"
#include "frame_sink.h"
#include "ground_lines.h"
#include "picture_options.h"
#include "terrane/bake/position_raster.h"
#include "terrane/base/format_number.h"
#include "terrane/engine/default_style.h"
#include "terrane/engine/read_flight.h"
#include "terrane/engine/terrain.h"

namespace terrane::cli {

namespace {

constexpr double kRadians = 0.017453292519943295;
/// How far above the horizon the default camera stands.
constexpr double kOverviewElevationDegrees = 32.0;

struct RenderOptions {
  std::string dataset;
  std::string output;
  std::string size = "1280x720";
  std::string eye, lookAt, freezeAt;
  std::string lookFrom = "S";
  double elevationDegrees = kOverviewElevationDegrees;
  double fovDegrees = 45.0;
  std::string flight;
  std::optional<double> atSeconds;
  double framesPerSecond = 30.0;
  std::string position, stats;
  std::string surface = "patches";
  std::string mode = "shaded", outline = "none", cull = "on", morph = "on", metric = "full";
  std::string water = "auto", palette = "auto";
  std::vector<std::string> imagery;
  std::string lines;
  std::vector<std::string> passes;
  int patchSamples = 17;
  bool overwrite = false;
  TerrainOptions terrain;
  PatchSelection selection;
  RenderStyle style;
  OutputOptions talk;
};

const std::vector<std::pair<std::string, ColorMode>> kModes = {
    {"shaded", ColorMode::Shaded},   {"height", ColorMode::Height}, {"slope", ColorMode::Slope},
    {"normals", ColorMode::Normals}, {"tiles", ColorMode::Tiles},   {"error", ColorMode::Error}};
const std::vector<std::pair<std::string, OutlineMode>> kOutlines = {
    {"none", OutlineMode::None}, {"wireframe", OutlineMode::Wireframe}, {"patches", OutlineMode::Patches}};
const std::vector<std::pair<std::string, SplitMetric>> kMetrics = {
    {"full", SplitMetric::Full}, {"distance", SplitMetric::DistanceOnly}, {"error", SplitMetric::ErrorOnly}};

template <class T>
T choice(const std::vector<std::pair<std::string, T>>& choices, const std::string& name) {
  for (const auto& [text, value] : choices)
    if (text == name) return value;
  return choices.front().second;
}

template <class T>
std::vector<std::string> namesOf(const std::vector<std::pair<std::string, T>>& choices) {
  std::vector<std::string> names;
  for (const auto& [text, value] : choices) names.push_back(text);
  return names;
}

/// "E,N,H" in the dataset's CRS.
Result<glm::dvec3> parsePoint(const std::string& text, const char* option) {
  glm::dvec3 p;
  char tail = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &p.x, &p.y, &p.z, &tail) != 3 ||
      !std::isfinite(p.x + p.y + p.z))
    return makeError("{} {}: expected EASTING,NORTHING,HEIGHT in the dataset's CRS", option, text);
  return p;
}

/// A compass direction or degrees clockwise from north.
Result<double> parseDirection(const std::string& text) {
  static const std::vector<std::pair<std::string, double>> kPoints = {
      {"N", 0}, {"NE", 45}, {"E", 90}, {"SE", 135}, {"S", 180}, {"SW", 225}, {"W", 270}, {"NW", 315}};
  for (const auto& [name, degrees] : kPoints)
    if (CLI::detail::to_lower(text) == CLI::detail::to_lower(name)) return degrees;
  double degrees = 0.0;
  char tail = 0;
  if (std::sscanf(text.c_str(), "%lf%c", &degrees, &tail) == 1 && std::isfinite(degrees)) return degrees;
  return makeError(
      "--look-from {}: expected N, NE, E, SE, S, SW, W, NW, above, or degrees clockwise from north", text);
}

class RenderCommand {
 public:
  explicit RenderCommand(RenderOptions& options) : options_(options), progress_(makeProgress(options.talk)) {}

  int run() {
    const Status done = work();
    progress_->finish();
    return done.ok() ? kExitOk : fail(done.error(), options_.talk);
  }

 private:
  /// Can a file be made there? Known before anything is drawn.
  Status checkOutput(const std::string& path) const {
    namespace fs = std::filesystem;
    if (path.empty()) return {};
    std::error_code code;
    if (!options_.overwrite && fs::exists(path, code))
      return makeError("{}: exists already; pass --overwrite to replace it", path);
    const fs::path folder = fs::path(path).parent_path();
    if (!folder.empty() && !fs::is_directory(folder, code))
      return makeError("{}: the folder {} does not exist; make it first", path, folder.string());
    if (fs::is_directory(path, code)) return makeError("{}: is a folder; name a file", path);
    return {};
  }

  Status work() {
    TERRANE_TRY(parsePictureSize(options_.size, width_, height_));
    if (options_.output.empty() && options_.position.empty())
      return makeError("nothing to write: pass -o PICTURE.png, or --position OUT.tif");
    for (const std::string& path : {options_.output, options_.position, options_.stats})
      TERRANE_TRY(checkOutput(path));
    if (options_.flight.empty() && options_.atSeconds)
      return makeError("--at is a moment of a flight; pass --flight FLIGHT.json with it");
    if (!options_.output.empty() && (options_.flight.empty() || options_.atSeconds) &&
        CLI::detail::to_lower(std::filesystem::path(options_.output).extension().string()) != ".png")
      return makeError("{}: a picture is written as PNG; name it NAME.png", options_.output);
    options_.selection.cull = options_.cull == "on";
    options_.selection.morph = options_.morph == "on";
    options_.selection.metric = choice(kMetrics, options_.metric);
    TERRANE_TRY(parseSurface(options_.surface, options_.patchSamples, options_.selection));
    options_.style.mode = choice(kModes, options_.mode);
    options_.style.outline = choice(kOutlines, options_.outline);
    options_.style.tauPixels = options_.selection.tolerancePixels;
    options_.style.exaggeration = options_.selection.exaggeration;

    TERRANE_ASSIGN(Dataset dataset, openDatasetArgument(options_.dataset, *progress_));
    terrain_ = Terrain::over(std::move(dataset), options_.terrain);
    const Manifest& manifest = terrain_->dataset().manifest();
    if (options_.imagery == std::vector<std::string>{"none"})
      TERRANE_TRY(terrain_->showImagery({}));
    else if (!options_.imagery.empty())
      TERRANE_TRY(terrain_->showImagery(options_.imagery));
    const RenderStyle suited = defaultStyle(manifest);
    options_.style.lowMeters = suited.lowMeters;
    options_.style.highMeters = suited.highMeters;
    options_.style.palette = options_.palette == "grey"   ? Palette::grey()
                             : options_.palette == "land" ? Palette::forGround(manifest.maxHeight)
                                                          : suited.palette;
    if (options_.water == "auto") {
      options_.style.waterLevelMeters = suited.waterLevelMeters;
      options_.style.waterWithinMeters = suited.waterWithinMeters;
    } else if (options_.water != "off") {
      double level = 0.0;
      char tail = 0;
      if (std::sscanf(options_.water.c_str(), "%lf%c", &level, &tail) != 1 || !std::isfinite(level))
        return makeError("--water {}: expected a height in metres, auto or off", options_.water);
      options_.style.waterLevelMeters = level;
    }
    TERRANE_TRY(addStages());
    if (!options_.flight.empty()) return renderFlight();

    TERRANE_ASSIGN(const Camera camera, stillCamera());
    return renderStill(camera);
  }

  /// Lines on the ground, and the caller's own passes: --lines, --pass.
  Status addStages() {
    if (!options_.lines.empty()) {
      TERRANE_ASSIGN(const auto lines, readGroundLines(options_.lines, terrain_->dataset().manifest()));
      TERRANE_TRY(terrain_->setLines(lines));
    }
    // Places count from the middle of the ground, at height 0, as they do in pages.
    const GroundBox box = terrain_->groundBox();
    const glm::dvec3 origin(0.5 * (box.low.x + box.high.x), 0.5 * (box.low.y + box.high.y), 0.0);
    for (const std::string& path : options_.passes) {
      std::ifstream file(path, std::ios::binary);
      std::ostringstream text;
      if (!file || (file.peek() != std::ifstream::traits_type::eof() && !(text << file.rdbuf())))
        return makeError("{}: cannot be read; does it exist?", path);
      TERRANE_TRY(terrain_->setPass(path, text.str(), origin));
    }
    return {};
  }

  glm::dvec3 exaggerated(glm::dvec3 local) const {
    local.z *= options_.selection.exaggeration;
    return local;
  }

  Result<Camera> cameraFromPoints(const std::string& eyeText, const std::string& targetText,
                                  const char* option) const {
    TERRANE_ASSIGN(const glm::dvec3 eye, parsePoint(eyeText, option));
    TERRANE_ASSIGN(const glm::dvec3 target, parsePoint(targetText, option));
    if (eye == target) return makeError("{}: the eye looks at itself; give two different points", option);
    const Frame& frame = terrain_->dataset().manifest().frame;
    return lookAt(exaggerated(frame.localFromCrs(eye)), exaggerated(frame.localFromCrs(target)),
                  options_.fovDegrees * kRadians, width_, height_);
  }

  Result<Camera> stillCamera() const {
    if (!options_.eye.empty()) {
      if (options_.lookAt.empty()) return makeError("--eye needs --look-at E,N,H");
      return cameraFromPoints(options_.eye, options_.lookAt, "--eye/--look-at");
    }
    if (!options_.lookAt.empty()) return makeError("--look-at needs --eye E,N,H");
    GroundBox box = terrain_->groundBox();
    box.low.z *= options_.selection.exaggeration;
    box.high.z *= options_.selection.exaggeration;
    const bool above = CLI::detail::to_lower(options_.lookFrom) == "above";
    double azimuth = 180.0;
    if (!above) {
      TERRANE_ASSIGN(azimuth, parseDirection(options_.lookFrom));
    }
    return overviewCamera(box, azimuth, above ? 90.0 : options_.elevationDegrees,
                          options_.fovDegrees * kRadians, width_, height_);
  }

  /// The cut for a camera, or for the frozen one.
  Result<Cut> cutFor(const Camera& camera) {
    if (options_.freezeAt.empty()) return terrain_->selectAndLoad(camera, options_.selection);
    const size_t slash = options_.freezeAt.find('/');
    if (slash == std::string::npos)
      return makeError("--freeze-at {}: expected EYE/LOOK-AT, each E,N,H", options_.freezeAt);
    TERRANE_ASSIGN(const Camera frozen, cameraFromPoints(options_.freezeAt.substr(0, slash),
                                                         options_.freezeAt.substr(slash + 1), "--freeze-at"));
    const GroundBox box = terrain_->groundBox();
    options_.style.frustum =
        FrustumOverlay{frozen, 1.2 * std::max(box.high.x - box.low.x, box.high.y - box.low.y)};
    return terrain_->selectAndLoad(frozen, options_.selection);
  }

  Status renderStill(const Camera& camera) {
    TERRANE_ASSIGN(const Cut cut, cutFor(camera));
    if (!options_.output.empty()) {
      TERRANE_ASSIGN(const Picture picture, terrain_->draw(cut, camera, options_.style));
      TERRANE_TRY(writePicture(options_.output, picture));
    }
    FrameReport report = terrain_->report();
    if (!options_.position.empty()) {
      TERRANE_ASSIGN(const PositionPicture positions,
                     terrain_->drawPositions(cut, camera, options_.style.exaggeration));
      TERRANE_TRY(writePositions(positions));
      if (options_.output.empty()) report = terrain_->report();
    }
    TERRANE_TRY(writeStats(report, 1));
    sayDone(report);
    return {};
  }

  Status writePositions(const PositionPicture& positions) const {
    const Manifest& manifest = terrain_->dataset().manifest();
    std::vector<glm::dvec3> crs(positions.local.size());
    for (size_t i = 0; i < crs.size(); ++i) crs[i] = manifest.frame.crsFromLocal(positions.local[i]);
    return writePositionRaster(options_.position, positions.width, positions.height, crs, manifest.crsWkt);
  }

  Status renderFlight() {
    TERRANE_ASSIGN(const FittedFlight fitted, readFlight(options_.flight, *terrain_));
    if (options_.atSeconds &&
        !(*options_.atSeconds >= 0.0 && *options_.atSeconds <= fitted.durationSeconds()))
      return makeError("--at {}: the flight lasts from 0 to {} s", *options_.atSeconds,
                       fitted.durationSeconds());
    if (options_.atSeconds) return renderStill(fitted.at(*options_.atSeconds, width_, height_));
    if (!options_.position.empty())
      return makeError("--position needs one moment of the flight; pass --at SECONDS");

    const auto frames =
        static_cast<int64_t>(std::floor(fitted.durationSeconds() * options_.framesPerSecond)) + 1;
    TERRANE_ASSIGN(
        std::unique_ptr<FrameSink> sink,
        openFrameSink(options_.output, width_, height_, options_.framesPerSecond, options_.overwrite));
    progress_->beginStage("rendering", frames, "frames");
    for (int64_t frame = 0; frame < frames; ++frame) {
      if (interruptFlag()) return makeError("interrupted after {} of {} frames", frame, frames);
      const Camera camera = fitted.at(static_cast<double>(frame) / options_.framesPerSecond, width_, height_);
      TERRANE_ASSIGN(const Cut cut, cutFor(camera));
      TERRANE_ASSIGN(const Picture picture, terrain_->draw(cut, camera, options_.style));
      TERRANE_TRY(sink->add(picture));
      progress_->advance(1);
    }
    TERRANE_TRY(sink->finish());
    TERRANE_TRY(writeStats(terrain_->report(), frames));
    sayDone(terrain_->report());
    return {};
  }

  nlohmann::json statsJson(const FrameReport& report, int64_t frames) const {
    return {{"dataset", terrain_->dataset().directory()},
            {"renderer", terrain_->rendererName()},
            {"width", width_},
            {"height", height_},
            {"tau", options_.selection.tolerancePixels},
            {"k", options_.patchSamples},
            {"frames", frames},
            {"triangles", report.triangles},
            {"patches", report.patches},
            {"tiles", report.tiles},
            {"draw_calls", report.drawCalls},
            {"error_bound_px", report.errorPixels},
            {"deepest_level", report.deepestLevel},
            {"bytes_read", report.bytesRead},
            {"resident_bytes", report.residentBytes},
            {"gpu_bytes", report.gpuBytes},
            {"imagery_tiles", report.imageryTiles},
            {"imagery_bytes", report.imageryBytes},
            {"times",
             {{"select_ms", report.selectMilliseconds},
              {"load_ms", report.loadMilliseconds},
              {"draw_ms", report.drawMilliseconds}}}};
  }

  Status writeStats(const FrameReport& report, int64_t frames) const {
    if (options_.stats.empty()) return {};
    std::ofstream file(options_.stats);
    file << statsJson(report, frames).dump(2) << "\n";
    file.close();
    if (!file) return makeError("{}: cannot be written; make room, or choose another place", options_.stats);
    return {};
  }

  void sayDone(const FrameReport& report) const {
    progress_->finish();
    if (options_.talk.json) {
      nlohmann::json line = statsJson(report, 1);
      line["output"] = options_.output;
      printJson(line);
    } else if (!options_.talk.quiet) {
      std::fprintf(stderr, "%s: %s triangles in %s patches from %s tiles, error at most %.2g px\n",
                   (options_.output.empty() ? options_.position : options_.output).c_str(),
                   formatCount(report.triangles).c_str(), formatCount(report.patches).c_str(),
                   formatCount(report.tiles).c_str(), report.errorPixels);
    }
  }

  RenderOptions& options_;
  std::unique_ptr<CommandProgress> progress_;
  int width_ = 0;
  int height_ = 0;
  std::unique_ptr<Terrain> terrain_;
};

constexpr const char* kRenderExamples =
    "Examples:\n"
    "  terrane render alps.terrane -o alps.png\n"
    "  terrane render https://terrain.example.org/d/alps -o alps.png\n"
    "  terrane render alps.terrane -o ne.png --look-from NE --size 1920x1080 --tau 0.5\n"
    "  terrane render alps.terrane -o peak.png --eye 412000,5149000,4200 --look-at 418000,5155000,2500\n"
    "  terrane render alps.terrane -o mesh.png --surface meshes --outline wireframe --mode height\n"
    "  terrane render alps.terrane -o frozen.png --look-from above --freeze-at E,N,H/E,N,H --outline "
    "patches\n"
    "  terrane render alps.terrane -o where.png --position where.tif --stats where.json\n"
    "  terrane render alps.terrane -o tour.png --lines tour.gpx\n"
    "  terrane render alps.terrane -o flight.mp4 --flight bench/flights/valley.json\n"
    "  terrane render alps.terrane -o frame_%05d.png --flight bench/flights/valley.json --fps 10";

}  // namespace

void addRenderCommand(CLI::App& app, CommandContext& context) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "draw a dataset into a picture, without a window");
  command->footer(kRenderExamples);
  command->add_option("DATASET", options->dataset, kDatasetArgument)->required();
  command->add_option("-o,--output", options->output,
                      "PNG; for a flight PATTERN_%05d.png or .mp4 (through ffmpeg)");
  command->add_option("--size", options->size, "picture size in pixels")->capture_default_str();
  command->add_option("--samples", options->style.samples, "samples a pixel")
      ->capture_default_str()
      ->check(CLI::Range(1, 16));
  command->add_option("--tau", options->selection.tolerancePixels, "largest error on screen, pixels")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1000.0));
  command
      ->add_option(
          "--surface", options->surface,
          "how tiles become triangles: patches of one pattern, or meshes as fine as the ground needs")
      ->capture_default_str()
      ->check(CLI::IsMember(kSurfaceNames));
  command
      ->add_option("--k", options->patchSamples,
                   "samples along the side of one of --surface patches, 2^k + 1 from 3 to 129")
      ->capture_default_str();

  command->add_option("--fov", options->fovDegrees, "vertical field of view, degrees")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 170.0));
  CLI::Option* eye = command->add_option("--eye", options->eye, "camera: E,N,H in the dataset's CRS");
  command->add_option("--look-at", options->lookAt, "what it looks at: E,N,H");
  command
      ->add_option("--look-from", options->lookFrom, "overview from N, NE, ..., degrees from north, or above")
      ->capture_default_str()
      ->excludes(eye);
  command
      ->add_option("--elevation", options->elevationDegrees,
                   "the overview's height above the horizon, degrees")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 90.0));
  command->add_option("--flight", options->flight, "a camera path (docs/flights.md)");
  command->add_option("--at", options->atSeconds, "one moment of the flight, seconds");
  command->add_option("--fps", options->framesPerSecond, "frames a second of a whole flight")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 240.0));
  command->add_option("--freeze-at", options->freezeAt,
                      "keep the cut of the camera E,N,H/E,N,H (eye/look-at) and show its frustum");

  command->add_option("--mode", options->mode, "colouring")
      ->capture_default_str()
      ->check(CLI::IsMember(namesOf(kModes)));
  command
      ->add_option(
          "--imagery", options->imagery,
          "imagery layers to show in the shaded mode, by name, or none (default: all that there are)")
      ->delimiter(',');
  command
      ->add_option("--imagery-relief", options->style.imageryRelief,
                   "how much of light and shade lies over imagery, 0 to 1; 1 suits pictures without shading")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--imagery-brightness", options->style.imageryBrightness, "factor on imagery")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 10.0));
  command->add_option("--outline", options->outline, "lines over it")
      ->capture_default_str()
      ->check(CLI::IsMember(namesOf(kOutlines)));
  command->add_option("--exaggeration", options->selection.exaggeration, "factor on heights")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 100.0));
  command
      ->add_option("--water", options->water,
                   "height of flat water in metres (all ground below is water), off, or auto: the sea, where "
                   "much ground is level at "
                   "0")
      ->capture_default_str();
  command->add_option("--palette", options->palette, "colours of the shaded mode")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "land", "grey"}));
  command->add_option(
      "--lines", options->lines,
      "A vector file (GeoJSON, GPX, KML, GeoPackage, shapefile, ...): lines that lie on the ground; "
      "attributes stroke, stroke-opacity, stroke-width and stroke-meters say how they look");
  command->add_option("--pass", options->passes,
                      "GLSL of a stage over the picture: vec3 apply(Ground ground) (docs/architecture.md); "
                      "several run in their order");
  command->add_option("--cull", options->cull, "leave out what is outside the frustum")
      ->capture_default_str()
      ->check(CLI::IsMember({"on", "off"}));
  command->add_option("--morph", options->morph, "let patches glide into being as one comes nearer")
      ->capture_default_str()
      ->check(CLI::IsMember({"on", "off"}));
  command->add_option("--metric", options->metric, "what patches are split by")
      ->capture_default_str()
      ->check(CLI::IsMember(namesOf(kMetrics)));
  command
      ->add_option("--levels-below-data", options->selection.levelsBelowData,
                   "levels that --metric distance may add")
      ->capture_default_str()
      ->check(CLI::Range(0, 6));

  command->add_option("--position", options->position,
                      "GeoTIFF of three float64 bands: E, N, H under every pixel, NaN for sky");
  command->add_option("--stats", options->stats,
                      "JSON with triangles, patches, tiles, draw_calls, bytes_read, times");
  command->add_flag("--software", options->terrain.forceSoftware, "do not use the GPU");
  command->add_flag("--gles", options->terrain.openGlEs, "draw with OpenGL ES 3.0, as browsers do");
  command->add_flag("--overwrite", options->overwrite, "replace existing files");
  addOutputOptions(*command, options->talk);
  command->callback(
      [options, &context] { context.run = [options] { return RenderCommand(*options).run(); }; });
}

}  // namespace terrane::cli
