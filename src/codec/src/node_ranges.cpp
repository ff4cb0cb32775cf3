#include "node_ranges.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "vector_clones.h"

namespace terrane {
namespace {

constexpr int kBlockCells = 8;
constexpr int kBlocks = kTileCells / kBlockCells;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TERRANE_CLONES void addAll(const float* __restrict heights, size_t count, float* __restrict low,
                           float* __restrict high) {
  for (size_t x = 0; x < count; ++x) {
    low[x] = std::min(low[x], heights[x]);
    high[x] = std::max(high[x], heights[x]);
  }
}

/// How many samples from a void one on are void.
size_t voidRun(const SampleState* states, size_t count) {
  static_assert(static_cast<int>(SampleState::Void) == 0);
  size_t x = 0;
  for (uint64_t eight = 0; x + 8 <= count; x += 8) {
    std::memcpy(&eight, states + x, sizeof(eight));
    if (eight != 0) break;
  }
  while (x < count && states[x] == SampleState::Void) ++x;
  return x;
}

/// A row's ground, run by run.
void addGround(const float* heights, const SampleState* states, float* low, float* high) {
  for (size_t x = 0; x < kTileSamples;) {
    const size_t left = kTileSamples - x;
    const void* next = std::memchr(states + x, static_cast<int>(SampleState::Void), left);
    const size_t ground =
        next == nullptr ? left : static_cast<size_t>(static_cast<const SampleState*>(next) - states) - x;
    addAll(heights + x, ground, low + x, high + x);
    x += ground;
    x += voidRun(states + x, kTileSamples - x);
  }
}

}  // namespace

RangePredictor::RangePredictor(const Tile& tile, const TileNodes& nodes, const ElevationScale& scale)
    : tile_(tile),
      nodes_(nodes),
      scale_(scale),
      blockLow_(kBlocks * kBlocks, kInfinity),
      blockHigh_(kBlocks * kBlocks, -kInfinity) {
  // note: a block's border samples belong to the blocks on both sides.
  std::array<float, kTileSamples> rowLow;
  std::array<float, kTileSamples> rowHigh;
  const std::vector<SampleState>& states = tile.samples.states;
  const bool anyVoid =
      std::memchr(states.data(), static_cast<int>(SampleState::Void), states.size()) != nullptr;
  for (int blockRow = 0; blockRow < kBlocks; ++blockRow) {
    rowLow.fill(kInfinity);
    rowHigh.fill(-kInfinity);
    for (int y = blockRow * kBlockCells; y <= (blockRow + 1) * kBlockCells; ++y) {
      const float* heights = tile.samples.heights.data() + y * kTileSamples;
      const SampleState* row = states.data() + y * kTileSamples;
      if (anyVoid) {
        addGround(heights, row, rowLow.data(), rowHigh.data());
      } else {
        addAll(heights, kTileSamples, rowLow.data(), rowHigh.data());
      }
    }
    for (int blockCol = 0; blockCol < kBlocks; ++blockCol) {
      const auto block = static_cast<size_t>(blockRow * kBlocks + blockCol);
      const auto first = static_cast<size_t>(blockCol * kBlockCells);
      float low = rowLow[first];
      float high = rowHigh[first];
      for (size_t x = first + 1; x <= first + kBlockCells; ++x) {
        low = std::min(low, rowLow[x]);
        high = std::max(high, rowHigh[x]);
      }
      blockLow_[block] = low;
      blockHigh_[block] = high;
    }
  }
}

bool RangePredictor::isRefined(const NodePlace& quad) const {
  const int quadrant = (quad.x < kTileCells / 2 ? 0 : 1) + (quad.y < kTileCells / 2 ? 0 : 2);
  return tile_.children[static_cast<size_t>(quadrant)].state == ChildState::Present;
}

RangePredictor::Range RangePredictor::ofSamples(const NodePlace& quad) const {
  // Where a finer tile is stored, the quad's descendants fill the octagon of |x|, |y| <= 24, |x| + |y| <= 32.
  const int reach = isRefined(quad) ? 3 : 1;
  const int sum = isRefined(quad) ? 4 : 2;

  float low = kInfinity;
  float high = -kInfinity;
  for (int down = -reach; down < reach; ++down) {
    const int rowReach = std::min(reach, sum - std::max(-down, down + 1));
    const int row = quad.y / kBlockCells + down;
    if (row < 0 || row >= kBlocks) continue;
    const int firstCol = std::max(quad.x / kBlockCells - rowReach, 0);
    const int endCol = std::min(quad.x / kBlockCells + rowReach, kBlocks);
    for (int col = firstCol; col < endCol; ++col) {
      low = std::min(low, blockLow_[static_cast<size_t>(row * kBlocks + col)]);
      high = std::max(high, blockHigh_[static_cast<size_t>(row * kBlocks + col)]);
    }
  }
  if (low > high) return {};
  return {scale_.lowCode(static_cast<double>(low) - scale_.sampleError),
          scale_.highCode(static_cast<double>(high) + scale_.sampleError)};
}

RangePredictor::Range RangePredictor::ofChildren(const std::array<int16_t, 4>& children) const {
  Range range;
  for (const int16_t child : children) {
    if (child < 0) continue;
    range.low = std::min(range.low, nodes_.low[static_cast<size_t>(child)]);
    range.high = std::max(range.high, nodes_.high[static_cast<size_t>(child)]);
  }
  return range;
}

}  // namespace terrane
