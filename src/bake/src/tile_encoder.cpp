#include "tile_encoder.h"

#include "node_measure.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

namespace {

bool sameScale(const ElevationScale& a, const ElevationScale& b) {
  return a.heightStep == b.heightStep && a.heightOffset == b.heightOffset && a.errorUnit == b.errorUnit &&
         a.rangeBase == b.rangeBase && a.rangeUnit == b.rangeUnit && a.sampleError == b.sampleError &&
         a.layerCount == b.layerCount && a.layerErrors == b.layerErrors;
}

/// Are all samples that are Coded in the same layers?
bool sameLayers(const TileSamples& a, const TileSamples& b) {
  if (a.layers.empty() && b.layers.empty()) return true;
  for (size_t i = 0; i < a.states.size(); ++i)
    if (a.states[i] == SampleState::Coded && a.layerAt(i) != b.layerAt(i)) return false;
  return true;
}

bool sameSamples(const TileSamples& a, const TileSamples& b) {
  return a.heights == b.heights && a.states == b.states && a.coverage.kind == b.coverage.kind &&
         a.coverage.bits == b.coverage.bits && sameLayers(a, b);
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

Result<EncodedTile> TileEncoder::encode(int worker, TileId id, int layer) {
  Scratch& scratch = scratches_[static_cast<size_t>(worker)];
  const int index = pyramid_.find(id);
  const PyramidTile& tile = pyramid_.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)];
  Tile& out = scratch.tile;
  TERRANE_TRY(pyramid_.readSamples(tile, out.samples));
  // note: later layers have nothing of nodes and children; what was stored before is only compared as a
  // whole.
  if (layer == 0 || scratch.before) {
    TERRANE_TRY(takeNodes(tile, scratch.codes, out.nodes));
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      out.children[static_cast<size_t>(quadrant)] = summariseChild(tile, out, quadrant);
  }

  // Siblings follow each other, so that one parent often serves for four.
  if (!id.isRoot() && scratch.parentId != id.parent()) {
    const int parent = pyramid_.find(id.parent());
    TERRANE_TRY(pyramid_.readSamples(
        pyramid_.levels[static_cast<size_t>(id.level) - 1][static_cast<size_t>(parent)], scratch.parent));
    scratch.parentId = id.parent();
  }
  TERRANE_ASSIGN(std::vector<uint8_t> before, payloadBefore(scratch, id, layer));
  if (!before.empty()) return EncodedTile{std::move(before), true};
  const TileSamples* parent = id.isRoot() ? nullptr : &scratch.parent;
  const int quadrant = id.isRoot() ? 0 : id.quadrant();
  if (layer == 0) return EncodedTile{encodeTile(out, parent, quadrant, scale_), false};
  return EncodedTile{encodeRefinement(out.samples, parent, quadrant, layer, scale_), false};
}

/// The old payload if it is what encoding would give; else nothing. A payload follows from the tile, its
/// parent's samples and the scale: where all of these are equal, so is it.
Result<std::vector<uint8_t>> TileEncoder::payloadBefore(Scratch& scratch, TileId id, int layer) const {
  if (!scratch.before) return std::vector<uint8_t>();
  // The parent first: where that changed, the tile need not even be read.
  if (!id.isRoot()) {
    TERRANE_ASSIGN(const auto parent, scratch.before->read(id.parent()));
    if (parent->payloads.empty() || !sameSamples(parent->tile.samples, scratch.parent))
      return std::vector<uint8_t>();
  }
  TERRANE_ASSIGN(const auto stored, scratch.before->read(id));
  if (stored->payloads.empty() || !sameTile(stored->tile, scratch.tile)) return std::vector<uint8_t>();
  return stored->payloads[static_cast<size_t>(layer)];
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
