#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "terrane/codec/mesh_level.h"

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
    out.samples.coverage.kind = Coverage::Kind::Full;
    const auto nodes = static_cast<size_t>(tileNodeCount(id.isRoot()));
    for (size_t i = 0; i < nodes; ++i)
      out.nodes.error.push_back(static_cast<uint8_t>(random() % static_cast<unsigned>(mostCode + 1)));
    return out;
  }

 private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(side_ + 1) + static_cast<size_t>(x);
  }
  int depth_;
  int side_;
  std::vector<float> heights_;
  std::vector<uint8_t> isVoid_;
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
