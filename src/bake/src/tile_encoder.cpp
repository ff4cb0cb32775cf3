#include "tile_encoder.h"

#include "node_measure.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

namespace {

bool sameScale(const ElevationScale& a, const ElevationScale& b) {
  return a.heightStep == b.heightStep && a.heightOffset == b.heightOffset && a.errorUnit == b.errorUnit &&
         a.rangeBase == b.rangeBase && a.rangeUnit == b.rangeUnit && a.sampleError == b.sampleError;
}

bool sameSamples(const TileSamples& a, const TileSamples& b) {
  return a.heights == b.heights && a.states == b.states && a.coverage.kind == b.coverage.kind &&
         a.coverage.bits == b.coverage.bits;
}

bool sameTile(const Tile& a, const Tile& b) {
  for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
    const ChildSummary& one = a.children[quadrant];
    const ChildSummary& other = b.children[quadrant];
    if (one.state != other.state || one.error != other.error || one.low != other.low ||
        one.high != other.high)
      return false;
  }
  return sameSamples(a.samples, b.samples) && a.nodes.error == b.nodes.error &&
         a.nodes.largeError == b.nodes.largeError && a.nodes.low == b.nodes.low &&
         a.nodes.high == b.nodes.high;
}

}  // namespace

TileEncoder::TileEncoder(const Pyramid& pyramid, const NodeStores& stores, const Manifest& manifest,
                         const AppendBase* base, int workers)
    : pyramid_(pyramid), stores_(stores), scale_(manifest.scale), scratches_(static_cast<size_t>(workers)) {
  if (base == nullptr) return;
  // Another version may write other bytes for the same tile, another scale does.
  const Manifest& before = base->dataset->manifest();
  if (before.builtBy != manifest.builtBy || !sameScale(before.scale, manifest.scale)) return;
  for (Scratch& scratch : scratches_) scratch.before.emplace(*base->dataset);
}

Result<EncodedTile> TileEncoder::encode(int worker, TileId id) {
  Scratch& scratch = scratches_[static_cast<size_t>(worker)];
  const int index = pyramid_.find(id);
  const PyramidTile& tile = pyramid_.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)];
  Tile& out = scratch.tile;
  TERRANE_TRY(pyramid_.readSamples(tile, out.samples));
  TERRANE_TRY(takeNodes(tile, scratch.codes, out.nodes));
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    out.children[static_cast<size_t>(quadrant)] = summariseChild(tile, out, quadrant);
  }

  // Siblings follow each other, so that one parent often serves for four.
  if (!id.isRoot() && scratch.parentId != id.parent()) {
    const int parent = pyramid_.find(id.parent());
    TERRANE_TRY(pyramid_.readSamples(
        pyramid_.levels[static_cast<size_t>(id.level) - 1][static_cast<size_t>(parent)], scratch.parent));
    scratch.parentId = id.parent();
  }
  TERRANE_ASSIGN(std::vector<uint8_t> before, payloadBefore(scratch, id));
  if (!before.empty()) return EncodedTile{std::move(before), true};
  if (id.isRoot()) return EncodedTile{encodeTile(out, nullptr, 0, scale_), false};
  return EncodedTile{encodeTile(out, &scratch.parent, id.quadrant(), scale_), false};
}

/// The old payload if it is what encoding would give; else nothing. A payload follows from the tile, its
/// parent's samples and the scale: where all of these are equal, so is it.
Result<std::vector<uint8_t>> TileEncoder::payloadBefore(Scratch& scratch, TileId id) const {
  if (!scratch.before) return std::vector<uint8_t>();
  // The parent first: where that changed, the tile need not even be read.
  if (!id.isRoot()) {
    TERRANE_ASSIGN(const auto parent, scratch.before->read(id.parent()));
    if (parent->payload.empty() || !sameSamples(parent->tile.samples, scratch.parent))
      return std::vector<uint8_t>();
  }
  TERRANE_ASSIGN(const auto stored, scratch.before->read(id));
  if (stored->payload.empty() || !sameTile(stored->tile, scratch.tile)) return std::vector<uint8_t>();
  return stored->payload;
}

Status TileEncoder::takeNodes(const PyramidTile& tile, TileCodes& codes, TileNodes& out) const {
  TERRANE_TRY(stores_.joined.readValue(static_cast<uint64_t>(tile.block), codes));
  const int count = tileNodeCount(tile.id.isRoot());
  out.error.assign(codes.error.begin(), codes.error.begin() + count);
  out.largeError.assign(codes.large.begin(), codes.large.begin() + tileLargeNodeCount(tile.id.isRoot()));
  out.low.assign(codes.low.begin(), codes.low.begin() + count);
  out.high.assign(codes.high.begin(), codes.high.begin() + count);
  return {};
}

ChildSummary TileEncoder::summariseChild(const PyramidTile& tile, const Tile& out, int quadrant) const {
  const int32_t child = tile.children[static_cast<size_t>(quadrant)];
  const auto below = static_cast<size_t>(tile.id.level) + 1;
  if (child < 0 || !pyramid_.levels[below][static_cast<size_t>(child)].stored)
    return summariseMissingChild(out.samples, out.nodes, tile.id.isRoot(), quadrant);
  return pyramid_.levels[below][static_cast<size_t>(child)].nodes;
}

}  // namespace terrane
