#include "terrane/codec/strip_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "random_heights.h"

namespace terrane {
namespace {

// What the paper says, done again in the plainest way, by none of the codec's arithmetic: only packed
// vertices and the bits of entries are taken from it.

using StripPoint = std::pair<int, int>;
/// The right angle first; the others in order.
using Triangle = std::array<StripPoint, 3>;

const float kNothing = std::numeric_limits<float>::quiet_NaN();

double qOf(const StripMesh& mesh, float height) {
  if (mesh.stepMeters == 0.0) return 0.0;
  const double lowest = mesh.baseMeters - mesh.stepMeters / 2.0;
  return std::clamp(std::floor((height - lowest) / mesh.stepMeters), 0.0, std::exp2(mesh.heightBits) - 1.0);
}

int64_t cross(StripPoint a, StripPoint b, StripPoint c) {
  return int64_t{b.first - a.first} * (c.second - a.second) -
         int64_t{b.second - a.second} * (c.first - a.first);
}

/// Calls `use` with each sample in the triangle, border included, and the q that the triangle has there.
template <class Use>
void forSamplesIn(const std::array<StripPoint, 3>& corner, const std::array<double, 3>& q, const Use& use) {
  const auto [minX, maxX] = std::minmax({corner[0].first, corner[1].first, corner[2].first});
  const auto [minY, maxY] = std::minmax({corner[0].second, corner[1].second, corner[2].second});
  const int64_t area = cross(corner[0], corner[1], corner[2]);
  for (int y = minY; y <= maxY; ++y) {
    for (int x = minX; x <= maxX; ++x) {
      const StripPoint p{x, y};
      const std::array<int64_t, 3> weight = {cross(p, corner[1], corner[2]), cross(corner[0], p, corner[2]),
                                             cross(corner[0], corner[1], p)};
      if (std::any_of(weight.begin(), weight.end(),
                      [&](int64_t w) { return w != 0 && (w < 0) != (area < 0); }))
        continue;
      double sum = 0.0;
      for (size_t i = 0; i < 3; ++i) sum += static_cast<double>(weight[i]) * q[i];
      use(x, y, sum / static_cast<double>(area));
    }
  }
}

/// The mesh by splitting one triangle after the other, each time with its neighbour.
class NaiveMesh {
 public:
  NaiveMesh(const StripMesh& mesh, const std::vector<float>& heights, double bound)
      : mesh_(mesh), heights_(heights), bound_(bound) {
    const int last = mesh.side - 1;
    const StripPoint middle{last / 2, last / 2};
    add({middle, {0, 0}, {0, last}});
    add({middle, {0, last}, {last, last}});
    add({middle, {last, 0}, {last, last}});
    add({middle, {0, 0}, {last, 0}});
    for (bool again = true; again;) {
      again = false;
      const std::set<Triangle> all = triangles_;
      for (const Triangle& triangle : all) {
        if (triangles_.count(triangle) == 0 || fits(triangle)) continue;
        split(triangle);
        again = true;
      }
    }
  }
  const std::set<Triangle>& triangles() const { return triangles_; }

 private:
  void add(Triangle triangle) {
    std::sort(triangle.begin() + 1, triangle.end());
    triangles_.insert(triangle);
    byHypotenuse_[{triangle[1], triangle[2]}].insert(triangle);
  }
  void remove(const Triangle& triangle) {
    triangles_.erase(triangle);
    byHypotenuse_[{triangle[1], triangle[2]}].erase(triangle);
  }
  float heightAt(int x, int y) const { return heights_[static_cast<size_t>(y * mesh_.side + x)]; }
  bool fits(const Triangle& triangle) const {
    std::array<double, 3> q;
    // note: on tiles without holes only; with them the filled heights are the codec's own affair.
    for (size_t i = 0; i < 3; ++i) q[i] = qOf(mesh_, heightAt(triangle[i].first, triangle[i].second));
    double worst = 0.0;
    forSamplesIn(triangle, q, [&](int x, int y, double at) {
      worst = std::max(worst, std::abs(mesh_.baseMeters + at * mesh_.stepMeters - heightAt(x, y)));
    });
    return worst <= bound_;
  }
  bool isOnBorder(StripPoint a, StripPoint b) const {
    const int last = mesh_.side - 1;
    return (a.first == b.first && a.first % last == 0) || (a.second == b.second && a.second % last == 0);
  }
  void split(const Triangle& triangle) {
    const auto [apex, a, b] = triangle;
    if (!isOnBorder(a, b)) {
      // While the neighbour across the hypotenuse is larger (has it as a leg), it is split first.
      while (byHypotenuse_[{a, b}].size() < 2) {
        const auto larger =
            std::find_if(triangles_.begin(), triangles_.end(), [&, a = a, b = b](const Triangle& t) {
              return t != triangle && std::find(t.begin(), t.end(), a) != t.end() &&
                     std::find(t.begin(), t.end(), b) != t.end();
            });
        ASSERT_NE(larger, triangles_.end());
        split(*larger);
      }
    }
    const StripPoint middle{(a.first + b.first) / 2, (a.second + b.second) / 2};
    const std::set<Triangle> both = byHypotenuse_[{a, b}];
    for (const Triangle& half : both) {
      remove(half);
      add({middle, half[0], half[1]});
      add({middle, half[0], half[2]});
    }
  }

