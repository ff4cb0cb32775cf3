#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "terrane/dataset/dataset.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/transport.h"

namespace terrane {

/// Which tiles lie where in a dataset's archives.
class ArchiveMap {
 public:
  /// Errors: the dataset's files.
  static Result<ArchiveMap> of(const Dataset& dataset);

  /// The tiles of which a request fetches the end (parts of a tile count with their last), and the bytes.
  std::vector<std::pair<TileKey, uint64_t>> tilesIn(const FetchRequest& request) const;
  /// Stored bytes; 0 where nothing is stored.
  uint64_t bytesOf(const TileKey& key) const;
  uint64_t manifestBytes() const { return manifestBytes_; }

 private:
  struct Place {
    TileKey key;
    uint64_t bytes = 0;
  };
  Status add(const Dataset& dataset, const std::string& name, int32_t layer, const std::vector<TileId>& ids);

  std::map<std::string, std::map<uint64_t, Place>> byEnd_;  ///< file, offset after the tile's last byte
  std::map<TileKey, uint64_t> bytes_;
  uint64_t manifestBytes_ = 0;
};

}  // namespace terrane
