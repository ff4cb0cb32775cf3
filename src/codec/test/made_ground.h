#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "terrane/codec/mesh_level.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A small world, all of it in memory: tiles that share their borders, of one ground.
class MadeGround {
 public:
  /// `depth`: the finest tile level. `height` of a sample of the finest level; NaN: void.
  MadeGround(int depth, const std::function<double(int x, int y)>& height)
      : depth_(depth), side_(256 << depth) {
    heights_.resize(static_cast<size_t>(side_ + 1) * static_cast<size_t>(side_ + 1));
    isVoid_.resize(heights_.size());
    for (int y = 0; y <= side_; ++y) {
      for (int x = 0; x <= side_; ++x) {
        const double h = height(x, y);
        isVoid_[at(x, y)] = std::isnan(h) ? 1 : 0;
        heights_[at(x, y)] = std::isnan(h) ? 0.0F : static_cast<float>(h);
      }
    }
    visitFromCoarse([&](size_t center, size_t endA, size_t endB, const Diamond&) {
      if (isVoid_[center] != 0) heights_[center] = (heights_[endA] + heights_[endB]) * 0.5F;
    });
  }

  /// Divides the samples into layers of significance, one more than there are thresholds: those that leave
  /// the mean of their ends by more than the first threshold, with their ancestors, come first. Returns for
  /// each layer but the last how far its samples are from all of them.
  std::vector<double> divide(const std::vector<double>& thresholds) {
    const Lattice lattice(depth_);
    layerCount_ = static_cast<int>(thresholds.size()) + 1;
    layers_.assign(heights_.size(), static_cast<uint8_t>(thresholds.size()));
    std::vector<Diamond> diamonds;
    visitFromCoarse([&](size_t, size_t, size_t, const Diamond& d) { diamonds.push_back(d); });
    for (size_t layer = thresholds.size(); layer-- > 0;) {
      for (int y = 0; y <= side_; y += 16)
        for (int x = 0; x <= side_; x += 16) layers_[at(x, y)] = 0;
      for (auto d = diamonds.rbegin(); d != diamonds.rend(); ++d) {
        const auto ends = lattice.hypotenuse(*d);
        const size_t center = at(d->x, d->y);
        const float mean = (heights_[at(ends[0].x, ends[0].y)] + heights_[at(ends[1].x, ends[1].y)]) * 0.5F;
        const bool leaves = isVoid_[center] == 0 &&
                            std::abs(static_cast<double>(heights_[center] - mean)) > thresholds[layer];
        if (leaves) layers_[center] = std::min(layers_[center], static_cast<uint8_t>(layer));
        if (layers_[center] > layer) continue;
        for (const LatticePoint apex : lattice.apexes(*d)) {
          uint8_t& above = layers_[at(apex.x, apex.y)];
          above = std::min(above, layers_[center]);
        }
      }
    }
    std::vector<double> offsets;
    for (size_t layer = 0; layer < thresholds.size(); ++layer) {
      std::vector<float> heights = heights_;
      double most = 0.0;
      visitFromCoarse([&](size_t center, size_t endA, size_t endB, const Diamond&) {
        if (isVoid_[center] != 0 || layers_[center] > layer)
          heights[center] = (heights[endA] + heights[endB]) * 0.5F;
        most = std::max(most, std::abs(static_cast<double>(heights[center] - heights_[center])));
      });
      offsets.push_back(most);
    }
    return offsets;
  }

  /// A tile whose nodes have random error codes, `mostCode` at most.
  Tile tile(TileId id, std::mt19937& random, int mostCode) const {
    Tile out;
    const int step = 1 << (depth_ - id.level);
    out.samples.heights.resize(kTileSampleCount);
    out.samples.states.resize(kTileSampleCount);
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        const size_t from = at((id.col * kTileCells + x) * step, (id.row * kTileCells + y) * step);
        const auto to = static_cast<size_t>(y * kTileSamples + x);
        out.samples.heights[to] = heights_[from];
        out.samples.states[to] = isVoid_[from] != 0 ? SampleState::Void : SampleState::Coded;
      }
    }
    if (!layers_.empty()) {
      out.samples.layerCount = layerCount_;
      for (int y = 0; y < kTileSamples; ++y)
        for (int x = 0; x < kTileSamples; ++x)
          out.samples.layers.push_back(
              layers_[at((id.col * kTileCells + x) * step, (id.row * kTileCells + y) * step)]);
    }
    out.samples.coverage.kind = Coverage::Kind::Full;
    const auto nodes = static_cast<size_t>(tileNodeCount(id.isRoot()));
    for (size_t i = 0; i < nodes; ++i)
      out.nodes.error.push_back(static_cast<uint8_t>(random() % static_cast<unsigned>(mostCode + 1)));
    return out;
  }

 private:
  /// visit(center, end, end, diamond), indices, parents before children.
  template <class Visit>
  void visitFromCoarse(Visit&& visit) const {
    const Lattice lattice(depth_);
    std::vector<Diamond> diamonds;
    for (int y = 0; y <= side_; ++y)
      for (int x = 0; x <= side_; ++x)
        if (x % side_ != 0 || y % side_ != 0) diamonds.push_back(lattice.diamondAt({x, y}));
    std::stable_sort(diamonds.begin(), diamonds.end(),
                     [](const Diamond& a, const Diamond& b) { return a.level < b.level; });
    for (const Diamond& d : diamonds) {
      const auto ends = lattice.hypotenuse(d);
      visit(at(d.x, d.y), at(ends[0].x, ends[0].y), at(ends[1].x, ends[1].y), d);
    }
  }
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(side_ + 1) + static_cast<size_t>(x);
  }
  int depth_;
  int side_;
  std::vector<float> heights_;
  std::vector<uint8_t> isVoid_;
  int layerCount_ = 1;
  std::vector<uint8_t> layers_;  ///< empty: all of the first
};

/// Ground of several kinds: rough, smooth, flat with a cliff, steps.
inline std::function<double(int, int)> someGround(unsigned kind, std::mt19937& random) {
  const double a = 0.01 + 0.05 * static_cast<double>(random() % 100) / 100.0;
  const double b = 0.01 + 0.05 * static_cast<double>(random() % 100) / 100.0;
  const auto seed = static_cast<unsigned>(random());
  const auto noise = [seed](int x, int y) {
    unsigned h = seed ^ static_cast<unsigned>(x) * 0x9e3779b1U ^ static_cast<unsigned>(y) * 0x85ebca77U;
    h ^= h >> 15;
    h *= 0x2c1b3c6dU;
    h ^= h >> 12;
    return static_cast<double>(h % 1000U) / 1000.0;
  };
  switch (kind % 5) {
    case 0:
      return [=](int x, int y) { return 40.0 * std::sin(a * x) * std::cos(b * y) + 6.0 * noise(x, y); };
    case 1:
      return [=](int x, int y) { return 300.0 * std::sin(a * x + b * y) + 30.0 * std::cos(3 * a * x); };
    case 2:
      return [=](int x, int y) { return x * 3 + y * 5 > 700 ? 120.0 + 2.0 * noise(x, y) : 0.0; };
    case 3:
      return [=](int x, int y) { return std::floor(8.0 * std::sin(a * x) + 5.0 * std::sin(b * y)); };
    default:
      return [=](int x, int y) {
        const bool hole = std::hypot(x - 150.0, y - 90.0) < 60.0 || (x + 3 * y) % 97 == 0;
        return hole ? std::nan("") : 60.0 * std::sin(a * x) * std::sin(b * y) + 3.0 * noise(x, y);
      };
  }
}

}  // namespace terrane