  const StripMesh& mesh_;
  const std::vector<float>& heights_;
  double bound_;
  std::set<Triangle> triangles_;
  std::map<std::pair<StripPoint, StripPoint>, std::set<Triangle>> byHypotenuse_;
};

/// A decoded triangle.
struct Decoded {
  std::array<StripPoint, 3> corner;  ///< v1, v2, v3
  std::array<uint32_t, 3> q;
};

std::vector<Decoded> decoded(const StripMesh& mesh) {
  std::vector<uint32_t> vertices;
  const auto count = decodeStripMesh(mesh, vertices);
  EXPECT_TRUE(count.ok()) << count.error().message;
  std::vector<Decoded> out;
  for (size_t i = 0; i + 2 < vertices.size(); i += 3) {
    Decoded triangle;
    for (size_t j = 0; j < 3; ++j) {
      const StripVertex vertex = unpackStripVertex(vertices[i + j]);
      triangle.corner[j] = {static_cast<int>(vertex.x), static_cast<int>(vertex.y)};
      triangle.q[j] = vertex.q;
    }
    out.push_back(triangle);
  }
  return out;
}

uint32_t entryOf(const StripMesh& mesh, size_t index) {
  uint32_t entry = 0;
  const auto width = static_cast<size_t>(2 + mesh.heightBits);
  for (size_t i = 0; i < width; ++i) {
    const size_t bit = index * width + i;
    entry |= (mesh.entries[bit / 32] >> (bit % 32) & 1U) << i;
  }
  return entry;
}

/// Where the right angle of a triangle is, 0 to 2.
size_t rightAngleOf(const std::array<StripPoint, 3>& corner) {
  for (size_t i = 0; i < 3; ++i) {
    const StripPoint a = corner[i];
    const StripPoint b = corner[(i + 1) % 3];
    const StripPoint c = corner[(i + 2) % 3];
    const int dot = (b.first - a.first) * (c.first - a.first) + (b.second - a.second) * (c.second - a.second);
    const auto square = [&](StripPoint p) {
      return (p.first - a.first) * (p.first - a.first) + (p.second - a.second) * (p.second - a.second);
    };
    if (dot == 0 && square(b) == square(c)) return i;
  }
  ADD_FAILURE() << "no right angle between equal legs";
  return 0;
}

Triangle normalOf(const std::array<StripPoint, 3>& corner) {
  const size_t apex = rightAngleOf(corner);
  Triangle out = {corner[apex], corner[(apex + 1) % 3], corner[(apex + 2) % 3]};
  std::sort(out.begin() + 1, out.end());
  return out;
}

StripMesh encoded(const std::vector<float>& heights, int side, double bound, double quantization = 0.0) {
  auto mesh = encodeStripMesh(heights, side, {bound, quantization});
  EXPECT_TRUE(mesh.ok()) << mesh.error().message;
  return mesh.ok() ? std::move(mesh).value() : StripMesh{};
}

void expectWithinBound(const StripMesh& mesh, const std::vector<float>& heights, double bound) {
  std::vector<uint8_t> seen(heights.size(), 0);
  for (const Decoded& triangle : decoded(mesh)) {
    const std::array<double, 3> q = {double(triangle.q[0]), double(triangle.q[1]), double(triangle.q[2])};
    forSamplesIn(triangle.corner, q, [&](int x, int y, double at) {
      const auto i = static_cast<size_t>(y * mesh.side + x);
      seen[i] = 1;
      if (!std::isfinite(heights[i])) return;
      ASSERT_LE(std::abs(mesh.baseMeters + at * mesh.stepMeters - heights[i]), bound) << x << ", " << y;
    });
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 0), 0);
}

/// The path as sections 4.1 and 4.2 tell of it.
void expectAPath(const StripMesh& mesh) {
  const std::vector<Decoded> triangles = decoded(mesh);
  ASSERT_EQ(triangles.size(), mesh.triangleCount);
  const int last = mesh.side - 1;

  // Table 1: what may follow each, A B C with windings L and R.
  const std::map<std::string, std::set<std::string>> follow = {
      {"AL", {"AL", "BR", "CL"}}, {"AR", {"AR", "BL", "CR"}}, {"BL", {"AL", "BR", "CL"}},
      {"BR", {"AR", "BL", "CR"}}, {"CL", {"AR", "BL", "CR"}}, {"CR", {"AL", "BR", "CL"}}};

  int64_t doubleArea = 0;
  std::set<Triangle> all;
  std::string before;
  for (size_t i = 0; i < triangles.size(); ++i) {
    const auto& [v1, v2, v3] = triangles[i].corner;
    // Counter-clockwise on a map; here y runs south.
    const int64_t area = -cross(v1, v2, v3);
    ASSERT_GT(area, 0) << i;
    doubleArea += area;
    ASSERT_TRUE(all.insert(normalOf(triangles[i].corner)).second) << i << " is there twice";
    ASSERT_TRUE(v1.first > 0 && v1.second > 0 && v1.first < last && v1.second < last)
        << "v1 of " << i << " is on the border";

    // The path leaves by the edge by which it enters the next triangle; left is v1, right is v2.
    bool right = false;
    if (i + 1 < triangles.size()) {
      const auto& next = triangles[i + 1];
      right = next.corner[0] == v3;
      ASSERT_TRUE(right ? next.corner[1] == v2 : next.corner[0] == v1 && next.corner[1] == v3) << i;
      ASSERT_TRUE(right ? next.q[0] == triangles[i].q[2] && next.q[1] == triangles[i].q[1]
                        : next.q[0] == triangles[i].q[0] && next.q[1] == triangles[i].q[2])
          << i;
    }
    const size_t apex = rightAngleOf(triangles[i].corner);
    const bool entersLeg = apex != 2;
    const bool leavesLeg = apex != (right ? 0U : 1U);
    const uint32_t type = entersLeg ? (leavesLeg ? 0 : 1) : 2;
    ASSERT_EQ(entryOf(mesh, i + 2) & 3U, type) << i;
    ASSERT_EQ(entryOf(mesh, i + 2) >> 2, triangles[i].q[2]) << i;
    if (i + 1 == triangles.size()) break;  // where the last one winds to nobody needs to know

    const std::string now = std::string(1, "ABC"[type]) + (right ? "R" : "L");
    // First(A_L), then what follows.
    const std::set<std::string> allowed = i == 0 ? std::set<std::string>{"AL", "CL"} : follow.at(before);
    ASSERT_EQ(allowed.count(now), 1U) << i << ": " << now << " after " << before;
    before = now;
  }
  EXPECT_EQ(doubleArea, 2 * int64_t{last} * last);
  EXPECT_EQ(entryOf(mesh, triangles.size() + 2), 3U);
}

TEST(StripMesh, IsTheMeshThatNaiveSplittingMakes) {
  for (const int side : {3, 5, 9, 17, 33}) {
    for (unsigned seed = 1; seed <= 40; ++seed) {
      if (seed % 7 == 0) continue;  // those have holes
      const std::vector<float> heights = randomHeights(side, seed);
      for (const double bound : {0.3, 2.0, 15.0}) {
        const StripMesh mesh = encoded(heights, side, bound);
        std::set<Triangle> ours;
        for (const Decoded& triangle : decoded(mesh)) {
          ours.insert(normalOf(triangle.corner));
          for (size_t i = 0; i < 3; ++i) {
            const auto [x, y] = triangle.corner[i];
            ASSERT_EQ(triangle.q[i], qOf(mesh, heights[static_cast<size_t>(y * side + x)]));
          }
        }
        const NaiveMesh naive(mesh, heights, bound);
        ASSERT_TRUE(ours == naive.triangles()) << side << " " << seed << " " << bound;
      }
    }
  }
}

TEST(StripMesh, IsAPathThroughEveryTriangleWithTheWindingsOfTheFollowSets) {
  for (const int side : {3, 5, 9, 17, 33, 65, 129}) {
    for (unsigned seed = 1; seed <= (side < 65 ? 60 : 8); ++seed) {
      for (const double bound : {0.2, 1.0, 8.0}) {
        SCOPED_TRACE(testing::Message() << side << " " << seed << " " << bound);
        ASSERT_NO_FATAL_FAILURE(expectAPath(encoded(randomHeights(side, seed), side, bound)));
      }
    }
  }
}

TEST(StripMesh, EverySampleIsWithinTheBound) {
  for (const int side : {3, 5, 9, 17, 33, 65, 129}) {
    for (unsigned seed = 1; seed <= (side < 65 ? 60 : 8); ++seed) {
      const std::vector<float> heights = randomHeights(side, seed);
      for (const double bound : {0.2, 1.0, 8.0, 1000.0}) {
        SCOPED_TRACE(testing::Message() << side << " " << seed << " " << bound);
        ASSERT_NO_FATAL_FAILURE(expectWithinBound(encoded(heights, side, bound), heights, bound));
        // Also where the quantisation takes nearly nothing, or everything, of the bound.
        ASSERT_NO_FATAL_FAILURE(expectWithinBound(encoded(heights, side, bound, bound), heights, bound));
        if (bound >= 1.0) {
          ASSERT_NO_FATAL_FAILURE(
              expectWithinBound(encoded(heights, side, bound, bound / 16), heights, bound));
        }
      }
    }
  }
}

TEST(StripMesh, ALargeTileHolds) {
  const std::vector<float> heights = randomHeights(513, 1);
  const StripMesh mesh = encoded(heights, 513, 0.9);
  EXPECT_GT(mesh.triangleCount, 10000U);
  expectAPath(mesh);
  expectWithinBound(mesh, heights, 0.9);
}

TEST(StripMesh, SplitsEverythingWhereNothingFits) {
  // Every other sample is a peak: all 2 * 4 * 4 triangles of a tile of 5 x 5 are needed.
  std::vector<float> heights;
  for (int i = 0; i < 25; ++i) heights.push_back(i % 2 == 0 ? 0.0F : 100.0F);
  EXPECT_EQ(encoded(heights, 5, 1.0).triangleCount, 32U);
}

TEST(StripMesh, HasAsManyBitsAsTheFormulaSays) {
  for (const double range : {0.0, 0.4, 0.5, 0.51, 1.0, 7.9, 8.0, 8.1, 1000.0, 2047.0, 2048.0}) {
    std::vector<float> heights(25, 0.0F);
    heights[7] = static_cast<float>(range);
    const StripMesh mesh = encoded(heights, 5, 1.0);
    const double exact = heights[7];
    const int bits = exact == 0.0 ? 0 : std::max(static_cast<int>(std::ceil(std::log2(exact / 0.5))), 0);
    EXPECT_EQ(mesh.heightBits, bits) << range;
    EXPECT_EQ(mesh.stepMeters, exact / std::exp2(bits)) << range;
    EXPECT_EQ(mesh.baseMeters, mesh.stepMeters / 2) << range;
    EXPECT_LE(mesh.stepMeters / 2, 0.25) << range;
  }
  std::vector<float> heights(25, 0.0F);
  heights[7] = 2049.0F;
  const auto tooHigh = encodeStripMesh(heights, 5, {1.0, 0.0});
  ASSERT_FALSE(tooHigh.ok());
  EXPECT_NE(tooHigh.error().message.find("13 bits"), std::string::npos) << tooHigh.error().message;
}

TEST(StripMesh, TellsWhatItCosts) {
  const StripMesh mesh = encoded(randomHeights(33, 2), 33, 1.0);
  EXPECT_EQ(mesh.headerBitCount(), 32 * ((mesh.triangleCount + 15) / 16));
  EXPECT_EQ(mesh.topologyBitCount(), 2 * (mesh.triangleCount + 3));
  EXPECT_EQ(mesh.bitCount(), mesh.headerBitCount() + (mesh.triangleCount + 3) * (2U + mesh.heightBits));
  EXPECT_EQ(bytesOf(mesh).size(), 24 + (mesh.bitCount() + 7) / 8);
}

TEST(StripMesh, NoDataForcesNothingAndNeedsNothing) {
  // Nothing known at all.
  const StripMesh empty = encoded(std::vector<float>(81, kNothing), 9, 1.0);
  EXPECT_EQ(empty.triangleCount, 4U);
  EXPECT_EQ(empty.heightBits, 0);
  EXPECT_EQ(empty.heightMeters(0), 0.0);

  // A plateau whose one half, corners included, is not known: the other half's height everywhere.
  std::vector<float> half(81, 700.0F);
  for (size_t i = 0; i < 40; ++i) half[i] = i % 2 == 0 ? kNothing : -std::numeric_limits<float>::infinity();
  const StripMesh plateau = encoded(half, 9, 1.0);
  EXPECT_EQ(plateau.triangleCount, 4U);
  EXPECT_EQ(plateau.heightMeters(0), 700.0);

  // The only known sample.
  std::vector<float> one(81, kNothing);
  one[33] = -5.0F;
  EXPECT_EQ(encoded(one, 9, 1.0).baseMeters, -5.0);
}

TEST(StripMesh, RefusesWhatItCannotHold) {
  const std::vector<float> heights(81, 1.0F);
  for (const int side : {-1, 0, 1, 2, 4, 8, 10, 1025})
    EXPECT_FALSE(encodeStripMesh(heights, side, {1.0, 0.0}).ok()) << side;
  EXPECT_FALSE(encodeStripMesh(heights, 17, {1.0, 0.0}).ok());
  EXPECT_FALSE(encodeStripMesh(heights, 9, {0.0, 0.0}).ok());
  EXPECT_FALSE(encodeStripMesh(heights, 9, {std::nan(""), 0.0}).ok());
  EXPECT_FALSE(encodeStripMesh(heights, 9, {1.0, 1.5}).ok());
  EXPECT_FALSE(encodeStripMesh(heights, 9, {1.0, -1.0}).ok());
  EXPECT_TRUE(encodeStripMesh(heights, 9, {1.0, 1.0}).ok());

  // A bound so small that a quarter of it is nothing.
  EXPECT_TRUE(encodeStripMesh(heights, 9, {std::numeric_limits<double>::denorm_min(), 0.0}).ok());
  std::vector<float> slope = heights;
  slope[0] = 2.0F;
  EXPECT_FALSE(encodeStripMesh(slope, 9, {std::numeric_limits<double>::denorm_min(), 0.0}).ok());
}

TEST(StripMesh, TheBytesAreThoseOfTheFormat) {
  // A slope to the east: 0, 1, 2 m in 3 x 3 samples. Within 0.5 m, by steps of 0.25 m, 3 bits, that is four
  // triangles, A_L each.
  const StripMesh mesh = encoded({0, 1, 2, 0, 1, 2, 0, 1, 2}, 3, 0.5, 0.125);
  const std::vector<uint8_t> expected = {
      1,    1,    3,    0,                       // version, side 2^1 + 1, bits, nothing
      4,    0,    0,    0,                       // triangles
      0,    0,    0,    0,    0, 0, 0xc0, 0x3f,  // 0.125 m
      0,    0,    0,    0,    0, 0, 0xd0, 0x3f,  // 0.25 m
      1,    2,    0x14, 0,                       // (1, 1), NW, 2^0, v1 is two entries before, L
      0x10, 0x00, 0xce, 0xc1, 0,                 // 5 bits each: q 4 0, then A 0, A 7, A 7, A 0, then the end
  };
  EXPECT_EQ(bytesOf(mesh), expected);
}

TEST(StripMesh, BytesComeBack) {
  for (const int side : {3, 5, 17, 65}) {
    for (unsigned seed = 1; seed <= 30; ++seed) {
      const StripMesh mesh = encoded(randomHeights(side, seed), side, 0.5);
      const auto again = parseStripMesh(bytesOf(mesh));
      ASSERT_TRUE(again.ok()) << again.error().message;
      EXPECT_EQ(again->side, mesh.side);
      EXPECT_EQ(again->heightBits, mesh.heightBits);
      EXPECT_EQ(again->baseMeters, mesh.baseMeters);
      EXPECT_EQ(again->stepMeters, mesh.stepMeters);
      EXPECT_EQ(again->triangleCount, mesh.triangleCount);
      EXPECT_EQ(again->headers, mesh.headers);
      EXPECT_EQ(again->entries, mesh.entries);
      EXPECT_TRUE(validateStripMesh(*again).ok());
    }
  }
}

/// Decodes what may be anything: an error, or triangles on the tile; both decoders agree on which.
bool decodesSafely(const std::vector<uint8_t>& bytes) {
  const auto mesh = parseStripMesh(bytes);
  if (!mesh.ok()) return false;
  std::vector<uint32_t> vertices(5, 7);
  const auto count = decodeStripMesh(*mesh, vertices);
  EXPECT_EQ(count.ok(), validateStripMesh(*mesh).ok());
  if (!count.ok()) {
    EXPECT_TRUE(vertices.empty());
    return false;
  }
  EXPECT_EQ(vertices.size(), 3 * *count);
  EXPECT_EQ(*count, mesh->triangleCount);
  for (const uint32_t packed : vertices) {
    const StripVertex vertex = unpackStripVertex(packed);
    EXPECT_TRUE(vertex.x < static_cast<uint32_t>(mesh->side) &&
                vertex.y < static_cast<uint32_t>(mesh->side) && vertex.q < 1U << mesh->heightBits);
  }
  return true;
}

TEST(StripMesh, EveryTruncatedLengthAndExtraBytesAreErrors) {
  for (const int side : {3, 9, 33}) {
    const std::vector<uint8_t> bytes = bytesOf(encoded(randomHeights(side, 1), side, 0.5));
    for (size_t length = 0; length < bytes.size(); ++length) {
      // note: a copy of that size, so that a sanitizer sees reads beyond it.
      const std::vector<uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(length));
      ASSERT_FALSE(parseStripMesh(cut).ok()) << length;
    }
    auto longer = bytes;
    longer.push_back(0);
    EXPECT_FALSE(parseStripMesh(longer).ok());
  }
}

