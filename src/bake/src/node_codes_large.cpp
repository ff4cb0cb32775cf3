#include <algorithm>

#include "node_codes.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

size_t largeAt(int k, int nodeLevel, LatticePoint local, bool isRoot) {
  return static_cast<size_t>(largeNodeIndex(k, nodeLevel, local.x, local.y, isRoot));
}

/// Codes larger patches of one tile whose level below is done. A larger patch is the same surface as the
/// patches for K = 17 that it is made of, so its error is the largest of theirs.
class LargeNodeCoder {
 public:
  LargeNodeCoder(const CodingTask& task, TileCodes& codes)
      : task_(task), codes_(codes), isRoot_(task.id.isRoot()) {
    codes_.large.fill(0);
  }

  Status code() {
    for (int k = kNodeGrid.k + 1; k <= PatchGrid::kLargest; ++k) {
      // Finest first; within a level in any order.
      for (int level = lastLargeNodeLevel(k); level >= firstLargeNodeLevel(k, isRoot_); --level) {
        TERRANE_TRY(codeNodeLevel(k, level));
      }
    }
    return {};
  }

 private:
  uint8_t& own(int k, int nodeLevel, LatticePoint local) {
    return codes_.large[largeAt(k, nodeLevel, local, isRoot_)];
  }

  /// The largest error measured among the patches for K = 17 that one of this k is made of, in this tile.
  float measuredBelow(int nodeLevel, LatticePoint p, int halvings) const {
    if (p.x < 0 || p.y < 0 || p.x > kTileCells || p.y > kTileCells) return 0.0F;
    if (halvings == 0) {
      return task_.gathered.error[static_cast<size_t>(nodeIndex(nodeLevel, p.x, p.y, isRoot_))];
    }
    const int h = nodeHalfSize(nodeLevel) / 2;
    const std::array<LatticePoint, 4> steps =
        nodeLevel % 2 == 0 ? std::array<LatticePoint, 4>{{{-h, -h}, {h, -h}, {-h, h}, {h, h}}}
                           : std::array<LatticePoint, 4>{{{-h, 0}, {h, 0}, {0, -h}, {0, h}}};
    float largest = 0.0F;
    for (const LatticePoint step : steps) {
      largest = std::max(largest, measuredBelow(nodeLevel + 2, {p.x + step.x, p.y + step.y}, halvings - 1));
    }
    return largest;
  }

  Status codeNodeLevel(int k, int nodeLevel) {
    const int s = nodeHalfSize(nodeLevel);
    const bool quads = nodeLevel % 2 == 0;
    for (int y = quads ? s : 0; y <= kTileCells; y += quads ? 2 * s : s) {
      for (int x = quads ? s : (y / s % 2 == 0 ? s : 0); x <= kTileCells; x += 2 * s) {
        const double error = static_cast<double>(measuredBelow(nodeLevel, {x, y}, k - kNodeGrid.k));
        int largest = task_.scale.codeFromError(error + task_.maxErrorMeters);
        const int reach = quads ? s : s / 2;
        const std::array<LatticePoint, 4> steps =
            quads ? std::array<LatticePoint, 4>{{{0, -reach}, {reach, 0}, {0, reach}, {-reach, 0}}}
                  : std::array<LatticePoint, 4>{
                        {{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}}};
        for (const LatticePoint step : steps) {
          largest = std::max(largest, childCode(k, nodeLevel, {x + step.x, y + step.y}) + 1);
        }
        if (largest > 255)
          return makeError("an error code exceeds 255; errorUnit {} m is too small", task_.scale.errorUnit);
        own(k, nodeLevel, {x, y}) = static_cast<uint8_t>(largest);
      }
    }
    return {};
  }

  /// The code of a child at a point in this tile's cells; -1 where no stored tile holds it.
  int childCode(int k, int nodeLevel, LatticePoint p) {
    if (p.x < 0 || p.y < 0 || p.x > kTileCells || p.y > kTileCells) return -1;
    if (nodeLevel < lastLargeNodeLevel(k)) return own(k, nodeLevel + 1, p);
    const TileId id = task_.id;
    LatticePoint local;
    const TileCodes* below =
        task_.below.holding({2 * (id.col * kTileCells + p.x), 2 * (id.row * kTileCells + p.y)}, local);
    return below != nullptr ? below->large[largeAt(k, firstLargeNodeLevel(k, false), local, false)] : -1;
  }

  const CodingTask& task_;
  TileCodes& codes_;
  bool isRoot_;
};

}  // namespace

Status codeLargeNodes(const CodingTask& task, TileCodes& codes) {
  return LargeNodeCoder(task, codes).code();
}

void joinLargeNodes(bool isRoot, int side, const TileCodes& neighbour, TileCodes& codes) {
  if (isRoot) return;
  for (int k = kNodeGrid.k + 1; k <= PatchGrid::kLargest; ++k) {
    const int nodeLevel = firstLargeNodeLevel(k, false);
    const int s = nodeHalfSize(nodeLevel);
    for (int at = s; at < kTileCells; at += 2 * s) {
      const BorderPair pair = borderPair(side, at);
      uint8_t& code = codes.large[largeAt(k, nodeLevel, pair.here, false)];
      code = std::max(code, neighbour.large[largeAt(k, nodeLevel, pair.there, false)]);
    }
  }
}

}  // namespace terrane
