#include "right_triangles.h"

#include <algorithm>
#include <cmath>

#include "terrane/base/check.h"

namespace terrane::serve {
namespace {

using Vertex = RightTriangles::Vertex;

class Mesher {
 public:
  Mesher(std::span<const float> heights, int cells, double bound)
      : heights_(heights),
        cells_(cells),
        bound_(bound),
        errors_(heights.size(), 0.0F),
        numbers_(heights.size(), -1) {
    // From the smallest squares up, so that what is within is known: edges' middles, then squares' centres.
    for (int half = 1; half < cells; half *= 2) {
      for (int row = 0; row <= cells; row += half)
        for (int col = row / half % 2 == 0 ? half : 0; col <= cells; col += 2 * half)
          measureEdge(col, row, half);
      for (int row = half; row <= cells; row += 2 * half)
        for (int col = half; col <= cells; col += 2 * half) measureCenter(col, row, half);
    }
  }

  RightTriangles mesh() {
    const auto last = static_cast<int16_t>(cells_);
    split({0, 0}, {last, last}, {last, 0});
    split({last, last}, {0, 0}, {0, last});
    return std::move(out_);
  }

 private:
  size_t at(int col, int row) const { return static_cast<size_t>(row * (cells_ + 1) + col); }
  float heightAt(int col, int row) const { return heights_[at(col, row)]; }
  float errorAt(int col, int row) const {
    return col < 0 || row < 0 || col > cells_ || row > cells_ ? 0.0F : errors_[at(col, row)];
  }

  void measure(int col, int row, int dx, int dy, float within) {
    const float mean = 0.5F * (heightAt(col - dx, row - dy) + heightAt(col + dx, row + dy));
    errors_[at(col, row)] = std::max(std::abs(mean - heightAt(col, row)), within);
  }
  /// The middle of an edge of a square of 2 `half` cells: within are the centres of four squares of half the
  /// size.
  void measureEdge(int col, int row, int half) {
    const bool isHorizontal = row / half % 2 == 0;
    float within = 0.0F;
    const int quarter = half / 2;
    if (quarter > 0)
      for (const int dy : {-quarter, quarter})
        for (const int dx : {-quarter, quarter}) within = std::max(within, errorAt(col + dx, row + dy));
    measure(col, row, isHorizontal ? half : 0, isHorizontal ? 0 : half, within);
  }
  /// The centre of a square: within are the middles of its edges.
  void measureCenter(int col, int row, int half) {
    const float within = std::max({errorAt(col - half, row), errorAt(col + half, row),
                                   errorAt(col, row - half), errorAt(col, row + half)});
    const bool isFalling = (col / (2 * half) + row / (2 * half)) % 2 == 0;
    measure(col, row, half, isFalling ? half : -half, within);
  }

  /// The triangle with the hypotenuse from a to b and the apex c.
  void split(Vertex a, Vertex b, Vertex c) {
    const Vertex middle{static_cast<int16_t>((a.col + b.col) / 2), static_cast<int16_t>((a.row + b.row) / 2)};
    const bool isSmallest = std::abs(a.col - c.col) + std::abs(a.row - c.row) <= 1;
    if (!isSmallest && static_cast<double>(errors_[at(middle.col, middle.row)]) > bound_) {
      split(c, a, middle);
      split(b, c, middle);
      return;
    }
    for (const Vertex& vertex : {a, b, c}) {
      int32_t& number = numbers_[at(vertex.col, vertex.row)];
      if (number < 0) {
        number = static_cast<int32_t>(out_.vertices.size());
        out_.vertices.push_back(vertex);
      }
      out_.indices.push_back(static_cast<uint32_t>(number));
    }
  }

  std::span<const float> heights_;
  int cells_;
  double bound_;
  std::vector<float> errors_;
  std::vector<int32_t> numbers_;
  RightTriangles out_;
};

}  // namespace

RightTriangles rightTriangles(std::span<const float> heights, int cells, double bound) {
  TERRANE_CHECK(cells >= 2 && (cells & (cells - 1)) == 0 &&
                    heights.size() == static_cast<size_t>(cells + 1) * static_cast<size_t>(cells + 1),
                "{} cells, {} heights", cells, heights.size());
  return Mesher(heights, cells, bound).mesh();
}

}  // namespace terrane::serve
