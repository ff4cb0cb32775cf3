#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "terrane/engine/terrain.h"
#include "terrane/engine/terrain_view.h"
#include "terrane/gpu/context.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/measure_picture.h"
#include "terrane/reference/reference_surface.h"
#include "terrane/stream/simulated_line.h"

namespace terrane {

/// A flight over a dataset that comes over a simulated line, in simulated time: the same in every run.
struct StreamFlightOptions {
  LineModel line;
  LineFaults faults;
  ViewOptions view;
  int width = 640;
  int height = 360;
  double framesPerSecond = 60.0;
  double durationSeconds = 10.0;
  bool begunAtRest = true;  ///< what the first camera needs has come before; else only directories have
  bool draw = true;         ///< draw positions in each frame and count cracks
  int errorEvery = 6;       ///< frames between those whose error is measured; 0: none
  /// Wraps the line, to look at what is asked for.
  std::function<std::unique_ptr<Transport>(std::unique_ptr<Transport>)> wrapLine;
  /// Looks at the view after each frame of the flight.
  std::function<void(const TerrainView&)> afterFrame;
  /// Pictures to look at: PREFIX_SECONDS.png of the first frames at or after these times.
  std::string picturePrefix;
  std::vector<double> pictureSeconds;
};

struct StreamFlightFrame {
  double seconds = 0.0;
  ViewReport view;
  uint64_t bytes = 0;  ///< that came since the flight began
  int64_t cracks = 0;
  int64_t crackPixels = 0;     ///< that were looked at
  int64_t groundPixels = 0;    ///< that show ground
  double debtPixels = 0.0;     ///< bound of the error above tau of what waits for tiles, times its pixels
  double excessPixels = -1.0;  ///< error above tau, summed over the picture; negative: not measured
  double p999Pixels = -1.0;    ///< error that 99.9 % of the pixels stay below
};

struct StreamFlightReport {
  std::vector<StreamFlightFrame> frames;
  double debtPixelSeconds = 0.0;    ///< of debtPixels, over the flight
  double excessPixelSeconds = 0.0;  ///< of the true error above tau, over all pixels and the flight
  int64_t cracks = 0;
  int64_t crackPixels = 0;
  int framesUntilUsed = 0;
  uint64_t tilesSpoilt = 0;  ///< answers that the line spoilt
};

/// A flight in a few numbers.
struct StreamFlightSummary {
  StreamStatistics stream;    ///< at its end
  double loosest = 1.0;       ///< largest looseness
  double memoryFactor = 1.0;  ///< largest
};
StreamFlightSummary summaryOf(const StreamFlightReport& report);

/// The report: {"bench": "stream", head, "line": {...}, "summary": {...}, "frames": [{...}]}
/// (docs/flights.md); and in words and numbers, for a terminal.
nlohmann::ordered_json streamReportToJson(const StreamFlightReport& report, const FlightHead& head,
                                          const StreamFlightOptions& options);
std::string streamReportToText(const StreamFlightReport& report, const FlightHead& head,
                               const StreamFlightOptions& options);

/// The policies by their names: available, progressive, all-at-once.
const std::vector<std::pair<std::string, StreamPolicy>>& streamPolicies();

/// What a flight is measured against.
struct StreamTruth {
  const ReferenceSurface& surface;
  const ReferenceSurface::Cover& cover;
};

/// Flies with the camera of each time. `truth` and, if nothing is drawn, `context` may be null. `progress`
/// hears of frames. Errors: the dataset, the GPU.
Result<StreamFlightReport> flyStream(const std::string& dataset,
                                     const std::function<Camera(double seconds)>& cameraAt,
                                     const StreamTruth* truth, gpu::Context* context,
                                     const StreamFlightOptions& options, Progress& progress);

/// The tiles that a camera needs with everything known, ancestors included: what StreamPolicy's other rules
/// go by. Loads them into `terrain`, which must outlive the result.
std::function<std::vector<TileId>(const Camera&, const PatchSelection&)> neededTilesOf(Terrain& terrain);

}  // namespace terrane
