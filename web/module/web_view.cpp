#include "web_view.h"

#include <emscripten.h>
#include <emscripten/heap.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "terrane/dataset/ellipsoid.h"
#include "terrane/engine/default_style.h"

// Lets emscripten find a canvas that is in no document, or has no id. Returns the name that it goes by.
// clang-format off
EM_JS(void, terrane_name_canvas, (emscripten::EM_VAL canvas), {
  specialHTMLTargets["!terrane"] = Emval.toValue(canvas);
});
// clang-format on

namespace terrane {
namespace {

constexpr const char* kCanvasName = "!terrane";
constexpr double kRadians = 0.017453292519943295;
/// Decoding between two frames, so that both fit into one at 60 a second.
constexpr double kDecodeSeconds = 0.006;

uint64_t bytesOf(double megabytes) {
  return static_cast<uint64_t>(std::clamp(megabytes, 1.0, 4096.0) * 1048576.0);
}

template <class Enum, size_t N>
void choose(Enum& out, const std::array<std::pair<std::string_view, Enum>, N>& names,
            const std::string& name) {
  for (const auto& [known, value] : names)
    if (known == name) out = value;
}
constexpr std::array<std::pair<std::string_view, ColorMode>, 6> kModes = {{{"shaded", ColorMode::Shaded},
                                                                           {"height", ColorMode::Height},
                                                                           {"slope", ColorMode::Slope},
                                                                           {"normals", ColorMode::Normals},
                                                                           {"tiles", ColorMode::Tiles},
                                                                           {"error", ColorMode::Error}}};
constexpr std::array<std::pair<std::string_view, OutlineMode>, 3> kOutlines = {
    {{"none", OutlineMode::None}, {"wireframe", OutlineMode::Wireframe}, {"patches", OutlineMode::Patches}}};
constexpr std::array<std::pair<std::string_view, SurfaceKind>, 2> kSurfaces = {
    {{"patches", SurfaceKind::Patches}, {"meshes", SurfaceKind::Meshes}}};

}  // namespace

WebView::WebView(const std::string& url, const WebLimits& limits) {
  ViewOptions options;
  // The page's only thread is dearer than the triangles that a horizon saves (decision 87).
  options.selection.hide = false;
  options.stream.compressedBytes = bytesOf(limits.compressed);
  options.stream.decodedBytes = bytesOf(limits.decoded);
  options.stream.pictureBytes = bytesOf(limits.pictures);
  options.gpuGeometryBytes = bytesOf(limits.gpuGeometry);
  options.gpuTextureBytes = bytesOf(limits.gpuTexture);
  options.meshBytes = bytesOf(limits.meshes);
  options.uploadBytesAFrame = bytesOf(limits.uploadAFrame);
  view_ = std::make_unique<TerrainView>(openHttpTransport(url), workers_, nullptr, options);
  open();
}

void WebView::open() {
  view_->open(emscripten_get_now() * 1e-3);
}

void WebView::attach(emscripten::val canvas) {
  detach();
  terrane_name_canvas(canvas.as_handle());
  auto context = gpu::Context::createOnCanvas(kCanvasName);
  if (!context.ok()) return fail(context.error());
  context_ = std::move(context).value();
  auto renderer = TerrainRenderer::create(*context_);
  if (!renderer.ok()) return fail(renderer.error());
  renderer_ = std::move(renderer).value();
  view_->setRenderer(renderer_.get());
}

void WebView::detach() {
  view_->setRenderer(nullptr);
  picture_.reset();
  renderer_.reset();
  context_.reset();
}

std::string WebView::trouble() const {
  if (!view_->problem().empty()) return view_->problem();
  return workers_.trouble().empty() ? stageTrouble_ : workers_.trouble();
}

std::string WebView::datasetJson() const {
  if (!isReady()) return "null";
  const Manifest& m = view_->manifest();
  const Frame& frame = m.frame;
  const Ellipsoid ellipsoid = ellipsoidOf(m.crsWkt);
  const double east = frame.originEasting + static_cast<double>(m.extentCols - 1) * frame.spacingX;
  const double south = frame.originNorthing - static_cast<double>(m.extentRows - 1) * frame.spacingY;
  const auto boundsOf = [](double w, double s, double e, double n) {
    return nlohmann::json{{"west", w}, {"south", s}, {"east", e}, {"north", n}};
  };
  nlohmann::json layers = nlohmann::json::array();
  for (const ImageryLayerRecord& layer : m.imagery) {
    const double texel = std::ldexp(frame.spacingXMeters(), frame.finestLevel - layer.finestLevel);
    layers.push_back(
        {{"name", layer.name},
         {"attribution", layer.attribution},
         {"bounds", boundsOf(layer.bounds[0], layer.bounds[1], layer.bounds[2], layer.bounds[3])},
         {"texelMeters", texel}});
  }
  uint64_t bytes = 0;
  for (const ArchiveRecord& archive : m.archives) bytes += archive.bytes;
  return nlohmann::json{{"name", m.name},
                        {"crsName", m.crsName},
                        {"crsWkt", m.crsWkt},
                        {"ellipsoid",
                         {{"semiMajorMeters", ellipsoid.semiMajorMeters},
                          {"flattening", ellipsoid.flattening},
                          {"isEarth", ellipsoid.isEarth()}}},
                        {"attribution", m.attribution},
                        {"verticalDatum", m.verticalDatum},
                        {"bounds", boundsOf(frame.originEasting, south, east, frame.originNorthing)},
                        {"minHeight", m.minHeight},
                        {"maxHeight", m.maxHeight},
                        {"maxErrorMeters", m.maxErrorMeters},
                        {"spacingMeters", frame.spacingXMeters()},
                        {"metersPerUnit", frame.metersPerUnit},
                        {"finestLevel", frame.finestLevel},
                        {"layers", layers},
                        {"bytes", bytes}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void WebView::setSize(int width, int height) {
  width_ = width;
  height_ = height;
}

void WebView::setImageryLayers(const std::string& names) {
  std::vector<std::string> out;
  for (size_t begin = 0; begin < names.size();) {
    const size_t end = std::min(names.find('/', begin), names.size());
    if (end > begin) out.push_back(names.substr(begin, end - begin));
    begin = end + 1;
  }
  // note: one that the dataset does not have is the page's mistake, and no reason to show none.
  if (!view_->setImageryLayers(out).ok()) return;
  view_->requestRender();
}

void WebView::setStyle(const WebStyle& style) {
  style_ = style;
  PatchSelection& selection = view_->selection();
  choose(selection.surface, kSurfaces, style.surface);
  selection.exaggeration = style.exaggeration;
  view_->setFrameControl({.leastTau = style.tau, .mostTau = style.tau});
  view_->requestRender();
}

void WebView::setCamera(double eyeEast, double eyeNorth, double eyeHeight, double targetEast,
                        double targetNorth, double targetHeight, double fovyDegrees) {
  wanted_ = WantedCamera{
      {eyeEast, eyeNorth, eyeHeight}, {targetEast, targetNorth, targetHeight}, fovyDegrees * kRadians};
}

void WebView::redraw() {
  view_->requestRender();
}

bool WebView::frame(double nowSeconds) {
  if (!renderer_ || !problem_.empty() || width_ < 1 || height_ < 1) return false;
  context_->makeCurrent();
  const Camera seen = camera();
  if (!style_.frozen)
    frozen_.reset();
  else if (!frozen_ && isReady())
    frozen_ = seen;
  if (frozen_) view_->requestRender();
  giveStages();
  auto changed = view_->update(frozen_.value_or(seen), nowSeconds);
  if (!changed.ok()) {
    fail(changed.error());
    return false;
  }
  const bool draws = *changed && isReady();
  if (draws) {
    const Status drawn = draw(seen);
    if (!drawn.ok()) fail(drawn.error());
  }
  workers_.work(kDecodeSeconds);
  return draws;
}

Camera WebView::camera() const {
  Camera out;
  out.width = width_;
  out.height = height_;
  if (!isReady()) return out;
  if (!wanted_) return overviewCamera(view_->groundBox(), 180.0, 32.0, out.fovyRadians, width_, height_);
  const Frame& frame = view_->manifest().frame;
  const auto local = [&](glm::dvec3 crs) {
    glm::dvec3 place = frame.localFromCrs(crs);
    place.z *= style_.exaggeration;
    return place;
  };
  return lookAt(local(wanted_->eyeCrs), local(wanted_->targetCrs), wanted_->fovyRadians, width_, height_);
}

RenderStyle WebView::renderStyle() const {
  RenderStyle out = defaultStyle(view_->manifest());
  out.samples = static_cast<int>(style_.samples);
  choose(out.mode, kModes, style_.mode);
  choose(out.outline, kOutlines, style_.outline);
  out.exaggeration = style_.exaggeration;
  out.sunAzimuthDegrees = style_.sunAzimuth;
  out.sunAltitudeDegrees = style_.sunAltitude;
  out.haze = style_.haze;
  out.imageryRelief = style_.imageryRelief;
  out.imageryBrightness = style_.imageryBrightness;
  out.tauPixels = style_.tau;
  if (!style_.water) out.waterLevelMeters.reset();
  if (frozen_) {
    const GroundBox box = view_->groundBox();
    out.frustum = FrustumOverlay{*frozen_, 0.5 * glm::length(box.high - box.low)};
  }
  return out;
}

Status WebView::draw(const Camera& camera) {
  if (!picture_ || picture_->spec().width != width_ || picture_->spec().height != height_) {
    picture_.reset();
    TERRANE_ASSIGN(gpu::Framebuffer made,
                   gpu::Framebuffer::create(*context_, {.width = width_, .height = height_}));
    picture_.emplace(std::move(made));
  }
  TERRANE_ASSIGN(drawn_,
                 renderer_->draw(view_->cut(), view_->manifest().frame, camera, renderStyle(), *picture_));
  picture_->copyToWindow();
  return {};
}

WebReport WebView::report() const {
  const ViewReport& from = view_->report();
  const StreamStatistics& stream = from.stream;
  return {.triangles = static_cast<double>(from.triangles),
          .patches = static_cast<double>(from.patches),
          .drawCalls = static_cast<double>(drawn_.drawCalls),
          .errorPixels = from.errorPixels,
          .tau = from.tau,
          .memoryFactor = from.memoryFactor,
          .ramping = static_cast<double>(from.ramping),
          .tilesOnGpu = static_cast<double>(from.tilesOnGpu),
          .imageryOnGpu = static_cast<double>(from.imageryOnGpu),
          .gpuBytes = static_cast<double>(from.gpuBytes),
          .meshBytes = static_cast<double>(from.meshBytes),
          .decodedBytes = static_cast<double>(stream.decodedBytes),
          .heapBytes = static_cast<double>(emscripten_get_heap_size()),
          .bytesReceived = static_cast<double>(stream.bytesReceived),
          .bytesUnwanted = static_cast<double>(stream.bytesUnwanted),
          .bytesUnderway = static_cast<double>(stream.bytesUnderway),
          .requests = static_cast<double>(stream.requests),
          .requestsUnderway = static_cast<double>(stream.requestsUnderway),
          .requestsFailed = static_cast<double>(stream.requestsFailed),
          .tilesDecoded = static_cast<double>(stream.tilesDecoded),
          .tilesLost = static_cast<double>(stream.tilesLost),
          .wishes = static_cast<double>(stream.wishes),
          .wishedBytes = static_cast<double>(stream.wishedBytes),
          .debt = stream.debt,
          .looseness = stream.looseness,
          .bytesPerSecond = stream.bytesPerSecond,
          .latencySeconds = stream.latencySeconds,
          .selectSeconds = from.selectSeconds,
          .isOffline = stream.isOffline,
          .workers = static_cast<double>(workers_.live())};
}

emscripten::val WebView::tilesByLevel() {
  numbers_.clear();
  std::set<TileId> seen;
  for (const Patch& patch : view_->cut().patches) {
    if (!seen.insert(patch.tile).second) continue;
    const auto level = static_cast<size_t>(patch.tile.level);
    if (numbers_.size() <= level) numbers_.resize(level + 1, 0.0);
    numbers_[level] += 1.0;
  }
  return numbers();
}

emscripten::val WebView::numbers() const {
  return emscripten::val(emscripten::typed_memory_view(numbers_.size(), numbers_.data()));
}

emscripten::val WebView::readPicture() {
  pixels_ = picture_ ? picture_->readRgba8() : std::vector<uint8_t>();
  return emscripten::val(emscripten::typed_memory_view(pixels_.size(), pixels_.data()));
}

}  // namespace terrane
