#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"

namespace terrane {

/// How heights are stored: whole metres, or metres in steps of 1/256.
enum class SynthType { kFloat32, kInt16 };

/// What to make. The world is one for each seed; size and spacing only choose the window that is written.
struct SynthOptions {
  std::string output;       ///< GeoTIFF of heights
  std::string colorOutput;  ///< RGB GeoTIFF on the same grid; empty: none
  int64_t cols = 4097;      ///< samples, 2 to kSynthMaxSide
  int64_t rows = 4097;
  double spacingMeters = 10.0;  ///< 0.5 to 1000
  uint64_t seed = 1;
  SynthType type = SynthType::kFloat32;
  bool overwrite = false;
  int threads = 0;                            ///< 0: all cores
  const std::atomic<bool>* cancel = nullptr;  ///< once true, ends soon with an error
};

inline constexpr int64_t kSynthMaxSide = 1 << 20;

/// What was made, for people and for --json.
struct SynthReport {
  int64_t cols = 0;
  int64_t rows = 0;
  double minMeters = 0.0;
  double maxMeters = 0.0;
  double waterShare = 0.0;  ///< of all samples: sea, lakes and rivers
  uint64_t bytes = 0;       ///< of the height file
  uint64_t colorBytes = 0;
  double seconds = 0.0;
};

/// Writes a made-up piece of country: mountains whose valleys drain, plains, lakes, a coast with the sea at
/// height 0, as a tiled GeoTIFF in EPSG:32632, and if asked the land's colours without shading.
///
/// A height is a function of (seed, spacing, position): sample (cols / 2, rows / 2) always lies at
/// E 500000 N 6700000, so a larger size shows more of the same ground and equal places have equal bits,
/// whatever the threads. Other spacings show the same ground with more or less detail. Away from the detail
/// the world repeats every 163.84 km.
///
/// Errors: a bad size or spacing, an output that exists (without `overwrite`) or cannot be written; nothing
/// is left behind then. Cost: a few seconds and 150 MB for the world, then well under a microsecond of one
/// core a sample (colour: twice that) and memory for a row of blocks.
Result<SynthReport> synthesize(const SynthOptions& options, Progress& progress);

}  // namespace terrane
