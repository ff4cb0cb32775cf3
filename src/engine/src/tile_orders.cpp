#include "terrane/engine/tile_orders.h"

#include "terrane/codec/packed.h"

namespace terrane {

void PrepareTile::pack(Packer& packer) const {
  terrane::pack(packer, *samples);
}
PrepareTile PrepareTile::unpack(Unpacker& unpacker) {
  return {std::make_shared<const TileSamples>(unpackSamples(unpacker))};
}
void PrepareTile::packAnswer(Packer& packer, const Answer& answer) {
  terrane::pack(packer, *answer);
}
PrepareTile::Answer PrepareTile::unpackAnswer(Unpacker& unpacker) {
  return unpackPrepared(unpacker);
}

void MakeMeshes::pack(Packer& packer) const {
  terrane::pack(packer, tile->samples);
  packer.array(tile->nodes.error);
  packer.value(order.id);
  packer.value(static_cast<int32_t>(order.level));
  packer.value(order.meshScale);
  packer.value(order.scale);
  packer.array(order.before != nullptr ? order.before->chosen : std::vector<uint8_t>());
}
MakeMeshes MakeMeshes::unpack(Unpacker& unpacker) {
  MakeMeshes out;
  auto tile = std::make_shared<Tile>();
  tile->samples = unpackSamples(unpacker);
  tile->nodes.error = unpacker.array<uint8_t>();
  out.order.id = unpacker.value<TileId>();
  out.order.level = unpacker.value<int32_t>();
  out.order.meshScale = unpacker.value<MeshScale>();
  out.order.scale = unpacker.value<ElevationScale>();
  auto before = std::make_shared<MeshLevel>();
  before->chosen = unpacker.array<uint8_t>();

  // What makeMeshLevel() takes for granted.
  const bool isRoot = out.order.id.isRoot();
  const bool isFirst = isRoot && out.order.level == 0;
  unpacker.require(out.order.id.valid(), "no tile of that address");
  unpacker.require(tile->nodes.error.size() == static_cast<size_t>(tileNodeCount(isRoot)),
                   "another number of nodes");
  unpacker.require(before->chosen.size() == (isFirst ? 0 : (size_t{kTileSampleCount} + 7) / 8),
                   "another number of vertices before");
  unpacker.require(
      out.order.level >= out.order.meshScale.firstLevel(isRoot) && out.order.level <= kDeepestVertexLevel,
      "no such mesh level");
  out.tile = std::move(tile);
  if (!isFirst) out.order.before = std::move(before);
  return out;
}
void MakeMeshes::packAnswer(Packer& packer, const Answer& answer) {
  packer.value(static_cast<uint32_t>(answer.size()));
  for (const auto& meshes : answer) terrane::pack(packer, *meshes);
}
MakeMeshes::Answer MakeMeshes::unpackAnswer(Unpacker& unpacker) {
  Answer out;
  const auto count = unpacker.value<uint32_t>();
  for (uint32_t i = 0; i < count && unpacker.ok(); ++i)
    out.push_back(std::make_shared<const MeshLevel>(unpackMeshLevel(unpacker)));
  return out;
}

}  // namespace terrane
