#include "greedy_delaunay.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <queue>

#include "terrane/base/check.h"

namespace terrane {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<uint32_t, Kernel>;  ///< the sample's index
using FaceBase = CGAL::Triangulation_face_base_with_info_2<size_t, Kernel>;        ///< place in alive_
using Triangulation =
    CGAL::Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;

/// The sample of a triangle that is furthest from it.
struct Candidate {
  double error = 0.0;
  uint32_t sample = 0;
  size_t place = 0;  ///< of the triangle in alive_
  Triangulation::Face_handle face;
  friend bool operator<(const Candidate& a, const Candidate& b) {
    return a.error != b.error ? a.error < b.error : a.sample < b.sample;
  }
};

class GreedyInsertion {
 public:
  GreedyInsertion(std::span<const float> heights, int side, double boundMeters)
      : heights_(heights), side_(side), boundMeters_(boundMeters) {}

  void run() {
    for (const int y : {0, side_ - 1}) {
      for (const int x : {0, side_ - 1}) add(sampleAt(x, y), Triangulation::Face_handle());
    }
    for (auto face = faces_.finite_faces_begin(); face != faces_.finite_faces_end(); ++face) scan(face);
    while (!candidates_.empty()) {
      const Candidate worst = candidates_.top();
      candidates_.pop();
      if (alive_[worst.place]) insert(worst);
    }
  }

  std::vector<GreedyTriangle> triangles() const {
    std::vector<GreedyTriangle> out;
    for (auto face = faces_.finite_faces_begin(); face != faces_.finite_faces_end(); ++face)
      out.push_back({face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()});
    return out;
  }

 private:
  uint32_t sampleAt(int x, int y) const { return static_cast<uint32_t>(y * side_ + x); }

  Triangulation::Vertex_handle add(uint32_t sample, Triangulation::Face_handle near) {
    const auto side = static_cast<uint32_t>(side_);
    const auto vertex = faces_.insert(
        {static_cast<double>(sample % side), -static_cast<double>(sample / side)}, near);  // y to the north
    vertex->info() = sample;
    return vertex;
  }

  /// Makes a candidate a vertex. Only triangles around it are new; those that made room for them are dead.
  void insert(const Candidate& candidate) {
    const auto side = static_cast<uint32_t>(side_);
    dying_.clear();
    faces_.get_conflicts(
        {static_cast<double>(candidate.sample % side), -static_cast<double>(candidate.sample / side)},
        std::back_inserter(dying_), candidate.face);
    for (const auto& face : dying_) {
      if (!faces_.is_infinite(face)) alive_[face->info()] = false;
    }
    const auto vertex = add(candidate.sample, candidate.face);
    const auto first = faces_.incident_faces(vertex);
    auto face = first;
    do {
      if (!faces_.is_infinite(face)) scan(face);
    } while (++face != first);
  }

  /// Finds the sample of a triangle that is furthest from its plane, and remembers it if it is too far.
  void scan(Triangulation::Face_handle face) {
    face->info() = alive_.size();
    alive_.push_back(true);
    Candidate worst;
    worst.face = face;
    worst.place = face->info();
    worst.error = boundMeters_;
    std::array<Corner, 3> corners;
    for (int i = 0; i < 3; ++i) corners[static_cast<size_t>(i)] = cornerOf(face->vertex(i)->info());
    scanRows(corners, worst);
    if (worst.error > boundMeters_) candidates_.push(worst);
  }

  struct Corner {
    int64_t x, y;  ///< y to the south
    double height;
  };
  Corner cornerOf(uint32_t sample) const {
    const auto side = static_cast<uint32_t>(side_);
    return {sample % side, sample / side, static_cast<double>(heights_[sample])};
  }

  /// Every sample of the triangle, its border included, against its plane.
  void scanRows(const std::array<Corner, 3>& corners, Candidate& worst) const {
    const auto& [a, b, c] = corners;
    const int64_t area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    TERRANE_CHECK(area != 0, "a triangle without an area");
    const double slopeX = ((b.height - a.height) * static_cast<double>(c.y - a.y) -
                           (c.height - a.height) * static_cast<double>(b.y - a.y)) /
                          static_cast<double>(area);
    const double slopeY = ((c.height - a.height) * static_cast<double>(b.x - a.x) -
                           (b.height - a.height) * static_cast<double>(c.x - a.x)) /
                          static_cast<double>(area);
    const auto [top, bottom] = std::minmax({a.y, b.y, c.y});
    for (int64_t y = top; y <= bottom; ++y) {
      const auto [west, east] = rowOf(corners, y);
      const double rowHeight = a.height + slopeY * static_cast<double>(y - a.y);
      for (int64_t x = west; x <= east; ++x) {
        const auto sample = static_cast<uint32_t>(y * side_ + x);
        const double height = rowHeight + slopeX * static_cast<double>(x - a.x);
        const double error = std::abs(double{heights_[sample]} - height);
        if (error > worst.error) {
          worst.error = error;
          worst.sample = sample;
        }
      }
    }
  }

  /// The first and the last sample of a row that lie in the triangle.
  static std::array<int64_t, 2> rowOf(const std::array<Corner, 3>& corners, int64_t y) {
    // note: ends are rounded inwards, in integers, so that no sample falls between two triangles.
    int64_t west = INT64_MAX;
    int64_t east = INT64_MIN;
    for (size_t i = 0; i < 3; ++i) {
      Corner p = corners[i];
      Corner q = corners[(i + 1) % 3];
      if (p.y > q.y) std::swap(p, q);
      if (y < p.y || y > q.y) continue;
      if (p.y == q.y) {
        west = std::min({west, p.x, q.x});
        east = std::max({east, p.x, q.x});
        continue;
      }
      const int64_t run = q.y - p.y;
      const int64_t along = p.x * run + (q.x - p.x) * (y - p.y);  // x times run; never negative
      west = std::min(west, (along + run - 1) / run);
      east = std::max(east, along / run);
    }
    return {west, east};
  }

  std::span<const float> heights_;
  int side_;
  double boundMeters_;
  Triangulation faces_;
  std::vector<bool> alive_;  ///< one for every triangle that there ever was
  std::vector<Triangulation::Face_handle> dying_;
  std::priority_queue<Candidate> candidates_;
};

}  // namespace

std::vector<GreedyTriangle> greedyDelaunay(std::span<const float> heights, int side, double boundMeters) {
  TERRANE_CHECK(side >= 2 && heights.size() == static_cast<size_t>(side) * static_cast<size_t>(side),
                "{} heights, side {}", heights.size(), side);
  GreedyInsertion insertion(heights, side, boundMeters);
  insertion.run();
  return insertion.triangles();
}

}  // namespace terrane
