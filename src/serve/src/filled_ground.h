#pragma once

#include <algorithm>
#include <optional>

#include "terrane/base/result.h"
#include "terrane/engine/surface.h"

namespace terrane::serve {

/// The surface on a level for clients that know nothing of void: small holes are filled, where else there is
/// no ground the height is 0. One thread.
class FilledGround {
 public:
  FilledGround(SurfaceTiles& tiles, int level)
      : surface_(tiles, level), wide_(tiles, std::max(level - kHoleLevels, 0)) {}

  /// The height at sample coordinates; 0 for what is not a number.
  Result<double> heightAt(glm::dvec2 sample) {
    if (!(sample.x == sample.x)) return 0.0;
    TERRANE_ASSIGN(const auto height, surface_.heightAt(sample));
    if (height) {
      hasGround_ = true;
      return *height;
    }
    TERRANE_ASSIGN(const auto around, wide_.heightAt(sample));
    if (!around) return 0.0;
    TERRANE_ASSIGN(const auto filled, surface_.filledHeightAt(sample));
    return filled.value_or(0.0);
  }
  /// Has there been ground anywhere so far?
  bool hasGround() const { return hasGround_; }

 private:
  /// Levels up, where a cell that is mostly ground makes what is missing in it a hole and no coast.
  static constexpr int kHoleLevels = 4;

  Surface surface_;
  Surface wide_;
  bool hasGround_ = false;
};

/// The level whose samples are no wider than so many of the finest.
int levelFor(double finestSamples, int finestLevel);

}  // namespace terrane::serve
