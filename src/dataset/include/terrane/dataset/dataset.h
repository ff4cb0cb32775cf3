#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/manifest.h"

namespace terrane {

/// A dataset directory on disk, open for reading. Const calls may come from any thread.
class Dataset {
 public:
  /// Opens `name.terrane`: checks the manifest, every archive's size, and the elevation archive's
  /// directories; tiles are not read. Errors name the file and say what to do.
  static Result<Dataset> open(const std::string& directory);
  ~Dataset();
  Dataset(Dataset&&) noexcept;
  Dataset& operator=(Dataset&&) noexcept;

  const Manifest& manifest() const;
  const std::string& directory() const;

  /// The stored bytes of an elevation tile, or nothing where none is stored.
  Result<std::optional<std::vector<uint8_t>>> readElevation(TileId id) const;
  /// All stored elevation tiles, in the archive's order.
  std::vector<TileId> elevationTiles() const;
  /// The stored bytes of a tile of the imagery layer at `layer` of manifest().imagery, or nothing where none
  /// is stored; and all tiles of the layer, in the archive's order.
  Result<std::optional<std::vector<uint8_t>>> readImagery(size_t layer, TileId id) const;
  std::vector<TileId> imageryTiles(size_t layer) const;
  /// Bytes that readElevation() and readImagery() have returned so far.
  uint64_t bytesRead() const;

 private:
  struct State;
  explicit Dataset(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads every archive and compares its size and SHA-256 with the manifest's: any changed byte is an error
/// that names the file. (The manifest's own hash was checked when it was opened.) Cost: all bytes once.
Status checkArchives(const Dataset& dataset, Progress& progress);

}  // namespace terrane
