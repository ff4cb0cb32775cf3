#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "terrane/stream/tile_key.h"
#include "terrane/stream/transport.h"
#include "tile_shelf.h"

namespace terrane {

/// What has failed, and when it may be tried again: the server that is away, manifest and archives that are
/// to be opened, and directories. Of tiles the shelf remembers it. A plain value; times are seconds of one
/// clock.
class Retries {
 public:
  /// Stands for the manifest where the others have the position of their archive.
  static constexpr int kManifest = -1;

  /// The server answered, whatever it said; or nobody was there.
  void reached() { offlineTries_ = 0; }
  void unreachable(uint64_t requestId, double nowSeconds);
  bool isOffline() const { return offlineTries_ > 0; }
  /// May the server be asked? Where it is away, ever more rarely.
  bool mayAsk(double nowSeconds) const { return !isOffline() || nowSeconds >= offlineUntil_; }

  /// The manifest, or an archive's first bytes. Returns whether there is another try.
  bool openingFailed(int file, double nowSeconds);
  bool isOpeningDue(int file, double nowSeconds) const;

  /// The directory at `offset`: tried again as long as it is needed, but rarely where the server says that
  /// there is none, or after many tries.
  void directoryFailed(int file, uint64_t offset, FetchProblem problem, double nowSeconds);
  bool isDirectoryDue(int file, uint64_t offset, double nowSeconds) const;
  /// Is it given up, at least until it is due again?
  bool isDirectoryLost(int file, uint64_t offset) const;

 private:
  struct Tries {
    int failures = 0;
    double notBefore = 0.0;
    bool isLost = false;
  };
  std::map<int, Tries> opening_;
  std::map<std::pair<int, uint64_t>, Tries> directories_;
  int offlineTries_ = 0;
  double offlineUntil_ = 0.0;
};

/// Writes into the entry of a tile whose bytes did not come, or were damaged, when it is tried again, and
/// whether it is given up until then. `atLeastSeconds`: as the server said.
void tileFailed(const TileKey& key, ShelfEntry& entry, FetchProblem problem, double atLeastSeconds,
                double nowSeconds);

}  // namespace terrane
