#include "node_codes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "node_measure.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// A node's codes in the making; wide enough to see an overflow.
struct Codes {
  int error = 0;
  uint16_t low = 65535;
  uint16_t high = 0;

  void includeChild(int childError, uint16_t childLow, uint16_t childHigh) {
    error = std::max(error, childError + 1);
    low = std::min(low, childLow);
    high = std::max(high, childHigh);
  }
  void includeChild(const TileCodes& codes, int node) {
    const auto i = static_cast<size_t>(node);
    includeChild(codes.error[i], codes.low[i], codes.high[i]);
  }
};

/// Codes one tile whose level below is done.
class NodeCoder {
 public:
  NodeCoder(const CodingTask& task, TileCodes& codes)
      : task_(task), codes_(codes), isRoot_(task.id.isRoot()) {
    codes_.error.fill(0);
    codes_.low.fill(65535);
    codes_.high.fill(0);
  }

  /// Quad-centres with their children in the level below, then edge-centres with the quads of this tile.
  Status code() {
    for (int node = nodeOffset(8, isRoot_); node < tileNodeCount(isRoot_); ++node) {
      Codes codes = ownRange(node);
      includeEdgesBelow(nodePlace(node, isRoot_), codes);
      TERRANE_TRY(setOwn(node, codes));
    }
    for (int nodeLevel = 7; nodeLevel >= firstNodeLevel(isRoot_); --nodeLevel) {
      TERRANE_TRY(codeNodeLevel(nodeLevel));
    }
    return {};
  }

 private:
  /// The range that was measured under a quad.
  Codes ownRange(int node) const {
    Codes codes;
    if (task_.measured == nullptr) return codes;
    const auto quad = static_cast<size_t>(node - nodeOffset(8, isRoot_));
    const float low = task_.measured->low[quad];
    const float high = task_.measured->high[quad];
    if (low <= high) {
      codes.low = task_.scale.lowCode(static_cast<double>(low) - task_.maxErrorMeters);
      codes.high = task_.scale.highCode(static_cast<double>(high) + task_.maxErrorMeters);
    }
    return codes;
  }

  /// Adds the node's own error, unless there is no ground under it, and stores the codes.
  Status setOwn(int node, Codes codes) {
    const auto i = static_cast<size_t>(node);
    if (codes.low <= codes.high) {
      const double error = static_cast<double>(task_.gathered.error[i]) + task_.maxErrorMeters;
      codes.error = std::max(codes.error, static_cast<int>(task_.scale.codeFromError(error)));
    }
    if (codes.error > 255)
      return makeError("an error code exceeds 255; errorUnit {} m is too small", task_.scale.errorUnit);
    codes_.error[i] = static_cast<uint8_t>(codes.error);
    codes_.low[i] = codes.low;
    codes_.high[i] = codes.high;
    return {};
  }

  void includeEdgesBelow(NodePlace place, Codes& codes) const {
    const TileId id = task_.id;
    const LatticePoint center{2 * (id.col * kTileCells + place.x), 2 * (id.row * kTileCells + place.y)};
    const int reach = nodeHalfSize(7);
    for (const LatticePoint step : {LatticePoint{0, -reach}, {reach, 0}, {0, reach}, {-reach, 0}}) {
      LatticePoint local;
      const TileCodes* below = task_.below.holding({center.x + step.x, center.y + step.y}, local);
      if (below != nullptr) codes.includeChild(*below, nodeIndex(7, local.x, local.y, false));
    }
  }

  /// A node level whose children are in the same tile.
  Status codeNodeLevel(int nodeLevel) {
    const int s = nodeHalfSize(nodeLevel);
    const int offset = nodeOffset(nodeLevel, isRoot_);
    for (int node = offset; node < offset + nodeCount(nodeLevel); ++node) {
      const NodePlace place = nodePlace(node, isRoot_);
      Codes codes;
      const auto include = [&](int x, int y) {
        if (x < 0 || y < 0 || x > kTileCells || y > kTileCells) return;
        codes.includeChild(codes_, nodeIndex(nodeLevel + 1, x, y, isRoot_));
      };
      if (nodeLevel % 2 == 0) {
        include(place.x, place.y - s);
        include(place.x + s, place.y);
        include(place.x, place.y + s);
        include(place.x - s, place.y);
      } else {
        for (const int dx : {-s / 2, s / 2}) {
          for (const int dy : {-s / 2, s / 2}) include(place.x + dx, place.y + dy);
        }
      }
      TERRANE_TRY(setOwn(node, codes));
    }
    return {};
  }

  const CodingTask& task_;
  TileCodes& codes_;
  bool isRoot_;
};

