#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "terrane/bake/source.h"

namespace terrane {

/// No height.
inline constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// One input made of a function: samples [x0, x1] x [y0, y1] of a level's lattice.
struct FunctionLayer {
  int level = 0;
  int64_t x0 = 0;
  int64_t y0 = 0;
  int64_t x1 = 0;
  int64_t y1 = 0;
  std::function<float(int64_t x, int64_t y)> height;  ///< metres at the level's lattice point; NaN: none
};

/// A Source whose inputs are functions; later ones lie on top.
class FunctionSource final : public Source {
 public:
  FunctionSource(std::vector<FunctionLayer> layers, double heightStep, double maxErrorMeters)
      : layers_(std::move(layers)) {
    for (const FunctionLayer& layer : layers_) {
      levels_.push_back(layer.level);
      InputRecord record;
      record.name = "function";
      record.nativeLevel = layer.level;
      record.sourceCrs = "LOCAL";
      record.sha256 = std::string(64, '0');
      record.width = record.height = 1;
      record.dataType = "Float32";
      plan_.inputs.push_back(record);
    }
    std::sort(levels_.begin(), levels_.end());
    levels_.erase(std::unique(levels_.begin(), levels_.end()), levels_.end());
    const int finest = levels_.back();
    for (const FunctionLayer& layer : layers_) {
      plan_.extentCols = std::max(plan_.extentCols, (layer.x1 << (finest - layer.level)) + 1);
      plan_.extentRows = std::max(plan_.extentRows, (layer.y1 << (finest - layer.level)) + 1);
    }
    plan_.frame.finestLevel = finest;
    plan_.frame.spacingX = plan_.frame.spacingY = 10.0;
    plan_.crsWkt = "LOCAL_CS[\"test\"]";
    plan_.crsName = "test";
    plan_.heightStep = heightStep;
    plan_.maxErrorMeters = maxErrorMeters;
    plan_.interpolates = levels_.size() == 1 && maxErrorMeters > 0.0;
  }

  const SourcePlan& plan() const override { return plan_; }
  std::vector<int> nativeLevels() const override { return levels_; }
  bool mayTouch(TileId id) const override {
    return std::any_of(layers_.begin(), layers_.end(),
                       [&](const FunctionLayer& layer) { return touches(layer, id); });
  }
  Result<std::unique_ptr<SourceReader>> openReader() const override {
    return std::unique_ptr<SourceReader>(new Reader(*this));
  }

 private:
  class Reader final : public SourceReader {
   public:
    explicit Reader(const FunctionSource& source) : source_(source) {}
    Result<bool> readTile(TileId id, std::span<float> heights, std::span<uint16_t> ranks) override {
      bool any = false;
      for (size_t i = 0; i < heights.size(); ++i) {
        const int64_t x = int64_t{id.col} * kTileCells + static_cast<int64_t>(i) % kTileSamples;
        const int64_t y = int64_t{id.row} * kTileCells + static_cast<int64_t>(i) / kTileSamples;
        heights[i] = std::numeric_limits<float>::quiet_NaN();
        ranks[i] = 0;
        for (size_t k = 0; k < source_.layers_.size(); ++k) {
          const FunctionLayer& layer = source_.layers_[k];
          if (layer.level != id.level || x < layer.x0 || x > layer.x1 || y < layer.y0 || y > layer.y1)
            continue;
          const float height = layer.height(x, y);
          if (std::isnan(height)) continue;
          heights[i] = height;
          ranks[i] = static_cast<uint16_t>(k + 1);
          any = true;
        }
      }
      return any;
    }

   private:
    const FunctionSource& source_;
  };

  static bool touches(const FunctionLayer& layer, TileId id) {
    const int64_t left = int64_t{id.col} * kTileCells;
    const int64_t top = int64_t{id.row} * kTileCells;
    return layer.level == id.level && layer.x0 <= left + kTileCells && layer.x1 >= left &&
           layer.y0 <= top + kTileCells && layer.y1 >= top;
  }

  std::vector<FunctionLayer> layers_;
  std::vector<int> levels_;
  SourcePlan plan_;
};

/// A repeatable number in [0, 1) for a lattice point.
inline double noiseAt(int64_t x, int64_t y, uint64_t seed) {
  uint64_t h = static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15ULL ^
               static_cast<uint64_t>(y) * 0xc2b2ae3d27d4eb4fULL ^ seed * 0x165667b19e3779f9ULL;
  h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9ULL;
  h = (h ^ h >> 32) * 0x94d049bb133111ebULL;
  return static_cast<double>(h >> 40) / static_cast<double>(1 << 24);
}

/// Hills, steps and noise: something for every scale.
inline float roughGround(int64_t x, int64_t y, uint64_t seed) {
  const double u = static_cast<double>(x);
  const double v = static_cast<double>(y);
  const double phase = static_cast<double>(seed % 97);
  const double hills = 300.0 * std::sin(u / 170.0 + phase) * std::cos(v / 130.0 - phase) +
                       40.0 * std::sin((u + 2.0 * v) / 23.0);
  return static_cast<float>(1000.0 + hills + 8.0 * noiseAt(x, y, seed) +
                            (noiseAt(x >> 5, y >> 5, seed) > 0.8 ? 60.0 : 0.0));
}

}  // namespace terrane
