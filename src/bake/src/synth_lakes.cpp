#include "synth_lakes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "synth_noise.h"

namespace terrane::synth {
namespace {

constexpr int kPatch = 128;  ///< nodes a side of the patches of 10 km that may have one lake each
constexpr int kSites = 4;    ///< squared: the outlets that are tried in a patch
constexpr size_t kMinWet = 60;
constexpr size_t kMaxWet = 5000;
constexpr size_t kMaxShore = 40000;
constexpr float kTaperMeters = 1300.0f;  ///< from the outlet to where the lake has its depth

/// A lake that could be: its outlet, how far the ground sinks, and what that takes.
struct Lake {
  size_t outlet = 0;
  float level = 0.0f;
  float deep = 0.0f;
  size_t wet = 0;
};

class LakeDigger {
 public:
  LakeDigger(World& world, uint32_t seed)
      : world_(world), seed_(seed), distance_(world.height.size(), -1.0f), taken_(world.height.size(), 0) {}

  void digPatch(int patchCol, int patchRow) {
    const uint32_t chance = hashCell(patchCol, patchRow, seed_ + 31);
    if (unitLow(chance) > 0.8f) return;
    Lake best;
    constexpr int kSite = kPatch / kSites;
    for (int site = 0; site < kSites * kSites; ++site) {
      Lake lake;
      if (!findOutlet(patchCol * kPatch + (site % kSites) * kSite,
                      patchRow * kPatch + (site / kSites) * kSite, kSite, lake)) {
        continue;
      }
      // A deep lake or a shallow one: whichever the ground holds and is larger.
      for (const float deep : {18.0f + 60.0f * unitHigh(chance), 9.0f}) {
        lake.deep = deep;
        gather(lake);
        lake.wet = weigh(lake);
        forget();
        if (lake.wet > best.wet) best = lake;
      }
    }
    if (best.wet < kMinWet) return;
    gather(best);
    dig(best);
    forget();
  }

  /// Two rings of higher nodes know the level too, so that the water's edge is the ground's own.
  void drawShores() {
    for (int ring = 0; ring < 2; ++ring) {
      const std::vector<float> before = world_.lakeLevel;
      for (size_t i = 0; i < before.size(); ++i) {
        if (before[i] != kNoLake) continue;
        for (int direction = 0; direction < 8; ++direction) {
          const float level = before[neighbour(i, direction)];
          if (level != kNoLake && world_.height[i] > level) world_.lakeLevel[i] = level;
        }
      }
    }
  }

 private:
  static size_t neighbour(size_t node, int direction) {
    return nodeIndex(static_cast<int>(node % kWorldCells) + kNeighbourCol[direction],
                     static_cast<int>(node / kWorldCells) + kNeighbourRow[direction]);
  }

  /// The likeliest node of a site on a river of middling size.
  bool findOutlet(int col0, int row0, int side, Lake& lake) const {
    float best = 0.0f;
    for (int row = row0; row < row0 + side; ++row) {
      for (int col = col0; col < col0 + side; ++col) {
        const size_t i = nodeIndex(col, row);
        const float area = world_.area[i] * 1.0e-6f;
        if (area < 8.0f || area > 900.0f || world_.height[i] < 12.0f) continue;
        if (world_.receiver[i] == kNoReceiver || taken_[i]) continue;
        const float score = std::sqrt(area) * unitLow(hashCell(col, row, seed_ + 32));
        if (score > best) {
          best = score;
          lake.outlet = i;
        }
      }
    }
    lake.level = std::floor(world_.height[lake.outlet] * 64.0f) / 64.0f;
    return best > 0.0f;
  }

  /// Collects what lies upstream of the outlet and low enough to change.
  void gather(const Lake& lake) {
    gathered_.assign(1, lake.outlet);
    distance_[lake.outlet] = 0.0f;
    for (size_t k = 0; k < gathered_.size() && gathered_.size() < kMaxShore; ++k) {
      const size_t node = gathered_[k];
      for (int direction = 0; direction < 8; ++direction) {
        const size_t donor = neighbour(node, (direction + 4) & 7);
        if (world_.receiver[donor] != direction || taken_[donor] || distance_[donor] >= 0.0f) continue;
        if (world_.height[donor] > lake.level + 3.0f * lake.deep) continue;
        distance_[donor] = distance_[node] + kCellMeters;
        gathered_.push_back(donor);
      }
    }
  }

