#pragma once

#include <span>
#include <vector>

#include "mesh_lattice.h"
#include "terrane/codec/mesh_relief.h"

namespace terrane {

/// Finds the relief of a mesh level: of two surfaces over all samples and all mixtures of them, and of
/// triangles that lie elsewhere.
class ReliefFinder {
 public:
  ReliefFinder(std::span<const float> own, std::span<const float> coarse, int level);
  /// A triangle that is not on those surfaces, between two heights.
  void add(const MeshPoint (&corners)[3], float low, float high);
  /// Of all patches of the level.
  MeshRelief find(bool centerFalls) const;

 private:
  float& onRow(int row, int square) { return onRows_[static_cast<size_t>(row * squares_ + square)]; }
  float& onColumn(int column, int square) {
    return onColumns_[static_cast<size_t>(column * squares_ + square)];
  }
  float& top(int column, int row) { return tops_[static_cast<size_t>(row * squares_ + column)]; }

  int level_;
  int step_;
  int squares_;  ///< along the tile's side
  std::vector<float> onRows_, onColumns_, tops_;
};

}  // namespace terrane
