#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// The PMTiles tile id: all tiles of the levels above, then the place on the level's Hilbert curve.
uint64_t pmtilesId(TileId id);
TileId tileIdFromPmtiles(uint64_t pmtilesId);

/// Writes a PMTiles v3 archive, clustered, tile type unknown, no compression of tiles. Tiles come in any
/// order of calls... they are laid down in ascending pmtilesId; see add().
class PmtilesWriter {
 public:
  /// Creates `path`, which must not exist; nothing is complete until finish().
  static Result<PmtilesWriter> create(const std::string& path);
  ~PmtilesWriter();
  PmtilesWriter(PmtilesWriter&&) noexcept;
  PmtilesWriter& operator=(PmtilesWriter&&) noexcept;

  /// Appends a tile; ids must ascend. Identical neighbours are stored once (run lengths).
  Status add(TileId id, std::span<const uint8_t> bytes);
  /// Writes directories, `metadataJson` and header, syncs and closes.
  Status finish(const std::string& metadataJson);

 private:
  struct State;
  explicit PmtilesWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads a PMTiles v3 archive. Const calls may come from any thread.
class PmtilesReader {
 public:
  static Result<PmtilesReader> open(const std::string& path);
  ~PmtilesReader();
  PmtilesReader(PmtilesReader&&) noexcept;
  PmtilesReader& operator=(PmtilesReader&&) noexcept;

  Result<std::optional<std::vector<uint8_t>>> read(TileId id) const;
  std::vector<TileId> tiles() const;

 private:
  struct State;
  explicit PmtilesReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace terrane
