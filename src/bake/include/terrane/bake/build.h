#pragma once

#include <atomic>
#include <cstdint>
#include <string>

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
  const std::atomic<bool>* cancel = nullptr;  ///< once true, the build ends with an error; may be null
};

/// What a build did, for people and for --json.
struct BuildReport {
  uint64_t tiles = 0;
  uint64_t archiveBytes = 0;
  double samples = 0.0;  ///< samples with data, of all inputs on their native levels
  double bitsPerSample = 0.0;
  double seconds = 0.0;
};

/// May a dataset be written to options.output? Errors say why not. Cheap; buildDataset() asks again.
Status checkOutput(const BuildOptions& options);

/// Builds a dataset from a source: written beside the output (`name.terrane.partial-PID`) and renamed into
/// place at the end; whatever goes wrong, nothing is left behind and what stood there still stands. The same
/// source gives the same archive, byte by byte, whatever the threads and the memory.
/// Errors: the source's, the output's, a full disk, cancellation.
Result<BuildReport> buildDataset(const Source& source, const BuildOptions& options, Progress& progress);

}  // namespace terrane
