#pragma once

#include <memory>
#include <string>
#include <utility>

#include "terrane/stream/simulated_line.h"
#include "terrane/stream/tile_stream.h"

namespace terrane {

/// A stream over a simulated line, in simulated time.
struct Streaming {
  std::unique_ptr<Workers> workers = makeInlineWorkers();
  SimulatedLine* line = nullptr;
  std::unique_ptr<TileStream> stream;
  double now = 0.0;

  Streaming(const std::string& directory, LineModel model, const StreamOptions& options = {},
            const LineFaults& faults = {}) {
    auto simulated = std::make_unique<SimulatedLine>(directory, model, faults);
    line = simulated.get();
    stream = std::make_unique<TileStream>(std::move(simulated), *workers, options);
  }

  void step(double seconds, double until = 1.0 / 60.0) {
    for (const double end = now + seconds; now < end;) {
      now += until;
      stream->poll(now);
    }
  }
  bool open() {
    while (stream->phase() == StreamPhase::Opening && now < 60.0) step(0.01);
    return stream->phase() == StreamPhase::Ready;
  }
  /// Until nothing more can come; how long that took.
  double settle(double most) {
    const double begun = now;
    while (!stream->isIdle() && now < begun + most) step(0.01);
    return now - begun;
  }
};

inline StreamWish wishForTile(TileKey key, double now = 8.0, double area = 1000.0) {
  return {key, now, now / 2.0, 1.0, area, 1.0};
}

}  // namespace terrane
