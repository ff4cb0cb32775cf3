#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/reference/measure_picture.h"
#include "terrane/reference/reference_surface.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/flight.h"
#include "terrane/tiling/tile_id.h"

/// Flies a flight and writes down what each frame cost and how far from the truth it was. Everything here is
/// free of OpenGL: what draws stands behind FlightScene.
namespace terrane {

/// What drawing a frame took.
struct FrameCost {
  double timeMs = 0.0;    ///< all of it: loading, choosing, drawing, until the GPU is done
  double selectMs = 0.0;  ///< of this, choosing the cut
  double drawMs = 0.0;    ///< of this, drawing
  int64_t triangles = 0;
  int64_t patches = 0;
  int64_t tiles = 0;  ///< tiles that the patches read
  int64_t drawCalls = 0;
  uint64_t bytes = 0;        ///< read from the dataset for this frame
  uint64_t requests = 0;     ///< tiles read for this frame
  int deepestLevel = 0;      ///< tile level of the finest patch
  uint64_t memoryBytes = 0;  ///< of tiles, decoded and on the GPU
};

/// Something that shows a dataset from a camera.
class FlightScene {
 public:
  virtual ~FlightScene() = default;
  /// Loads all that a frame wants.
  virtual Status loadAll(const Camera& camera) = 0;
  /// Loads all that the frame wants and draws it.
  virtual Result<FrameCost> drawFrame(const Camera& camera) = 0;
  /// The place under each pixel (see measure_picture.h), drawn with what is loaded.
  virtual Result<std::vector<glm::dvec3>> places(const Camera& camera) = 0;
  /// Forgets all tiles but the root.
  virtual Status unload() = 0;
  /// Tiles that the frame wants and that are not here, their parents being here; in no particular order.
  virtual Result<std::vector<TileId>> wishes(const Camera& camera) = 0;
  virtual Status load(TileId id) = 0;
};

struct FlyOptions {
  int width = 1280;
  int height = 720;
  double framesPerSecond = 30.0;
  std::optional<int64_t> frames;      ///< this many, evenly spread over the flight, instead
  std::optional<double> fovyDegrees;  ///< overrides the flight's
  double tauPixels = 1.0;
  int64_t referenceEvery = 10;  ///< frames between those that are measured
  int loadingViews = 0;         ///< views at which loading is tried, in random orders
  int loadingMoments = 8;       ///< pictures taken of each, at most
  uint64_t seed = 1;
};

/// One frame of a report.
struct FlightFrame {
  double seconds = 0.0;
  FrameCost cost;
  std::optional<ErrorMeasure> error;
  std::optional<CrackMeasure> cracks;
};

struct FlightReport {
  std::vector<FlightFrame> frames;
  ErrorMeasure error;    ///< of all measured frames
  CrackMeasure cracks;   ///< with everything resident
  CrackMeasure loading;  ///< at random moments of loading
  int64_t loadingPictures = 0;
  double worstErrorSeconds = 0.0;  ///< when the largest error was
};

/// The flight's camera, of the options' size and field of view.
Camera cameraAt(const FittedFlight& flight, double seconds, const FlyOptions& options);

/// The times of the frames that a flight of this length is stepped in.
std::vector<double> frameTimes(double durationSeconds, const FlyOptions& options);

/// Flies. `reference` may be null: then nothing is measured but cost; `cover` is needed for loadingViews
/// only. Errors are the scene's.
Result<FlightReport> fly(FlightScene& scene, const FittedFlight& flight, const FlyOptions& options,
                         const ReferenceSurface* reference, const ReferenceSurface::Cover* cover,
                         Progress& progress);

/// Loads tile by tile in a random order for one camera, and counts cracks at random moments in between.
/// `pictures` grows by the number taken.
Result<CrackMeasure> measureLoading(FlightScene& scene, const Camera& camera,
                                    const ReferenceSurface::Cover& cover, int moments, uint64_t seed,
                                    int64_t& pictures);

/// What was flown, for the report's head.
struct FlightHead {
  std::string dataset;
  std::string flight;
  std::string surface;
  std::string renderer;  ///< what drew, with its version
  int k = 0;             ///< samples along a patch's side
};

/// The report: {"bench": "flight", head, "summary": {...}, "frames": [{...}]} (docs/flights.md).
nlohmann::ordered_json reportToJson(const FlightReport& report, const FlightHead& head,
                                    const FlyOptions& options);
/// The summary in words and numbers, for a terminal.
std::string reportToText(const FlightReport& report, const FlightHead& head, const FlyOptions& options);
/// The series as small multiples, one SVG document.
std::string plotReport(const FlightReport& report, const FlightHead& head, const FlyOptions& options);

}  // namespace terrane
