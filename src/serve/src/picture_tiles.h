#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "terrane/base/result.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/dataset/dataset.h"

namespace terrane::serve {

/// Decoded imagery tiles of a dataset, the least recently used of which go. Any thread.
class PictureTiles {
 public:
  /// `dataset` must outlive this. A tile takes 256 KiB.
  PictureTiles(const Dataset& dataset, size_t capacity) : dataset_(dataset), capacity_(capacity) {}

  /// A tile of manifest().imagery[layer]; null where none is stored. Error: it cannot be read or decoded.
  Result<std::shared_ptr<const ImageryTile>> get(size_t layer, TileId id);

 private:
  using Key = std::pair<size_t, TileId>;
  struct Kept {
    Key key;
    std::shared_ptr<const ImageryTile> tile;
  };
  const Dataset& dataset_;
  size_t capacity_;
  std::mutex mutex_;
  std::list<Kept> kept_;  ///< most recently used first
  std::map<Key, std::list<Kept>::iterator> places_;
};

}  // namespace terrane::serve
