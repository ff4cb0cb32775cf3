#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "resident_set.h"
#include "terrane/engine/tile_meshes.h"
#include "terrane/lod/select_patches.h"
#include "terrane/render/terrain_renderer.h"
#include "terrane/stream/tile_stream.h"

namespace terrane {

/// The elevation tiles of a streaming view that can be drawn from: prepared aside, uploaded within a budget,
/// dropped when others are needed more. What selection calls resident.
class TileUploads final : public ResidentTiles {
 public:
  /// All must outlive it; `renderer` may be null: then tiles count as uploaded at once.
  TileUploads(const TileStream& stream, Workers& workers, TerrainRenderer* renderer, size_t capacity);

  const Tile* find(TileId id) const override;
  const MeshLevel* findMeshes(TileId id, int level) const override { return meshes_.find(id, level); }
  bool has(TileId id) const { return resident_.has(id); }
  size_t size() const { return resident_.size(); }
  size_t capacity() const { return resident_.capacity(); }
  std::vector<TileId> tiles() const;
  /// Counts how often a tile came or went.
  uint64_t changes() const { return changes_; }

  /// Tiles were decoded in this frame: from now on it counts how long they wait.
  void arrived(const std::vector<TileKey>& news, uint64_t frame);
  /// Uploads those of `order` (most urgent first) that are decoded and whose parents are here, within
  /// `budgetBytes`, at least one; parents may be uploaded by the same call. What was needed since the frame
  /// `keepSince` keeps its place. A root that was only sketched is replaced first, and of what is uploaded
  /// what has more layers of significance by now. Returns how many.
  Result<int> upload(const std::vector<TileId>& order, uint64_t budgetBytes, uint64_t frame,
                     uint64_t keepSince);
  /// Makes the root's own meshes, if they are not made: without them there is nothing to draw. Not aside.
  void makeRootMeshes();
  /// Has what a cut wishes for made aside. Those under way already are left alone.
  void wishMeshes(const std::vector<MeshWish>& wishes);
  /// Takes in meshes that were made; are there any?
  bool takeMeshes();
  bool areMeshesUnderWay() const { return !meshesUnderWay_.empty(); }
  /// A selection begins.
  void beginTurn() { meshes_.beginTurn(); }
  /// Forgets meshes that nothing chosen lately looked at, where all take more than `bytes`.
  void keepMeshesWithin(uint64_t bytes);
  size_t meshBytes() const { return meshes_.sizeBytes(); }
  /// Marks what a cut draws from, and what waits for its wishes to be drawn from.
  void need(const Cut& cut, uint64_t frame);

  /// Did the last upload() leave something out since no place could be freed?
  bool isShortOfRoom() const { return shortOfRoom_; }
  size_t neededSince(uint64_t frame) const { return resident_.neededSince(frame); }
  /// Is anything of `order` decoded and not uploaded?
  bool isPending(const std::vector<TileId>& order) const;
  uint64_t uploaded() const { return uploaded_; }
  int mostFramesUntilUsed() const { return mostFramesUntilUsed_; }

 private:
  struct Prepared {
    std::shared_ptr<const Tile> tile;
    std::shared_ptr<const PreparedTile> made;  ///< null while it is being made
    uint64_t frame = 0;
  };
  struct MadeMeshes {
    MeshWish wish;
    uint64_t roots = 0;  ///< roots that were sketched only and replaced before these were ordered
    std::vector<std::shared_ptr<const MeshLevel>> levels;
  };
  struct Finished {
    std::mutex mutex;
    std::vector<std::pair<std::shared_ptr<const Tile>, std::shared_ptr<const PreparedTile>>> made;
    std::vector<MadeMeshes> meshes;
  };
  /// Is a tile uploaded that is here with more layers of significance by now, or a root from a sketch of it,
  /// and something better is here?
  bool isStale(TileId id) const;
  /// Uploads what is prepared in the place of what was uploaded before.
  Status replace(TileId id);
  bool isPrepared(TileId id, uint64_t frame);
  void takePrepared();
  bool makeRoom(uint64_t frame);
  void addMeshes(TileId id, std::vector<std::shared_ptr<const MeshLevel>> made);

  const TileStream& stream_;
  Workers& workers_;
  TerrainRenderer* renderer_;
  ResidentSet resident_;
  std::unordered_map<TileId, std::shared_ptr<const Tile>, TileIdHash> tiles_;  ///< of residents
  std::unordered_map<TileId, Prepared, TileIdHash> prepared_;
  TileMeshes meshes_;
  std::vector<MeshWish> meshesUnderWay_;
  std::unordered_map<TileId, uint64_t, TileIdHash> arrivedIn_;
  std::unordered_map<TileId, uint64_t, TileIdHash> uploadedIn_;
  std::shared_ptr<Finished> finished_;
  bool shortOfRoom_ = false;
  bool rootIsSketch_ = false;
  uint64_t roots_ = 0;  ///< sketches of the root that were replaced
  uint64_t uploaded_ = 0;
  uint64_t changes_ = 0;
  int mostFramesUntilUsed_ = 0;
};

}  // namespace terrane
