#include "made_meshes.h"

#include <algorithm>
#include <ctime>
#include <unordered_map>

#include "terrane/measure/grid_tiles.h"

namespace terrane {

namespace {

/// Each tile before those below it, these before its neighbours: of however many one takes, there are some of
/// the finest, and they lie in a square.
bool comesBefore(TileId a, TileId b) {
  const auto wayDown = [](TileId id) {
    uint64_t out = 0;
    for (int shift = 2 * (kMaxLevel - id.level); !id.isRoot(); id = id.parent(), shift += 2)
      out |= static_cast<uint64_t>(id.quadrant()) << shift;
    return out;
  };
  const uint64_t downToA = wayDown(a), downToB = wayDown(b);
  return downToA != downToB ? downToA < downToB : a.level < b.level;
}

}  // namespace

Result<MadeMeshes> makeMeshes(const std::string& directory, int64_t mostTriangles) {
  TERRANE_ASSIGN(const Dataset dataset, Dataset::open(directory));
  TERRANE_ASSIGN(const AllTiles tiles, AllTiles::load(dataset));
  MadeMeshes out;
  out.manifest = dataset.manifest();
  const MeshScale meshScale = MeshScale::of(out.manifest.frame, out.manifest.scale);
  std::vector<TileId> ids = dataset.elevationTiles();
  std::sort(ids.begin(), ids.end(), comesBefore);

  // Parents first: a child's first level goes on from their last.
  std::unordered_map<TileId, MeshLevel, TileIdHash> lastOwn;
  for (const TileId id : ids) {
    const bool isFinest = id.level == out.manifest.frame.finestLevel;
    const int last = isFinest ? meshScale.deepestLevel() - 2 * id.level : meshScale.lastOwnLevel();
    const MeshLevel* before = id.isRoot() ? nullptr : &lastOwn.at(id.parent());
    MeshLevel previous;
    for (int level = meshScale.firstLevel(id.isRoot()); level <= last; ++level) {
      previous = makeMeshLevel(id, *tiles.find(id), level, before, meshScale, out.manifest.scale);
      before = &previous;
      if (level == meshScale.lastOwnLevel()) lastOwn[id] = previous;
      out.triangles += static_cast<int64_t>(previous.indices.size() / 3);
      out.vertices += static_cast<int64_t>(previous.vertices.size());
      out.levels.push_back({id, previous, compactOf(previous)});
    }
    if (out.triangles >= mostTriangles) break;
  }
  return out;
}

double threadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace terrane
