#include <emscripten/bind.h>

#include <memory>
#include <optional>
#include <string>

#include "terrane/engine/default_style.h"
#include "terrane/engine/terrain_view.h"
#include "terrane/render/terrain_renderer.h"

/// What a page sees of the engine: a view of one dataset on one canvas. web/README.md tells it in JavaScript.
namespace terrane {
namespace {

constexpr double kRadians = 0.017453292519943295;
/// Decoding between two frames, so that both fit into one at 60 a second.
constexpr double kDecodeSeconds = 0.006;

/// One frame's numbers, for pages.
struct WebReport {
  double triangles = 0.0;
  double patches = 0.0;
  double errorPixels = 0.0;
  double tau = 0.0;
  double tilesOnGpu = 0.0;
  double imageryOnGpu = 0.0;
  double gpuBytes = 0.0;
  double bytesReceived = 0.0;
  double requests = 0.0;
  double requestsFailed = 0.0;
  double tilesLost = 0.0;
  bool isOffline = false;
};

class WebView {
 public:
  WebView(const std::string& canvasSelector, const std::string& url, double tauPixels, int samples)
      : samples_(samples) {
    auto context = gpu::Context::createOnCanvas(canvasSelector);
    if (!context.ok()) {
      fail(context.error());
      return;
    }
    context_ = std::move(context).value();
    auto renderer = TerrainRenderer::create(*context_);
    if (!renderer.ok()) {
      fail(renderer.error());
      return;
    }
    renderer_ = std::move(renderer).value();
    ViewOptions options;
    options.selection.tolerancePixels = tauPixels;
    // A tab shares its machine with others, and is closed where it takes too much.
    options.stream.compressedBytes = 32U << 20;
    options.stream.decodedBytes = 128U << 20;
    options.stream.pictureBytes = 32U << 20;
    options.gpuGeometryBytes = 96U << 20;
    options.gpuTextureBytes = 192U << 20;
    view_ = std::make_unique<TerrainView>(openHttpTransport(url), workers_, renderer_.get(), options);
  }

  /// Why nothing more will be drawn; empty while all is well.
  std::string problem() const { return problem_; }
  /// What went wrong last without ending it; empty if nothing did.
  std::string trouble() const { return view_ ? view_->problem() : std::string(); }
  std::string rendererName() const { return context_ ? context_->rendererName() : std::string(); }
  bool isReady() const { return view_ && view_->phase() == StreamPhase::Ready; }
  bool isSettled() const { return view_ && view_->isSettled() && workers_.isIdle(); }

  /// From the point `eye` to the point `target`, in the dataset's CRS, with heights in metres; before it is
  /// ready already.
  void setCamera(double eyeEast, double eyeNorth, double eyeHeight, double targetEast, double targetNorth,
                 double targetHeight, double fovyDegrees) {
    wanted_ = WantedCamera{
        {eyeEast, eyeNorth, eyeHeight}, {targetEast, targetNorth, targetHeight}, fovyDegrees * kRadians};
  }
  /// Of the canvas, in its own pixels.
  /// How tiles become triangles: "patches" or "meshes"; anything else changes nothing.
  void setSurface(const std::string& name) {
    if (view_ == nullptr) return;
    if (name == "patches") view_->selection().surface = SurfaceKind::Patches;
    if (name == "meshes") view_->selection().surface = SurfaceKind::Meshes;
  }
  void setSize(int width, int height) {
    width_ = width;
    height_ = height;
  }

  /// The next frame is drawn whatever changed: the canvas has lost its picture.
  void redraw() {
    if (view_) view_->requestRender();
  }

  /// Once a frame: takes in what has come, draws if the picture is another one (then true), decodes for a
  /// while.
  bool frame(double nowSeconds) {
    if (!view_ || !problem_.empty() || width_ < 1 || height_ < 1) return false;
    auto changed = view_->update(camera(), nowSeconds);
    if (!changed.ok()) {
      fail(changed.error());
      return false;
    }
    if (*changed && isReady()) {
      const Status drawn = draw();
      if (!drawn.ok()) fail(drawn.error());
    }
    workers_.work(kDecodeSeconds);
    return *changed;
  }