  void forget() {
    for (const size_t node : gathered_) distance_[node] = -1.0f;
  }

  float shoreAt(const Lake& lake, size_t node) const {
    return lake.deep * smoothStep(0.0f, kTaperMeters, distance_[node]);
  }
  bool isWet(const Lake& lake, size_t node) const {
    const float shore = shoreAt(lake, node);
    return node != lake.outlet && shore >= 0.5f && world_.height[node] - lake.level < shore;
  }
  /// How far a gathered node sinks: wet ones under water, the slopes above less the higher they are.
  float lowering(const Lake& lake, size_t node) const {
    const float shore = shoreAt(lake, node);
    const float above = world_.height[node] - lake.level;
    if (node == lake.outlet || shore < 0.5f || above > 3.0f * shore) return 0.0f;
    return above < shore ? shore + 0.5f : 0.5f * (3.0f * shore - above);
  }

  /// The nodes under water, or 0 where the lake would leak, be a thread, or cut cliffs into ground that
  /// drains elsewhere.
  size_t weigh(const Lake& lake) const {
    if (gathered_.size() >= kMaxShore) return 0;
    size_t wet = 0;
    size_t inner = 0;
    size_t cliffs = 0;
    for (const size_t node : gathered_) {
      const bool under = isWet(lake, node);
      const bool sinks = lowering(lake, node) > 7.0f;
      int wetNeighbours = 0;
      for (int direction = 0; direction < 8; ++direction) {
        const size_t other = neighbour(node, direction);
        if (distance_[other] >= 0.0f) {
          if (under && isWet(lake, other)) ++wetNeighbours;
          continue;
        }
        if (sinks && world_.height[other] < lake.level + 3.0f * lake.deep) ++cliffs;
        if (under && distance_[node] > 250.0f && world_.height[other] < lake.level + 1.0f) return 0;
      }
      wet += under ? 1 : 0;
      inner += wetNeighbours >= 6 ? 1 : 0;
    }
    const bool fine = wet <= kMaxWet && 2 * inner > wet && cliffs <= 40 + wet / 15;
    return fine ? wet : 0;
  }

  void dig(const Lake& lake) {
    std::vector<float> sink(gathered_.size());
    std::vector<uint8_t> under(gathered_.size());
    for (size_t k = 0; k < gathered_.size(); ++k) {
      sink[k] = lowering(lake, gathered_[k]);
      under[k] = isWet(lake, gathered_[k]) ? 1 : 0;
    }
    for (size_t k = 0; k < gathered_.size(); ++k) {
      const size_t node = gathered_[k];
      world_.height[node] -= sink[k];
      taken_[node] = 1;
      if (under[k] == 0) continue;
      world_.inLake[node] = 1;
      world_.lakeLevel[node] = lake.level;
    }
    // Cut the way from the water to the outlet down to the water's level.
    for (size_t k = 0; k < gathered_.size(); ++k) {
      if (under[k] == 0) continue;
      for (size_t node = downstream(world_, gathered_[k]); node != lake.outlet && !world_.inLake[node];
           node = downstream(world_, node)) {
        world_.height[node] = std::min(world_.height[node], lake.level);
      }
    }
    // What stayed dry keeps above what it drains to; nodes are gathered from the outlet upwards.
    for (size_t k = 1; k < gathered_.size(); ++k) {
      if (under[k] != 0) continue;
      const size_t node = gathered_[k];
      const size_t down = downstream(world_, node);
      world_.height[node] =
          std::max(world_.height[node], world_.inLake[down] ? world_.lakeLevel[down] : world_.height[down]);
    }
  }

  World& world_;
  uint32_t seed_;
  std::vector<float> distance_;  ///< metres of river from the outlet at work; below 0: not gathered
  std::vector<uint8_t> taken_;   ///< the node belongs to a lake's basin
  std::vector<size_t> gathered_;
};

}  // namespace

void digLakes(World& world, uint32_t seed) {
  LakeDigger digger(world, seed);
  for (int row = 0; row < kWorldCells / kPatch; ++row) {
    for (int col = 0; col < kWorldCells / kPatch; ++col) digger.digPatch(col, row);
  }
  digger.drawShores();
}

}  // namespace terrane::synth
