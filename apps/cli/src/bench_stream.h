#pragma once

#include <string>

#include "terrane/base/result.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/reference_surface.h"
#include "terrane/scene/stream_flight.h"

namespace terrane::cli {

/// --line "40Mbit/s,50ms": bits (bit/s, kbit/s, Mbit/s, Gbit/s) or bytes (B/s, kB/s, MB/s) a second, and the
/// time from a request to its first byte (ms, s).
Result<LineModel> parseLine(const std::string& text);

/// `terrane bench --policy`: a flight over a dataset on disk that comes over a simulated line.
struct StreamBench {
  std::string dataset;
  const FittedFlight& flight;
  FlyOptions fly;
  StreamPolicy policy = StreamPolicy::Available;
  LineModel line;
  PatchSelection selection;
  const ReferenceSurface* reference = nullptr;  ///< draws each frame, and measures it against this
  bool forceSoftware = false;
};
struct StreamBenchResult {
  StreamFlightOptions options;
  StreamFlightReport report;
  std::string rendererName;  ///< empty where nothing was drawn
};
/// `terrain` tells Terrender's rules what a camera needs. Errors: the dataset, the GPU.
Result<StreamBenchResult> flyStreamBench(const StreamBench& bench, Terrain& terrain, Progress& progress);

}  // namespace terrane::cli