  WebReport report() const {
    if (!view_) return {};
    const ViewReport& from = view_->report();
    return {.triangles = static_cast<double>(from.triangles),
            .patches = static_cast<double>(from.patches),
            .errorPixels = from.errorPixels,
            .tau = from.tau,
            .tilesOnGpu = static_cast<double>(from.tilesOnGpu),
            .imageryOnGpu = static_cast<double>(from.imageryOnGpu),
            .gpuBytes = static_cast<double>(from.gpuBytes),
            .bytesReceived = static_cast<double>(from.stream.bytesReceived),
            .requests = static_cast<double>(from.stream.requests),
            .requestsFailed = static_cast<double>(from.stream.requestsFailed),
            .tilesLost = static_cast<double>(from.stream.tilesLost),
            .isOffline = from.stream.isOffline};
  }

  /// The picture as it was drawn last: four bytes a pixel, row by row from the top, as an ImageData has them.
  emscripten::val readPicture() {
    pixels_ = picture_ ? picture_->readRgba8() : std::vector<uint8_t>();
    return emscripten::val(emscripten::typed_memory_view(pixels_.size(), pixels_.data()));
  }

 private:
  struct WantedCamera {
    glm::dvec3 eyeCrs;
    glm::dvec3 targetCrs;
    double fovyRadians = 0.0;
  };

  void fail(const Error& error) { problem_ = error.message; }

  Camera camera() const {
    Camera out;
    out.width = width_;
    out.height = height_;
    if (!isReady()) return out;
    if (!wanted_) return overviewCamera(view_->groundBox(), 180.0, 32.0, out.fovyRadians, width_, height_);
    const Frame& frame = view_->manifest().frame;
    return lookAt(frame.localFromCrs(wanted_->eyeCrs), frame.localFromCrs(wanted_->targetCrs),
                  wanted_->fovyRadians, width_, height_);
  }

  Status draw() {
    if (!picture_ || picture_->spec().width != width_ || picture_->spec().height != height_) {
      picture_.reset();
      TERRANE_ASSIGN(gpu::Framebuffer made,
                     gpu::Framebuffer::create(*context_, {.width = width_, .height = height_}));
      picture_.emplace(std::move(made));
    }
    RenderStyle style = defaultStyle(view_->manifest());
    style.samples = samples_;
    const auto drawn = renderer_->draw(view_->cut(), view_->manifest().frame, camera(), style, *picture_);
    if (!drawn.ok()) return drawn.error();
    picture_->copyToWindow();
    return {};
  }

  std::string problem_;
  int samples_;
  int width_ = 0;
  int height_ = 0;
  std::optional<WantedCamera> wanted_;
  std::unique_ptr<gpu::Context> context_;
  std::unique_ptr<TerrainRenderer> renderer_;
  SlicedWorkers workers_;
  std::unique_ptr<TerrainView> view_;
  std::optional<gpu::Framebuffer> picture_;
  std::vector<uint8_t> pixels_;
};

}  // namespace

EMSCRIPTEN_BINDINGS(terrane) {
  emscripten::value_object<WebReport>("Report")
      .field("triangles", &WebReport::triangles)
      .field("patches", &WebReport::patches)
      .field("errorPixels", &WebReport::errorPixels)
      .field("tau", &WebReport::tau)
      .field("tilesOnGpu", &WebReport::tilesOnGpu)
      .field("imageryOnGpu", &WebReport::imageryOnGpu)
      .field("gpuBytes", &WebReport::gpuBytes)
      .field("bytesReceived", &WebReport::bytesReceived)
      .field("requests", &WebReport::requests)
      .field("requestsFailed", &WebReport::requestsFailed)
      .field("tilesLost", &WebReport::tilesLost)
      .field("isOffline", &WebReport::isOffline);
  emscripten::class_<WebView>("View")
      .constructor<std::string, std::string, double, int>()
      .function("problem", &WebView::problem)
      .function("trouble", &WebView::trouble)
      .function("rendererName", &WebView::rendererName)
      .function("isReady", &WebView::isReady)
      .function("isSettled", &WebView::isSettled)
      .function("setCamera", &WebView::setCamera)
      .function("setSize", &WebView::setSize)
      .function("setSurface", &WebView::setSurface)
      .function("redraw", &WebView::redraw)
      .function("frame", &WebView::frame)
      .function("report", &WebView::report)
      .function("readPicture", &WebView::readPicture);
}

}  // namespace terrane