/// The neighbour across a side.
TileId acrossSide(TileId id, int side) {
  switch (side) {
    case 0:
      return {id.level, id.col, id.row - 1};
    case 1:
      return {id.level, id.col + 1, id.row};
    case 2:
      return {id.level, id.col, id.row + 1};
    default:
      return {id.level, id.col - 1, id.row};
  }
}

int storedIndex(const Pyramid& pyramid, TileId id) {
  if (!id.valid() || id.level > pyramid.finestLevel()) return -1;
  const int index = pyramid.find(id);
  return index >= 0 && pyramid.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)].stored
             ? index
             : -1;
}

/// What one worker needs for one tile.
struct CodesScratch {
  MeasuredNodes measured;
  GatheredNodes gathered;
  CodesBelow below;
  TileCodes codes;
  TileCodes neighbour;
};

/// All of a tile's nodes together.
struct Summary {
  uint8_t error = 0;
  uint8_t typicalError = 0;
  uint16_t low = 65535;
  uint16_t high = 0;
};

template <class T>
T medianOf(std::vector<T>& values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

uint8_t typicalErrorOf(const TileCodes& codes, bool isRoot) {
  std::vector<uint8_t> errors;
  const auto end = static_cast<size_t>(tileNodeCount(isRoot));
  for (size_t node = end - kQuads; node < end; ++node)
    if (codes.low[node] <= codes.high[node]) errors.push_back(codes.error[node]);
  return medianOf(errors);
}

}  // namespace

Status CodesBelow::read(const Pyramid& pyramid, const NodeStores& stores, const PyramidTile& tile) {
  firstCol_ = 2 * tile.id.col - 1;
  firstRow_ = 2 * tile.id.row - 1;
  there_.fill(false);
  const int level = tile.id.level + 1;
  if (level > pyramid.finestLevel()) return {};
  const auto readOne = [&](int col, int row) -> Status {
    const int index = storedIndex(pyramid, {level, firstCol_ + col, firstRow_ + row});
    if (index < 0) return {};
    const auto slot = static_cast<size_t>(row * kSide + col);
    there_[slot] = true;
    const PyramidTile& below = pyramid.levels[static_cast<size_t>(level)][static_cast<size_t>(index)];
    return stores.joined.readValue(static_cast<uint64_t>(below.block), codes_[slot]);
  };
  bool all = true;
  for (const int row : {1, 2}) {
    for (const int col : {1, 2}) {
      TERRANE_TRY(readOne(col, row));
      all = all && there_[static_cast<size_t>(row * kSide + col)];
    }
  }
  if (all) return {};
  for (int row = 0; row < kSide; ++row) {
    for (int col = 0; col < kSide; ++col) {
      const bool inside = row % 3 != 0 && col % 3 != 0;
      if (!inside) TERRANE_TRY(readOne(col, row));
    }
  }
  return {};
}

const TileCodes* CodesBelow::holding(LatticePoint point, LatticePoint& local) const {
  const auto in = [&](int col, int row) -> const TileCodes* {
    const int slotCol = col - firstCol_;
    const int slotRow = row - firstRow_;
    if (slotCol < 0 || slotRow < 0 || slotCol >= kSide || slotRow >= kSide) return nullptr;
    const auto slot = static_cast<size_t>(slotRow * kSide + slotCol);
    if (!there_[slot]) return nullptr;
    local = {point.x - col * kTileCells, point.y - row * kTileCells};
    return &codes_[slot];
  };
  // A point on a border is in two tiles, in a corner in four; they agree.
  const int col = point.x / kTileCells;
  const int row = point.y / kTileCells;
  for (int dx = 0; dx <= (point.x % kTileCells == 0 ? 1 : 0); ++dx) {
    for (int dy = 0; dy <= (point.y % kTileCells == 0 ? 1 : 0); ++dy) {
      const TileCodes* found = in(col - dx, row - dy);
      if (found != nullptr) return found;
    }
  }
  return nullptr;
}

Status codeNodes(const CodingTask& task, TileCodes& codes) {
  return NodeCoder(task, codes).code();
}

void joinNodes(bool isRoot, int side, const TileCodes& neighbour, TileCodes& codes) {
  const int s = nodeHalfSize(7);
  for (int at = s; at < kTileCells; at += 2 * s) {
    const BorderPair pair = borderPair(side, at);
    const auto i = static_cast<size_t>(nodeIndex(7, pair.here.x, pair.here.y, isRoot));
    const auto j = static_cast<size_t>(nodeIndex(7, pair.there.x, pair.there.y, isRoot));
    codes.error[i] = std::max(codes.error[i], neighbour.error[j]);
    codes.low[i] = std::min(codes.low[i], neighbour.low[j]);
    codes.high[i] = std::max(codes.high[i], neighbour.high[j]);
  }
}

