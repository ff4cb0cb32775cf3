#include "terrane/engine/tile_orders.h"

#include "terrane/codec/packed.h"

namespace terrane {

namespace {

/// What these orders read of a tile: samples and nodes' errors. Several orders in a row are about the same
/// one.
void packRead(Packer& packer, const std::shared_ptr<const Tile>& tile) {
  packer.object(tile, [](Packer& to, const Tile& read) {
    pack(to, read.samples);
    to.array(read.nodes.error);
  });
}
std::shared_ptr<const Tile> unpackRead(Unpacker& unpacker) {
  return unpacker.object<Tile>([](Unpacker& from) {
    Tile out;
    out.samples = unpackSamples(from);
    out.nodes.error = from.array<uint8_t>();
    return out;
  });
}

}  // namespace

void PrepareTile::pack(Packer& packer) const {
  packRead(packer, tile);
}
PrepareTile PrepareTile::unpack(Unpacker& unpacker) {
  return {unpackRead(unpacker)};
}
void PrepareTile::packAnswer(Packer& packer, const Answer& answer) {
  terrane::pack(packer, *answer);
}
PrepareTile::Answer PrepareTile::unpackAnswer(Unpacker& unpacker) {
  return unpackPrepared(unpacker);
}

void MakeMeshes::pack(Packer& packer) const {
  packRead(packer, tile);
  packer.value(order.id);
  packer.value(static_cast<int32_t>(order.level));
  packer.value(order.meshScale);
  packer.value(order.scale);
  packer.array(order.before != nullptr ? order.before->chosen : std::vector<uint8_t>());
}
MakeMeshes MakeMeshes::unpack(Unpacker& unpacker) {
  MakeMeshes out;
  out.tile = unpackRead(unpacker);
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
  unpacker.require(out.tile->nodes.error.size() == static_cast<size_t>(tileNodeCount(isRoot)),
                   "another number of nodes");
  unpacker.require(before->chosen.size() == (isFirst ? 0 : (size_t{kTileSampleCount} + 7) / 8),
                   "another number of vertices before");
  unpacker.require(
      out.order.level >= out.order.meshScale.firstLevel(isRoot) && out.order.level <= kDeepestVertexLevel,
      "no such mesh level");
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
