#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/byte_source.h"
#include "terrane/dataset/manifest.h"

namespace terrane {

/// A dataset, open for reading. Const calls may come from any thread, and wait for the bytes.
class Dataset {
 public:
  /// Opens `name.terrane`: checks the manifest, every archive's size, and the elevation archives'
  /// directories; tiles are not read. Errors name the file and say what to do.
  static Result<Dataset> open(const std::string& directory);
  /// The same, wherever the files are.
  static Result<Dataset> open(std::shared_ptr<ByteSource> source);
  ~Dataset();
  Dataset(Dataset&&) noexcept;
  Dataset& operator=(Dataset&&) noexcept;

  const Manifest& manifest() const;
  /// Where it is: its directory, or its address for messages.
  const std::string& directory() const;

  /// The stored bytes of a layer of significance of an elevation tile, or nothing where none is stored; of
  /// the first layer where none is named.
  Result<std::optional<std::vector<uint8_t>>> readElevation(int layer, TileId id) const;
  Result<std::optional<std::vector<uint8_t>>> readElevation(TileId id) const { return readElevation(0, id); }
  /// Those of several tiles, in their order, read together: over a line much quicker than one by one.
  Result<std::vector<std::optional<std::vector<uint8_t>>>> readElevation(int layer,
                                                                         std::span<const TileId> ids) const;
  Result<std::vector<std::optional<std::vector<uint8_t>>>> readElevation(std::span<const TileId> ids) const {
    return readElevation(0, ids);
  }
  /// What is stored of an elevation tile in all layers, for decodeAllLayers(), or nothing where none is.
  /// Errors: also a tile that a later layer lacks.
  Result<std::optional<TilePayloads>> readAllLayers(TileId id) const;
  Result<std::vector<std::optional<TilePayloads>>> readAllLayers(std::span<const TileId> ids) const;
  /// All stored elevation tiles, in the archive's order.
  std::vector<TileId> elevationTiles() const;
  /// The stored bytes of a tile of the imagery layer at `layer` of manifest().imagery, or nothing where none
  /// is stored; and all tiles of the layer, in the archive's order.
  Result<std::optional<std::vector<uint8_t>>> readImagery(size_t layer, TileId id) const;
  Result<std::vector<std::optional<std::vector<uint8_t>>>> readImagery(size_t layer,
                                                                       std::span<const TileId> ids) const;
  std::vector<TileId> imageryTiles(size_t layer) const;
  /// Bytes that readElevation(), readAllLayers() and readImagery() have returned so far.
  uint64_t bytesRead() const;

 private:
  struct State;
  explicit Dataset(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads every archive of a dataset on disk and compares its size and SHA-256 with the manifest's: any
/// changed byte is an error that names the file. (The manifest's own hash was checked when it was opened.)
/// Cost: all bytes once.
Status checkArchives(const Dataset& dataset, Progress& progress);

}  // namespace terrane