Status saturateNodes(Pyramid& pyramid, NodeStores& stores, const ElevationScale& scale, double maxErrorMeters,
                     Jobs& jobs) {
  std::vector<CodesScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    std::vector<PyramidTile*> stored;
    for (PyramidTile& tile : tiles) {
      if (tile.stored) stored.push_back(&tile);
    }
    const auto count = static_cast<int64_t>(stored.size());

    // Each tile for itself.
    const Status coded =
        jobs.run(fmt::format("coding {}", level), count, nullptr, [&](int worker, int64_t i) -> Status {
          CodesScratch& scratch = scratches[static_cast<size_t>(worker)];
          const PyramidTile& tile = *stored[static_cast<size_t>(i)];
          const auto block = static_cast<uint64_t>(tile.block);
          const MeasuredNodes* measured = tile.measured ? &scratch.measured : nullptr;
          if (tile.measured) TERRANE_TRY(stores.measured.readValue(block, scratch.measured));
          TERRANE_TRY(gatherNodes(pyramid, stores, tile, measured, scratch.gathered));
          TERRANE_TRY(stores.gathered.writeValue(block, scratch.gathered));
          TERRANE_TRY(scratch.below.read(pyramid, stores, tile));
          const CodingTask task{tile.id, scale, maxErrorMeters, measured, scratch.gathered, scratch.below};
          TERRANE_TRY(codeNodes(task, scratch.codes));
          TERRANE_TRY(codeLargeNodes(task, scratch.codes));
          return stores.alone.writeValue(block, scratch.codes);
        });
    TERRANE_TRY(coded);

    // Edge-centres between two tiles get the same codes in both.
    const auto joined = jobs.run<Summary>(
        fmt::format("joining {}", level), count, nullptr, [&](int worker, int64_t i) -> Result<Summary> {
          CodesScratch& scratch = scratches[static_cast<size_t>(worker)];
          const PyramidTile& tile = *stored[static_cast<size_t>(i)];
          TERRANE_TRY(stores.alone.readValue(static_cast<uint64_t>(tile.block), scratch.codes));
          for (int side = 0; side < 4; ++side) {
            const int index = storedIndex(pyramid, acrossSide(tile.id, side));
            if (index < 0) continue;
            const PyramidTile& neighbour = tiles[static_cast<size_t>(index)];
            TERRANE_TRY(stores.alone.readValue(static_cast<uint64_t>(neighbour.block), scratch.neighbour));
            joinNodes(tile.id.isRoot(), side, scratch.neighbour, scratch.codes);
            joinLargeNodes(tile.id.isRoot(), side, scratch.neighbour, scratch.codes);
          }
          TERRANE_TRY(stores.joined.writeValue(static_cast<uint64_t>(tile.block), scratch.codes));
          Summary summary;
          summary.typicalError = typicalErrorOf(scratch.codes, tile.id.isRoot());
          for (size_t node = 0; node < static_cast<size_t>(tileNodeCount(tile.id.isRoot())); ++node) {
            summary.error = std::max(summary.error, scratch.codes.error[node]);
            summary.low = std::min(summary.low, scratch.codes.low[node]);
            summary.high = std::max(summary.high, scratch.codes.high[node]);
          }
          return summary;
        });
    if (!joined.ok()) return joined.error();
    for (size_t i = 0; i < stored.size(); ++i) {
      const Summary& summary = (*joined)[i];
      stored[i]->nodes = {ChildState::Present, summary.error, summary.low, summary.high};
      stored[i]->typicalError = summary.typicalError;
    }
  }
  return {};
}

double roughnessOf(const Pyramid& pyramid, const ElevationScale& scale, double finestSpacingMeters) {
  double sum = 0.0;
  int levels = 0;
  for (int level = 0; level < pyramid.finestLevel(); ++level) {
    std::vector<uint8_t> codes;
    for (const PyramidTile& tile : pyramid.levels[static_cast<size_t>(level)]) {
      const bool refines = std::any_of(tile.children.begin(), tile.children.end(), [&](int32_t child) {
        return child >= 0 &&
               pyramid.levels[static_cast<size_t>(level) + 1][static_cast<size_t>(child)].stored;
      });
      if (tile.stored && refines) codes.push_back(tile.typicalError);
    }
    if (codes.empty()) continue;
    const double spacing = std::ldexp(finestSpacingMeters, pyramid.finestLevel() - level);
    sum += scale.errorFromCode(medianOf(codes)) / spacing;
    ++levels;
  }
  return levels > 0 ? sum / levels : ElevationScale{}.roughness;
}

