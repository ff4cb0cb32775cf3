#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>

#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"
#include "terrane/reference/reference_surface.h"

namespace terrane {

struct ReferenceOptions {
  /// The most that the surface may take, about 5.5 bytes a sample of the dataset's extent.
  uint64_t memoryBytes = 4000000000;
};

/// Decodes the finest level of a dataset, tiles that are not stored interpolated from their parents. Errors:
/// a tile that cannot be read or decoded; an extent that does not fit into `memoryBytes`.
Result<ReferenceSurface> loadReference(const Dataset& dataset, const ReferenceOptions& options = {});

/// Heights of a dataset's finest level by place, decoded where they are asked for: for the few places that a
/// flight wants to know. One thread.
class HeightProbe {
 public:
  /// `dataset` must live longer.
  explicit HeightProbe(const Dataset& dataset);
  ~HeightProbe();
  HeightProbe(HeightProbe&&) noexcept;

  /// The full-resolution surface's height at a place in local metres; NaN where there is no ground, or where
  /// the tile cannot be read (see error()). Cost: a tile and its ancestors, where they are not among the
  /// latest few hundred.
  double heightAt(glm::dvec2 place);
  /// The first thing that went wrong.
  const Status& error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace terrane
