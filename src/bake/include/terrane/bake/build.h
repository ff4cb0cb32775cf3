#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "terrane/bake/imagery.h"
#include "terrane/bake/source.h"
#include "terrane/base/progress.h"
#include "terrane/base/result.h"

namespace terrane {

struct BuildOptions {
  std::string output;        ///< `name.terrane`
  bool overwrite = false;    ///< replace a dataset that stands there; anything else is never replaced
  int threads = 0;           ///< 0: all cores
  uint64_t memoryBytes = 0;  ///< 0: a quarter of the machine's
  std::string optionsText;   ///< for the manifest
  std::string attribution;
  ImageryOptions imagery;
  /// The bounds of all layers of significance but the last, metres, falling; empty: one layer, or with
  /// `layersBySpacing` as many as the ground's spacing allows where samples are left to interpolation.
  /// Datasets that are added to have one.
  std::vector<double> layerErrors;
  bool layersBySpacing = false;
  const std::atomic<bool>* cancel = nullptr;  ///< once true, the build ends with an error; may be null
};

/// The jobs of one step of a build.
struct StageReport {
  std::string name;
  int64_t jobsDone = 0;     ///< by this run
  int64_t jobsResumed = 0;  ///< by runs before, not done again
};

/// What a build did, for people and for --json.
struct BuildReport {
  uint64_t tiles = 0;
  uint64_t tilesCopied = 0;   ///< of these, taken from the dataset that was added to as they were
  uint64_t archiveBytes = 0;  ///< of the elevation, all layers together
  double samples = 0.0;       ///< samples with data, of all inputs on their native levels
  double bitsPerSample = 0.0;
  uint64_t imageryTiles = 0;  ///< of all layers
  uint64_t imageryBytes = 0;
  double seconds = 0.0;
  std::vector<StageReport> stages;
};

/// May a dataset be written to options.output? Errors say why not. Cheap; buildDataset() asks again.
Status checkOutput(const BuildOptions& options);

/// Builds a dataset from a source, in a folder beside the output (`name.terrane.partial`) from which it is
/// renamed into place at the end; until then what stood there still stands. A build that ended early, be it
/// by SIGKILL, goes on when it is run again from the same inputs with the same options. The same source gives
/// the same archive, byte by byte, whatever the threads, the memory, and how often it was interrupted.
/// Errors: the source's, the output's, a full disk, cancellation, another build of the same output. They say
/// whether there is something to go on from; where no job was done, nothing is left behind.
/// A source with a base() replaces that dataset, overwrite or not; options.output must be its directory. Its
/// attribution and optionsText are kept where `options` has none, else joined.
Result<BuildReport> buildDataset(const Source& source, const BuildOptions& options, Progress& progress);

}  // namespace terrane
