#pragma once

#include <emscripten/val.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrane/engine/terrain_view.h"
#include "terrane/render/terrain_renderer.h"
#include "terrane/tiling/flight.h"
#include "web_workers.h"

namespace terrane {

/// What a view may take, in megabytes of 2^20 bytes: EngineLimits of web/package/src/engine.ts.
struct WebLimits {
  double compressed = 32.0;
  double decoded = 128.0;
  double pictures = 32.0;
  double gpuGeometry = 96.0;
  double gpuTexture = 192.0;
  double meshes = 128.0;
  double uploadAFrame = 4.0;
};

/// EngineStyle of web/package/src/engine.ts.
struct WebStyle {
  std::string surface = "patches";
  double tau = 1.0;
  double samples = 4.0;
  std::string mode = "shaded";
  std::string outline = "none";
  double exaggeration = 1.0;
  double sunAzimuth = 315.0;
  double sunAltitude = 38.0;
  bool haze = true;
  double imageryRelief = 0.45;
  double imageryBrightness = 1.0;
  bool water = true;
  bool frozen = false;
};

/// EngineReport of web/package/src/engine.ts.
struct WebReport {
  double triangles = 0.0;
  double patches = 0.0;
  double drawCalls = 0.0;
  double errorPixels = 0.0;
  double tau = 0.0;
  double memoryFactor = 1.0;
  double ramping = 0.0;
  double tilesOnGpu = 0.0;
  double imageryOnGpu = 0.0;
  double gpuBytes = 0.0;
  double meshBytes = 0.0;
  double decodedBytes = 0.0;
  double heapBytes = 0.0;
  double bytesReceived = 0.0;
  double bytesUnwanted = 0.0;
  double bytesUnderway = 0.0;
  double requests = 0.0;
  double requestsUnderway = 0.0;
  double requestsFailed = 0.0;
  double tilesDecoded = 0.0;
  double tilesLost = 0.0;
  double wishes = 0.0;
  double wishedBytes = 0.0;
  double debt = 0.0;
  double looseness = 1.0;
  double bytesPerSecond = 0.0;
  double latencySeconds = 0.0;
  double selectSeconds = 0.0;
  bool isOffline = false;
  double workers = 0.0;
};

/// A view of one dataset, as pages have it: on one canvas at a time. web/package/src/engine.ts says what each
/// function does; bindings.cpp binds them.
class WebView {
 public:
  WebView(const std::string& url, const WebLimits& limits);

  void open();
  void attach(emscripten::val canvas);
  void detach();

  std::string problem() const { return problem_; }
  std::string trouble() const;
  std::string rendererName() const { return context_ ? context_->rendererName() : std::string(); }
  bool isReady() const { return view_->phase() == StreamPhase::Ready; }
  bool isSettled() const { return view_->isSettled() && workers_.isIdle() && !preparedLines_; }
  std::string datasetJson() const;

  void setSize(int width, int height);
  void setImageryLayers(const std::string& names);
  void setStyle(const WebStyle& style);
  void setCamera(double eyeEast, double eyeNorth, double eyeHeight, double targetEast, double targetNorth,
                 double targetHeight, double fovyDegrees);

  bool frame(double nowSeconds);
  void redraw();
  WebReport report() const;
  emscripten::val tilesByLevel();
  emscripten::val readPicture();

  // Questions about the ground that is here: web_ground.cpp.
  double elevationAt(double easting, double northing) const;
  double elevationErrorAt(double easting, double northing) const;
  emscripten::val pick(double x, double y);
  emscripten::val profile(const emscripten::val& corners, double count);
  emscripten::val lineOfSight(double fromEast, double fromNorth, double fromAboveGround, double toEast,
                              double toNorth, double toAboveGround, double refraction, double lengthMeters);

  void studyGround(const emscripten::val& corners, const emscripten::val& counts);

  // Lines on the ground, and stages of the page's own: web_stages.cpp.
  void setLines(const emscripten::val& corners, const emscripten::val& lines);
  std::string setPass(const std::string& name, const std::string& fragment, double originEast,
                      double originNorth, double originHeight);
  void removePass(const std::string& name);
  void setPassUniform(const std::string& name, const std::string& uniform, const emscripten::val& values);

  // Flights over it: web_flight.cpp.
  std::string loadFlight(const std::string& json);
  double flightSeconds() const;
  emscripten::val flightCamera(double seconds);

 private:
  struct WantedCamera {
    glm::dvec3 eyeCrs;
    glm::dvec3 targetCrs;
    double fovyRadians = 0.0;
  };
  /// A line as the page has it.
  struct WantedLine {
    std::vector<glm::dvec2> cornersCrs;
    GroundLine line;  ///< without corners
  };
  struct WantedPass {
    std::string name;
    std::string fragment;
    glm::dvec3 originCrs;
  };

  void fail(const Error& error) { problem_ = error.message; }
  Camera camera() const;
  RenderStyle renderStyle() const;
  Status draw(const Camera& camera);
  std::string givePass(const WantedPass& pass);
  void giveStages();
  void showLines(const PreparedLines& lines);
  glm::dvec2 sampleOf(double easting, double northing) const;
  emscripten::val numbers() const;

  std::string problem_;
  WebStyle style_;
  int width_ = 0;
  int height_ = 0;
  std::optional<WantedCamera> wanted_;
  std::optional<Camera> frozen_;  ///< what is drawn was chosen for it
  std::unique_ptr<gpu::Context> context_;
  std::unique_ptr<TerrainRenderer> renderer_;
  WebWorkers workers_;
  std::unique_ptr<TerrainView> view_;
  std::optional<gpu::Framebuffer> picture_;
  DrawStatistics drawn_;
  std::vector<uint8_t> pixels_;
  std::vector<WantedLine> lines_;   ///< that wait for the dataset's frame, or for those before them
  std::vector<WantedPass> passes_;  ///< the same
  bool hasNewLines_ = false;
  bool arePreparing_ = false;                           ///< lines, aside
  std::shared_ptr<const PreparedLines> preparedLines_;  ///< that wait for the next frame
  std::string stageTrouble_;                            ///< what went wrong with the lines
  std::optional<FittedFlight> flight_;
  std::vector<double> numbers_;  ///< what the last question was answered with
};

}  // namespace terrane
