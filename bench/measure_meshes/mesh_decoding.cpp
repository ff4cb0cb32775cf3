#include "mesh_decoding.h"

#include "coded_mesh.h"
#include "cpu_time.h"

namespace terrane {

Result<MeshDecoding> measureMeshDecoding(const StoredPyramid& pyramid) {
  CodedMesh mesh;
  MeshDecoding decoding;
  std::vector<double> seconds;
  for (int turn = 0; turn < kTurns; ++turn) {
    TERRANE_ASSIGN(const double once, secondsOf([&] {
                     decoding.tiles = decoding.triangles = 0;
                     return pyramid.decodeAll([&](TileId id, const Tile& tile) {
                       ++decoding.tiles;
                       decoding.triangles += static_cast<int64_t>(mesh.trianglesOf(tile.samples, id).size());
                       return Status();
                     });
                   }));
    seconds.push_back(once);
  }
  decoding.seconds = median(seconds);
  return decoding;
}

}  // namespace terrane
