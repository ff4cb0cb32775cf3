#include "terrane/codec/packed.h"

#include <algorithm>

#include "terrane/base/check.h"

namespace terrane {
namespace {

/// Samples along the side of a quadrant, borders included.
constexpr int kQuadrantSide = kTileCells / 2 + 1;

/// Of a quadrant's row: its first sample's index.
size_t rowOfQuadrant(int quadrant, int row) {
  const int x = (quadrant & 1) * kTileCells / 2, y = (quadrant >> 1) * kTileCells / 2;
  return static_cast<size_t>((y + row) * kTileSamples + x);
}

/// What is wrong with layers of significance that came packed, if anything is.
void requireLayers(Unpacker& unpacker, const TileSamples& samples) {
  unpacker.require(samples.layerCount >= 1 && samples.layerCount <= ElevationScale::kMostLayers,
                   "another number of layers");
  unpacker.require(std::all_of(samples.layers.begin(), samples.layers.end(),
                               [](uint8_t layer) { return layer < ElevationScale::kMostLayers; }),
                   "a sample of no layer");
}

}  // namespace

void pack(Packer& packer, const Coverage& coverage) {
  packer.value(coverage.kind);
  packer.array(coverage.bits);
}
Coverage unpackCoverage(Unpacker& unpacker) {
  Coverage out;
  out.kind = unpacker.value<Coverage::Kind>();
  out.bits = unpacker.array<uint8_t>();
  unpacker.require(out.kind <= Coverage::Kind::Partial, "no coverage of that kind");
  unpacker.require(out.bits.size() == (out.kind == Coverage::Kind::Partial ? Coverage::kBytes : 0),
                   "a mask of another size");
  return out;
}

void pack(Packer& packer, const TileSamples& samples) {
  packer.reserve(kTileSampleCount * (sizeof(float) + sizeof(SampleState)) + samples.layers.size() +
                 Coverage::kBytes + 64);
  packer.array(samples.heights);
  packer.array(samples.states);
  pack(packer, samples.coverage);
  packer.value(static_cast<int32_t>(samples.layerCount));
  packer.array(samples.layers);
}
TileSamples unpackSamples(Unpacker& unpacker) {
  TileSamples out;
  out.heights = unpacker.array<float>(kTileSampleCount);
  out.states = unpacker.array<SampleState>(kTileSampleCount);
  out.coverage = unpackCoverage(unpacker);
  out.layerCount = unpacker.value<int32_t>();
  out.layers = unpacker.array<uint8_t>();
  unpacker.require(out.layers.empty() || out.layers.size() == kTileSampleCount, "layers of another size");
  requireLayers(unpacker, out);
  return out;
}

void packQuadrant(Packer& packer, const TileSamples& parent, int quadrant) {
  TERRANE_CHECK(parent.heights.size() == kTileSampleCount && parent.states.size() == kTileSampleCount &&
                    quadrant >= 0 && quadrant < 4,
                "{} heights, {} states, quadrant {}", parent.heights.size(), parent.states.size(), quadrant);
  packer.reserve(kQuadrantSide * kQuadrantSide * (sizeof(float) + sizeof(SampleState) + sizeof(uint8_t)) +
                 Coverage::kBytes + 64);
  for (int row = 0; row < kQuadrantSide; ++row)
    packer.elements(parent.heights.data() + rowOfQuadrant(quadrant, row), kQuadrantSide);
  for (int row = 0; row < kQuadrantSide; ++row)
    packer.elements(parent.states.data() + rowOfQuadrant(quadrant, row), kQuadrantSide);
  pack(packer, parent.coverage);
  packer.value(static_cast<int32_t>(parent.layerCount));
  packer.value(static_cast<uint8_t>(parent.layers.empty() ? 0 : 1));
  if (parent.layers.empty()) return;
  for (int row = 0; row < kQuadrantSide; ++row)
    packer.elements(parent.layers.data() + rowOfQuadrant(quadrant, row), kQuadrantSide);
}
TileSamples unpackQuadrant(Unpacker& unpacker, int quadrant) {
  TileSamples out;
  unpacker.require(quadrant >= 0 && quadrant < 4, "no such quadrant");
  if (!unpacker.ok()) return out;
  out.heights.resize(kTileSampleCount);
  out.states.resize(kTileSampleCount);
  for (int row = 0; row < kQuadrantSide; ++row)
    unpacker.elements(out.heights.data() + rowOfQuadrant(quadrant, row), kQuadrantSide);
  for (int row = 0; row < kQuadrantSide; ++row)
    unpacker.elements(out.states.data() + rowOfQuadrant(quadrant, row), kQuadrantSide);
  out.coverage = unpackCoverage(unpacker);
  out.layerCount = unpacker.value<int32_t>();
  if (unpacker.value<uint8_t>() != 0) {
    out.layers.resize(kTileSampleCount);
    for (int row = 0; row < kQuadrantSide; ++row)
      unpacker.elements(out.layers.data() + rowOfQuadrant(quadrant, row), kQuadrantSide);
  }
  requireLayers(unpacker, out);
  return out;
}

void pack(Packer& packer, const Tile& tile) {
  packer.reserve(kTileSampleCount * (sizeof(float) + sizeof(SampleState)) + tile.samples.layers.size() +
                 Coverage::kBytes + tile.nodes.error.size() * 6 + 256);
  pack(packer, tile.samples);
  packer.array(tile.nodes.error);
  packer.array(tile.nodes.largeError);
  packer.array(tile.nodes.low);
  packer.array(tile.nodes.high);
  packer.value(tile.children);
}
Tile unpackTile(Unpacker& unpacker) {
  Tile out;
  out.samples = unpackSamples(unpacker);
  out.nodes.error = unpacker.array<uint8_t>();
  out.nodes.largeError = unpacker.array<uint8_t>();
  out.nodes.low = unpacker.array<uint16_t>();
  out.nodes.high = unpacker.array<uint16_t>();
  out.children = unpacker.value<std::array<ChildSummary, 4>>();
  // Of a root there is a level of nodes more; of what is only meshed, errors alone.
  const size_t count = out.nodes.error.size();
  const bool isRoot = count == static_cast<size_t>(tileNodeCount(true));
  unpacker.require(isRoot || count == static_cast<size_t>(tileNodeCount(false)), "another number of nodes");
  const bool isWhole = !out.nodes.low.empty();
  unpacker.require(
      out.nodes.low.size() == (isWhole ? count : 0) && out.nodes.high.size() == out.nodes.low.size() &&
          out.nodes.largeError.size() == (isWhole ? static_cast<size_t>(tileLargeNodeCount(isRoot)) : 0),
      "another number of nodes");
  return out;
}

void pack(Packer& packer, const ImageryTile& picture) {
  packer.reserve(picture.rgba.size() + 64);
  packer.array(picture.rgba);
}
ImageryTile unpackPicture(Unpacker& unpacker) {
  return {unpacker.array<uint8_t>(static_cast<size_t>(kImageryTexels) * 4)};
}

void pack(Packer& packer, const MeshLevel& meshes) {
  packer.reserve(meshes.sizeBytes() + 64);
  packer.value(static_cast<int32_t>(meshes.level));
  packer.value(static_cast<uint8_t>(meshes.centerFalls ? 1 : 0));
  packer.array(meshes.patches);
  packer.array(meshes.vertices);
  packer.array(meshes.indices);
  packer.array(meshes.extras);
  packer.array(meshes.chosen);
  packer.array(meshes.relief.ranges);
  packer.array(meshes.relief.codes);
}
MeshLevel unpackMeshLevel(Unpacker& unpacker) {
  MeshLevel out;
  out.level = unpacker.value<int32_t>();
  out.centerFalls = unpacker.value<uint8_t>() != 0;
  out.patches = unpacker.array<MeshLevel::Patch>();
  out.vertices = unpacker.array<PatchVertex>();
  out.indices = unpacker.array<uint16_t>();
  out.extras = unpacker.array<uint32_t>();
  out.chosen = unpacker.array<uint8_t>((kTileSampleCount + 7) / 8);
  out.relief.ranges = unpacker.array<MeshRelief::Range>();
  out.relief.codes = unpacker.array<uint8_t>();
  const auto isInside = [](uint64_t first, uint64_t count, size_t size) { return first + count <= size; };
  unpacker.require(out.level >= 0 && out.level <= kDeepestVertexLevel &&
                       out.patches.size() == static_cast<size_t>(patchCount(out.level)),
                   "another number of patches");
  unpacker.require(std::all_of(out.patches.begin(), out.patches.end(),
                               [&](const MeshLevel::Patch& patch) {
                                 return isInside(patch.firstVertex, patch.vertexCount, out.vertices.size()) &&
                                        isInside(patch.firstIndex, patch.indexCount, out.indices.size()) &&
                                        isInside(patch.firstExtra, patch.extraCount, out.extras.size());
                               }),
                   "a patch that is not inside");
  if (!unpacker.ok()) return out;
  // note: all patches of a level have as many.
  out.relief.step = reliefStep(out.level);
  const ReliefCounts counts =
      reliefCounts(out.level, PatchOutline(patchCorners(out.level, 0, out.centerFalls)));
  unpacker.require(out.relief.ranges.size() == out.patches.size() &&
                       out.relief.codes.size() == out.patches.size() * static_cast<size_t>(counts.all()),
                   "a relief of another size");
  return out;
}

}  // namespace terrane
