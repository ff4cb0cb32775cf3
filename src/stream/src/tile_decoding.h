#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "archives.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/codec/tile.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/workers.h"
#include "tile_shelf.h"

namespace terrane {

/// Hands payloads from the shelf to the workers, and collects what they have made of them. Changes nothing on
/// the shelf. One thread; the workers have their own.
class TileDecoding {
 public:
  /// What became of a payload: a tile, a picture, or a problem.
  struct Made {
    TileKey key;
    std::shared_ptr<const Tile> tile;  ///< with one layer of significance more, of a refinement
    std::shared_ptr<const ImageryTile> picture;
    std::string problem;    ///< what, where; empty if there is none
    bool isSketch = false;  ///< of a beginning
  };

  /// `where`: the directory or address, for messages. All else must outlive this.
  TileDecoding(Workers& workers, const Archives& archives, const TileShelf& shelf, std::string where);

  /// How many are being decoded; with as many as the workers can use at once, it is full.
  int underway() const { return underway_; }
  bool isFull() const { return underway_ >= workers_.width(); }

  /// Has the payload of an entry decoded, if that of which it needs the samples is decoded: its parent, and
  /// what it refines. Returns whether it is.
  bool start(const TileKey& key, const ShelfEntry& entry);
  /// Has made what can be made of the beginning of a root.
  void startSketch(const TileKey& key, const ShelfEntry& entry);

  /// What has been made since the last call.
  std::vector<Made> takeMade();

 private:
  struct Finished;
  struct Taker;

  bool startElevation(const TileKey& key, const ShelfEntry& entry);
  bool startRefinement(const TileKey& key, const ShelfEntry& entry);
  Taker takerOf(const TileKey& key, bool isSketch) const;

  Workers& workers_;
  const Archives& archives_;
  const TileShelf& shelf_;
  std::string where_;
  int underway_ = 0;
  std::shared_ptr<Finished> finished_;
};

}  // namespace terrane
