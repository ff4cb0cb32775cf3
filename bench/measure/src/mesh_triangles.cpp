#include "terrane/measure/mesh_triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "terrane/base/check.h"

namespace terrane {
namespace {

/// Squares of the grid for each triangle, about.
constexpr double kSquaresPerTriangle = 1.0;
constexpr int kMostSquares = 64;

glm::dvec2 placeOf(const PatchVertex& v) {
  return {v.x(), v.y()};
}
double doubleArea(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// note: says again what shaders/mesh_patch.glsl says; benches hold what is drawn against it.
double exactDrawnHeight(const PatchVertex& v, float morph) {
  if (morph >= 1.0F) return static_cast<double>(v.heightMeters);
  return static_cast<double>(v.coarseMeters + morph * (v.heightMeters - v.coarseMeters));
}

}  // namespace

MeshTriangles::MeshTriangles(const MeshLevel& meshes, const MeshLevel::Patch& patch)
    : vertices_(std::span(meshes.vertices).subspan(patch.firstVertex, patch.vertexCount)),
      indices_(std::span(meshes.indices).subspan(patch.firstIndex, patch.indexCount)) {
  TERRANE_CHECK(!indices_.empty(), "a patch of level {} without triangles", meshes.level);
  glm::dvec2 low = placeOf(vertices_[0]), high = low;
  for (const PatchVertex& v : vertices_) {
    low = {std::min(low.x, double(v.x())), std::min(low.y, double(v.y()))};
    high = {std::max(high.x, double(v.x())), std::max(high.y, double(v.y()))};
  }
  const auto triangles = static_cast<double>(indices_.size() / 3);
  side_ = std::clamp(static_cast<int>(std::sqrt(kSquaresPerTriangle * triangles)), 1, kMostSquares);
  origin_ = low;
  squaresPerSample_ = side_ / std::max(high.x - low.x, high.y - low.y);

  // Count, then fill: all squares that a triangle's own box touches.
  const auto forEachSquare = [&](auto&& visit) {
    for (size_t i = 0; i < indices_.size(); i += 3) {
      const glm::dvec2 a = placeOf(vertices_[indices_[i]]), b = placeOf(vertices_[indices_[i + 1]]),
                       c = placeOf(vertices_[indices_[i + 2]]);
      const glm::ivec2 from = squareOf({std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})});
      const glm::ivec2 to = squareOf({std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})});
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x)
          visit(static_cast<size_t>(y * side_ + x), static_cast<uint16_t>(i / 3));
    }
  };
  first_.assign(static_cast<size_t>(side_ * side_) + 1, 0);
  forEachSquare([&](size_t square, uint16_t) { ++first_[square + 1]; });
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  listed_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  forEachSquare([&](size_t square, uint16_t triangle) { listed_[next[square]++] = triangle; });
}

glm::ivec2 MeshTriangles::squareOf(glm::dvec2 sample) const {
  const auto along = [&](double offset) {
    return static_cast<int>(std::clamp(std::floor(offset * squaresPerSample_), 0.0, side_ - 1.0));
  };
  return {along(sample.x - origin_.x), along(sample.y - origin_.y)};
}

std::span<const uint16_t> MeshTriangles::listAt(glm::ivec2 square) const {
  const auto at = static_cast<size_t>(square.y * side_ + square.x);
  return std::span(listed_).subspan(first_[at], first_[at + 1] - first_[at]);
}

double MeshTriangles::heightAt(glm::dvec2 sample, float morph) const {
  // The triangle that the place is in, or the one that it is the least outside of.
  double most = -std::numeric_limits<double>::infinity();
  std::array<double, 3> weights{};
  std::array<uint16_t, 3> corners{};
  for (const uint16_t triangle : listAt(squareOf(sample))) {
    const size_t first = size_t{3} * triangle;
    const std::array<uint16_t, 3> t{indices_[first], indices_[first + 1], indices_[first + 2]};
    const glm::dvec2 a = placeOf(vertices_[t[0]]), b = placeOf(vertices_[t[1]]), c = placeOf(vertices_[t[2]]);
    const double area = doubleArea(a, b, c);
    const std::array<double, 3> parts{doubleArea(sample, b, c) / area, doubleArea(a, sample, c) / area,
                                      doubleArea(a, b, sample) / area};
    const double inside = std::min({parts[0], parts[1], parts[2]});
    if (inside <= most) continue;
    most = inside;
    weights = parts;
    corners = t;
    if (inside >= 0.0) break;
  }
  TERRANE_CHECK(std::isfinite(most), "no triangle near the sample {} {}", sample.x, sample.y);

  double sum = 0.0, height = 0.0;
  for (size_t i = 0; i < 3; ++i) {
    const double weight = std::max(weights[i], 0.0);
    sum += weight;
    height += weight * exactDrawnHeight(vertices_[corners[i]], morph);
  }
  return height / sum;
}

}  // namespace terrane
