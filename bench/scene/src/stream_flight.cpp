#include "terrane/scene/stream_flight.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "terrane/render/png.h"

namespace terrane {
namespace {

/// A dataset opens within this, or not at all.
constexpr double kLongestOpeningSeconds = 120.0;
constexpr double kLongestRestSeconds = 60.0;

Status writePicture(const std::string& path, const TerrainView& view, TerrainRenderer& renderer,
                    const Camera& camera) {
  const Manifest& manifest = view.manifest();
  RenderStyle style;
  style.lowMeters = manifest.minHeight;
  style.highMeters = std::max(manifest.maxHeight, manifest.minHeight + 1.0);
  TERRANE_ASSIGN(const TerrainRenderer::Picture picture,
                 renderer.drawPicture(view.cut(), manifest.frame, camera, style));
  return writePng(path, camera.width, camera.height, picture.rgba);
}

}  // namespace

Result<StreamFlightReport> flyStream(const std::string& dataset,
                                     const std::function<Camera(double seconds)>& cameraAt,
                                     const StreamTruth* truth, gpu::Context* context,
                                     const StreamFlightOptions& options, Progress& progress) {
  auto simulated = std::make_unique<SimulatedLine>(dataset, options.line);
  SimulatedLine& wire = *simulated;
  std::unique_ptr<Transport> line = std::move(simulated);
  if (options.wrapLine) line = options.wrapLine(std::move(line));
  const std::unique_ptr<Workers> workers = makeInlineWorkers();
  std::unique_ptr<TerrainRenderer> renderer;
  if (options.draw) {
    TERRANE_CHECK(context != nullptr, "drawing without a context");
    TERRANE_ASSIGN(renderer, TerrainRenderer::create(*context));
  }
  TerrainView view(std::move(line), *workers, renderer.get(), options.view);

  // Manifest and directories first: they are held when the flight begins.
  double now = 0.0;
  const double step = 1.0 / options.framesPerSecond;
  while (view.phase() == StreamPhase::Opening) {
    if (now > kLongestOpeningSeconds) return makeError("{}: does not open: {}", dataset, view.problem());
    TERRANE_TRY(view.update(cameraAt(0.0), now));
    now += step;
  }
  for (double rest = 0.0; options.begunAtRest && !view.isSettled(); rest += step, now += step) {
    if (rest > kLongestRestSeconds) break;
    TERRANE_TRY(view.update(cameraAt(0.0), now));
  }
  LineFaults faults = options.faults;
  for (auto& outage : faults.outages) outage = {outage.first + now, outage.second + now};
  wire.setFaults(faults);

  StreamFlightReport report;
  const uint64_t bytesBefore = view.report().stream.bytesReceived;
  auto nextPicture = options.pictureSeconds.begin();
  const double tau = options.view.selection.tolerancePixels;
  const auto frames =
      static_cast<int64_t>(std::floor(options.durationSeconds * options.framesPerSecond + 0.5));
  progress.beginStage("flying", frames + 1, "frames");
  for (int64_t i = 0; i <= frames; ++i) {
    const double seconds = static_cast<double>(i) * step;
    const Camera camera = cameraAt(seconds);
    TERRANE_TRY(view.update(camera, now + seconds));
    StreamFlightFrame frame;
    frame.seconds = seconds;
    frame.view = view.report();
    if (options.afterFrame) options.afterFrame(view);
    frame.bytes = frame.view.stream.bytesReceived - bytesBefore;
    for (const TileWish& wish : view.cut().wishes)
      frame.debtPixels +=
          static_cast<double>(wish.areaPixels) * std::max(0.0, static_cast<double>(wish.errorPixels) - tau);
    report.debtPixelSeconds += frame.debtPixels * step;
    if (options.draw && !view.cut().patches.empty()) {
      const Manifest& manifest = view.manifest();
      TERRANE_ASSIGN(const std::vector<glm::dvec3> places,
                     renderer->drawPositions(view.cut(), manifest.frame, camera));
      for (const glm::dvec3& place : places) frame.groundPixels += std::isnan(place.x) ? 0 : 1;
      if (truth != nullptr) {
        const CrackMeasure cracks = measureCracksWhileLoading(truth->cover, camera, places);
        frame.cracks = cracks.cracks;
        frame.crackPixels = cracks.checked;
        if (options.errorEvery > 0 && i % options.errorEvery == 0) {
          const ErrorMeasure error = measureError(truth->surface, camera, places, tau);
          frame.excessPixels = error.excessPixels;
          frame.p999Pixels = error.percentile999();
          report.excessPixelSeconds += error.excessPixels * step * options.errorEvery;
        }
      }
    }
    if (options.draw && nextPicture != options.pictureSeconds.end() && seconds >= *nextPicture - 1e-9) {
      TERRANE_TRY(writePicture(fmt::format("{}_{}.png", options.picturePrefix, *nextPicture), view, *renderer,
                               camera));
      ++nextPicture;
    }
    report.cracks += frame.cracks;
    report.crackPixels += frame.crackPixels;
    report.framesUntilUsed = frame.view.mostFramesUntilUsed;
    report.frames.push_back(frame);
    progress.advance(1);
  }
  report.tilesSpoilt = wire.answersSpoilt();
  return report;
}

std::function<std::vector<TileId>(const Camera&, const PatchSelection&)> neededTilesOf(Terrain& terrain) {
  return [&terrain](const Camera& camera, const PatchSelection& selection) {
    const auto cut = terrain.selectAndLoad(camera, selection);
    std::set<TileId> needed = {TileId{}};
    if (!cut.ok()) return std::vector<TileId>(needed.begin(), needed.end());
    for (const Patch& patch : cut->patches) {
      for (TileId id : {patch.tile, patch.shadingTile})
        for (; needed.insert(id).second && !id.isRoot(); id = id.parent()) {
        }
    }
    return std::vector<TileId>(needed.begin(), needed.end());
  };
}

}  // namespace terrane
