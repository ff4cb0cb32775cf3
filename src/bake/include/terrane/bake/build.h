#pragma once

#include <cstdint>
#include <string>

#include "terrane/bake/source.h"
#include "terrane/base/progress.h"
#include "terrane/base/result.h"

namespace terrane {

struct BuildOptions {
  std::string output;       ///< `name.terrane`
  bool overwrite = false;
  int threads = 0;          ///< 0: all cores
  uint64_t memoryBytes = 0; ///< 0: a quarter of the machine's
  std::string optionsText;  ///< for the manifest
  std::string attribution;
};

/// What a build did, for people and for --json.
struct BuildReport {
  uint64_t tiles = 0;
  uint64_t archiveBytes = 0;
  double samples = 0.0;       ///< ground samples of the finest level
  double bitsPerSample = 0.0;
  double seconds = 0.0;
};

/// Builds a dataset from a source: written beside the output and renamed into place at the end.
Result<BuildReport> buildDataset(const Source& source, const BuildOptions& options, Progress& progress);

}  // namespace terrane
