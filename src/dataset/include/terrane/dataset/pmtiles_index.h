#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Where an archive's tiles lie, as far as its directories have arrived: for clients that read an archive by
/// ranges. Asks for nothing itself. A plain value; const calls may come from any thread.
class PmtilesIndex {
 public:
  /// An archive's first bytes hold its header and root directory.
  static constexpr uint64_t kFirstBytes = 16384;

  /// Bytes of the archive's file.
  struct Place {
    uint64_t offset = 0;
    uint64_t bytes = 0;
  };
  enum class Kind : uint8_t {
    NotStored,
    Stored,       ///< `place` is the tile's
    InDirectory,  ///< not known before the directory at `place` was added
  };
  struct Found {
    Kind kind = Kind::NotStored;
    Place place;
  };

  PmtilesIndex();
  ~PmtilesIndex();
  PmtilesIndex(PmtilesIndex&&) noexcept;
  PmtilesIndex& operator=(PmtilesIndex&&) noexcept;

  /// Reads the header and root directory. `firstBytes`: the archive's first kFirstBytes, or all of a smaller
  /// one; `archiveBytes`: its whole size. Errors: what is wrong in them, without a file's name.
  static Result<PmtilesIndex> open(std::span<const uint8_t> firstBytes, uint64_t archiveBytes);

  /// Where a tile lies. Places are within the archive, whatever the directories say. O(log n).
  Found find(TileId id) const;
  /// Adds a leaf directory that find() named. Error: it is damaged; it may be added again.
  Status addDirectory(Place place, std::span<const uint8_t> bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace terrane