TEST(StripMesh, DamageGivesErrorsOrTrianglesOnTheTile) {
  std::mt19937 random(7);
  int survived = 0;
  int tried = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const int side = seed % 3 == 0 ? 5 : seed % 3 == 1 ? 17 : 65;
    const std::vector<uint8_t> bytes = bytesOf(encoded(randomHeights(side, seed), side, 0.7));
    for (int i = 0; i < 300; ++i) {
      auto damaged = bytes;
      for (auto hits = 1 + random() % 3; hits > 0; --hits)
        damaged[random() % damaged.size()] ^= static_cast<uint8_t>(1U << random() % 8);
      survived += decodesSafely(damaged) ? 1 : 0;
      ++tried;
    }
  }
  // What survives has damaged heights, not damaged headers.
  EXPECT_GT(survived, 0);
  EXPECT_LT(survived, tried);
}

TEST(StripMesh, EveryDamagedBitOfAHeaderIsNoticed) {
  const StripMesh mesh = encoded(randomHeights(33, 4), 33, 1.0);
  ASSERT_GT(mesh.headers.size(), 3U);
  for (size_t i = 1; i < mesh.headers.size(); ++i) {
    for (int bit = 0; bit < 32; ++bit) {
      StripMesh damaged = mesh;
      damaged.headers[i] ^= 1U << bit;
      // note: another distance to the height may lead to the same height.
      if (bit >= 25 && bit < 29) continue;
      ASSERT_FALSE(validateStripMesh(damaged).ok()) << i << " " << bit;
    }
  }
}

TEST(StripMesh, VectorsOfTheWrongLengthAreErrors) {
  const StripMesh mesh = encoded(randomHeights(17, 4), 17, 1.0);
  std::vector<uint32_t> vertices;
  const auto refuses = [&](const auto& change) {
    StripMesh changed = mesh;
    change(changed);
    return !decodeStripMesh(changed, vertices).ok() && !validateStripMesh(changed).ok();
  };
  EXPECT_TRUE(refuses([](StripMesh& m) { m.headers.pop_back(); }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.headers.push_back(m.headers.back()); }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.entries.pop_back(); }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.entries.push_back(0); }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.entries.back() = 1; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.triangleCount = 0; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.triangleCount += 1; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.triangleCount = 0xffffffffU; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.heightBits = 13; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.heightBits = -1; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.side = 9; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.side = 18; }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m.stepMeters = std::nan(""); }));
  EXPECT_TRUE(refuses([](StripMesh& m) { m = {}; }));
}

}  // namespace
}  // namespace terrane
