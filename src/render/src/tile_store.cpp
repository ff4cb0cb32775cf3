#include "tile_store.h"

#include <algorithm>
#include <array>

namespace terrane {

namespace {

constexpr int kHeightUnit = 0;
constexpr int kGradientUnit = 1;
constexpr int kCoverageUnit = 2;
constexpr int kCoverageRowBytes = kTileCells / 8;

/// One step from a tile to its neighbour on that side.
struct Step {
  int col = 0;
  int row = 0;
};
Step stepTo(Side side) {
  switch (side) {
    case Side::North:
      return {0, -1};
    case Side::East:
      return {1, 0};
    case Side::South:
      return {0, 1};
    default:
      return {-1, 0};
  }
}
Side opposite(Side side) {
  return static_cast<Side>((static_cast<int>(side) + 2) % 4);
}
uint8_t bit(Side side) {
  return static_cast<uint8_t>(1U << static_cast<unsigned>(side));
}
TileId moved(TileId id, Step step) {
  return {id.level, id.col + step.col, id.row + step.row};
}

}  // namespace

int LayerPool::take() {
  if (free_.empty()) return next_++;
  const int layer = free_.back();
  free_.pop_back();
  return layer;
}

TileStore::TileStore(const gpu::Context& context)
    : context_(context),
      heights_(gpu::kR32F, kTileSamples, kTileSamples, gpu::Filter::Nearest),
      gradients_(gpu::kRg16F, kAtlasWidth, kAtlasHeight, gpu::Filter::Linear),
      coverage_(gpu::kR8Ui, kCoverageRowBytes, kTileCells, gpu::Filter::Nearest) {}

Status TileStore::reserve(int tiles) {
  TERRANE_TRY(heights_.reserve(context_, tiles, gpu::Growth::Exact));
  TERRANE_TRY(gradients_.reserve(context_, tiles, gpu::Growth::Exact));
  return coverage_.reserve(context_, tiles, gpu::Growth::Exact);
}

Status TileStore::upload(TileId id, const TileSamples& samples, const PreparedTile& prepared) {
  TERRANE_CHECK(id.valid(), "{}", toString(id));
  TERRANE_CHECK(samples.heights.size() == static_cast<size_t>(kTileSampleCount), "{} heights",
                samples.heights.size());
  TERRANE_CHECK(
      samples.coverage.kind != Coverage::Kind::Partial || samples.coverage.bits.size() == Coverage::kBytes,
      "{} bytes", samples.coverage.bits.size());
  const Coverage& shown = prepared.shown;
  const bool partial = shown.kind == Coverage::Kind::Partial;
  drop(id);

  // Make room first, so that a full GPU leaves everything as it was.
  Entry entry;
  entry.coverage = shown.kind;
  entry.layer = layers_.take();
  if (partial) entry.coverageLayer = coverageLayers_.take();
  const auto makeRoom = [&]() -> Status {
    TERRANE_TRY(heights_.reserve(context_, layers_.highest()));
    TERRANE_TRY(gradients_.reserve(context_, layers_.highest()));
    return coverage_.reserve(context_, coverageLayers_.highest());
  };
  if (const Status room = makeRoom(); !room.ok()) {
    layers_.giveBack(entry.layer);
    if (partial) coverageLayers_.giveBack(entry.coverageLayer);
    return makeError("no room for tile {} on the GPU: {}; drop tiles that are not drawn", toString(id),
                     room.error().message);
  }

  heights_.uploadLayer(entry.layer, samples.heights.data());
  gradients_.uploadLayer(entry.layer, prepared.shading.atlas.data());
  if (partial) coverage_.uploadLayer(entry.coverageLayer, shown.bits.data());
  entry.borders = prepared.shading.borders;
  tiles_.emplace(id, std::move(entry));
  markAround(id);
  return {};
}

void TileStore::drop(TileId id) {
  const auto found = tiles_.find(id);
  if (found == tiles_.end()) return;
  layers_.giveBack(found->second.layer);
  if (found->second.coverageLayer >= 0) coverageLayers_.giveBack(found->second.coverageLayer);
  tiles_.erase(found);
  last_ = nullptr;
  markAround(id);
}

const TileStore::Entry* TileStore::find(TileId id) const {
  if (last_ != nullptr && lastId_ == id) return last_;
  const auto found = tiles_.find(id);
  if (found == tiles_.end()) return nullptr;
  lastId_ = id;
  last_ = &found->second;
  return last_;
}

void TileStore::markAround(TileId id) {
  const auto mark = [&](TileId at, unsigned sides) {
    const auto found = tiles_.find(at);
    if (found == tiles_.end()) return;
    if (found->second.staleSides == 0) stale_.push_back(at);
    found->second.staleSides = static_cast<uint8_t>(found->second.staleSides | sides);
  };
  mark(id, 15U);
  for (const Side side : kSides) mark(moved(id, stepTo(side)), bit(opposite(side)));
  // A neighbour across a corner shares one sample, which lies on two of its sides: one of them will do.
  for (const Side side : {Side::North, Side::South})
    for (const int col : {-1, 1}) mark(moved(id, {col, stepTo(side).row}), bit(opposite(side)));
}

Gradient TileStore::sharedGradient(TileId id, const Entry& entry, Side side, int level, int index) const {
  Gradient sum = entry.borders.at(side, level, index);
  const auto add = [&](TileId at, Side itsSide, int itsIndex) {
    const Entry* other = find(at);
    if (other == nullptr) return;
    sum = sum + other->borders.at(itsSide, level, itsIndex);
  };
  add(moved(id, stepTo(side)), opposite(side), index);
  // At a corner two more tiles meet: along the side, and across the corner.
  const int last = gradientSide(level) - 1;
  if (index == 0 || index == last) {
    const bool horizontal = side == Side::North || side == Side::South;
    const int direction = index == 0 ? -1 : 1;
    const Step along = horizontal ? Step{direction, 0} : Step{0, direction};
    add(moved(id, along), side, last - index);
    add(moved(moved(id, along), stepTo(side)), opposite(side), last - index);
  }
  return sum;
}

void TileStore::refreshSide(TileId id, const Entry& entry, Side side) {
  std::array<PackedGradient, kTileSamples> strip{};
  const bool horizontal = side == Side::North || side == Side::South;
  for (int level = 0; level < kGradientLevels; ++level) {
    const int count = gradientSide(level);
    for (int i = 0; i < count; ++i)
      strip[static_cast<size_t>(i)] = packGradient(sharedGradient(id, entry, side, level, i));
    const int x = atlasX(level) + (side == Side::East ? count - 1 : 0);
    const int y = atlasY(level) + (side == Side::South ? count - 1 : 0);
    gradients_.upload(entry.layer, {x, y, horizontal ? count : 1, horizontal ? 1 : count}, strip.data());
  }
}

void TileStore::refreshBorders() {
  for (const TileId id : stale_) {
    const auto found = tiles_.find(id);
    if (found == tiles_.end()) continue;
    Entry& entry = found->second;
    for (const Side side : kSides)
      if ((entry.staleSides & bit(side)) != 0) refreshSide(id, entry, side);
    entry.staleSides = 0;
  }
  stale_.clear();
}

void TileStore::bind() const {
  heights_.bindToUnit(kHeightUnit);
  gradients_.bindToUnit(kGradientUnit);
  coverage_.bindToUnit(kCoverageUnit);
}

void TileStore::setSamplers(const gpu::Program& program) {
  program.setSampler("uHeights", kHeightUnit);
  program.setSampler("uGradients", kGradientUnit);
  program.setSampler("uCoverage", kCoverageUnit);
}

}  // namespace terrane
