#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/dataset/byte_source.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// The PMTiles tile id: all tiles of the levels above, then the place on the level's Hilbert curve.
uint64_t pmtilesId(TileId id);
/// Only for the ids of levels up to kMaxLevel.
TileId tileIdFromPmtiles(uint64_t pmtilesId);

/// Where a tile's bytes lie; where they are those of the tile before, which is stored once, that one's place.
/// The writer counts from the beginning of the archive's tile data, the reader from that of the file.
struct PmtilesPlace {
  uint64_t id = 0;  ///< pmtilesId() of the tile
  uint64_t offset = 0;
  uint64_t bytes = 0;
};

/// Writes a PMTiles v3 archive, clustered, tile type unknown, no compression of tiles. Tiles are written as
/// they come, in ascending pmtilesId, straight into the file.
class PmtilesWriter {
 public:
  /// Creates `path`, which must not exist; nothing is complete until finish(). An archive that is not
  /// finished is removed again.
  static Result<PmtilesWriter> create(const std::string& path);
  /// Goes on with an archive that was not finished, or whose end is to be made again: `before` is what the
  /// first calls of add() gave; what the file holds beyond is cut off. With nothing before, makes the file
  /// anew. An archive that is not finished stays as it is. Errors: the file does not hold what it should.
  static Result<PmtilesWriter> goOn(const std::string& path, std::span<const PmtilesPlace> before);
  ~PmtilesWriter();
  PmtilesWriter(PmtilesWriter&&) noexcept;
  PmtilesWriter& operator=(PmtilesWriter&&) noexcept;

  /// Appends a tile of at least one byte; ids must ascend. Identical neighbours are stored once (run
  /// lengths).
  Result<PmtilesPlace> add(TileId id, std::span<const uint8_t> bytes);
  /// Writes directories, `metadataJson` and header, syncs and closes.
  Status finish(const std::string& metadataJson);

 private:
  struct State;
  explicit PmtilesWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads a PMTiles v3 archive of the kind that PmtilesWriter makes (docs/format/dataset-v1.md). Const calls
/// may come from any thread.
class PmtilesReader {
 public:
  /// Reads and checks the header and all directories, 24 bytes of memory an entry; whatever the file holds,
  /// memory stays in proportion to its size.
  static Result<PmtilesReader> open(const std::string& path);
  /// The same for a file that is open in `source`, and has `fileBytes` there. Three rounds of reading at
  /// most.
  static Result<PmtilesReader> open(std::shared_ptr<const ByteSource> source, const std::string& file,
                                    uint64_t fileBytes);
  ~PmtilesReader();
  PmtilesReader(PmtilesReader&&) noexcept;
  PmtilesReader& operator=(PmtilesReader&&) noexcept;

  /// A tile's bytes, or nothing where the archive has none.
  Result<std::optional<std::vector<uint8_t>>> read(TileId id) const;
  /// Those of several tiles, in their order, read together.
  Result<std::vector<std::optional<std::vector<uint8_t>>>> read(std::span<const TileId> ids) const;
  /// Where in the file a tile's bytes lie, or nothing where the archive has none.
  std::optional<PmtilesPlace> find(TileId id) const;
  /// All tiles, in the archive's order, and how many they are.
  std::vector<TileId> tiles() const;
  uint64_t tileCount() const;

 private:
  struct State;
  explicit PmtilesReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace terrane
