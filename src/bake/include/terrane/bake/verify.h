#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"

namespace terrane {

struct VerifyOptions {
  int threads = 0;                            ///< 0: all cores
  std::string scratchFolder;                  ///< for decoded tiles; empty: the system's temporary folder
  const std::atomic<bool>* cancel = nullptr;  ///< once true, ends with an error; may be null
};

/// What is wrong with a dataset, and how much was looked at.
struct VerifyReport {
  uint64_t tiles = 0;
  uint64_t nodes = 0;
  uint64_t imageryTiles = 0;
  uint64_t bytes = 0;  ///< of all files, hashed
  uint64_t faultCount = 0;
  std::vector<std::string> faults;  ///< the first of them, in words; none: the dataset is sound
  double seconds = 0.0;
};

/// Checks a whole dataset: the size and hash of every file, every tile's payload (imagery's too), that
/// samples on tile borders are equal bit for bit (also to what is interpolated where a neighbour is not
/// stored), coverage, that every node's error and range hold for the finest stored samples, that they are
/// strictly saturated and nested over tile borders, and what tiles say of their children. Faults of the
/// dataset stand in the report; an Error is a directory that cannot be opened as a dataset at all, a changed
/// manifest, cancellation or a full disk.
Result<VerifyReport> verifyDataset(const std::string& directory, const VerifyOptions& options,
                                   Progress& progress);

}  // namespace terrane