Result<double> zeroShareOf(const Pyramid& pyramid, double bound) {
  TileSamples samples;
  TERRANE_TRY(pyramid.readSamples(pyramid.levels.front().front(), samples));
  size_t ground = 0, atZero = 0;
  for (size_t i = 0; i < samples.heights.size(); ++i) {
    if (samples.states[i] == SampleState::Void) continue;
    ++ground;
    if (std::abs(static_cast<double>(samples.heights[i])) <= bound) ++atZero;
  }
  return ground > 0 ? static_cast<double>(atZero) / static_cast<double>(ground) : 0.0;
}

Status takeNodes(Pyramid& pyramid, const NodeStores& stores) {
  for (int level = 0; level <= pyramid.finestLevel(); ++level) {
    LevelNodes& nodes = pyramid.nodes[static_cast<size_t>(level)];
    const auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    nodes = {};
    nodes.nodesPerTile = tileNodeCount(level == 0);
    const auto each = static_cast<size_t>(nodes.nodesPerTile);
    const auto largeEach = static_cast<size_t>(tileLargeNodeCount(level == 0));
    const auto firstQuad = static_cast<size_t>(nodeOffset(8, level == 0));
    nodes.error.assign(tiles.size() * each, 0.0F);
    nodes.low.assign(tiles.size() * each, std::numeric_limits<float>::infinity());
    nodes.high.assign(tiles.size() * each, -std::numeric_limits<float>::infinity());
    nodes.errorCode.assign(tiles.size() * each, 0);
    nodes.lowCode.assign(tiles.size() * each, 65535);
    nodes.highCode.assign(tiles.size() * each, 0);
    nodes.largeErrorCode.assign(tiles.size() * largeEach, 0);
    MeasuredNodes measured;
    GatheredNodes gathered;
    TileCodes codes;
    for (size_t i = 0; i < tiles.size(); ++i) {
      if (!tiles[i].stored) continue;
      const auto block = static_cast<uint64_t>(tiles[i].block);
      const auto put = [](const auto& from, size_t count, auto& to, size_t at) {
        std::copy_n(from.begin(), count, to.begin() + static_cast<ptrdiff_t>(at));
      };
      TERRANE_TRY(stores.gathered.readValue(block, gathered));
      TERRANE_TRY(stores.joined.readValue(block, codes));
      put(gathered.error, each, nodes.error, i * each);
      put(codes.error, each, nodes.errorCode, i * each);
      put(codes.low, each, nodes.lowCode, i * each);
      put(codes.high, each, nodes.highCode, i * each);
      put(codes.large, largeEach, nodes.largeErrorCode, i * largeEach);
      if (!tiles[i].measured) continue;
      TERRANE_TRY(stores.measured.readValue(block, measured));
      put(measured.low, kQuads, nodes.low, i * each + firstQuad);
      put(measured.high, kQuads, nodes.high, i * each + firstQuad);
    }
  }
  return {};
}

NodeCodes nodeCodesAt(const Pyramid& pyramid, int level, int nodeLevel, LatticePoint center) {
  const Pyramid::PlacedPoint at = pyramid.findStored(level, center);
  if (at.tile < 0) return {};
  const LevelNodes& nodes = pyramid.nodes[static_cast<size_t>(level)];
  const size_t node = static_cast<size_t>(at.tile) * static_cast<size_t>(nodes.nodesPerTile) +
                      static_cast<size_t>(nodeIndex(nodeLevel, at.local.x, at.local.y, level == 0));
  return {nodes.errorCode[node], nodes.lowCode[node], nodes.highCode[node]};
}

ChildSummary summariseMissingChild(const TileSamples& samples, const TileNodes& nodes, bool isRoot,
                                   int quadrant) {
  constexpr int kHalf = kTileCells / 2;
  const int firstX = (quadrant & 1) * kHalf;
  const int firstY = (quadrant >> 1) * kHalf;

  // Ground in it, be it a sample without a cell?
  bool ground = false;
  for (int y = firstY; y <= firstY + kHalf && !ground; ++y) {
    for (int x = firstX; x <= firstX + kHalf; ++x) {
      ground |= samples.states[static_cast<size_t>(y * kTileSamples + x)] != SampleState::Void;
    }
  }
  ChildSummary summary;
  if (!ground) return summary;

  summary.state = ChildState::Interpolated;
  const int s = nodeHalfSize(8);
  for (int y = firstY + s; y < firstY + kHalf; y += 2 * s) {
    for (int x = firstX + s; x < firstX + kHalf; x += 2 * s) {
      const auto node = static_cast<size_t>(nodeIndex(8, x, y, isRoot));
      summary.low = std::min(summary.low, nodes.low[node]);
      summary.high = std::max(summary.high, nodes.high[node]);
    }
  }
  return summary;
}

}  // namespace terrane
