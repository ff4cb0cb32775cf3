#include "terrane/codec/mesh_vertices.h"

#include <algorithm>
#include <cmath>

#include "mesh_lattice.h"
#include "terrane/base/check.h"
#include "terrane/base/float4.h"

namespace terrane {

namespace {

constexpr int kStride = kTileSamples;

/// Places along a row, four at a time.
Float4 placesFrom(float first) {
  static constexpr float kSteps[4] = {0.0F, 1.0F, 2.0F, 3.0F};
  return Float4::all(first) + Float4::load(kSteps);
}

/// Does a line leave the band along a row? NaN never asks for anything.
bool leavesBand(const float* low, const float* high, int count, float first, float slope) {
  int i = 0;
  for (; i + 4 <= count; i += 4) {
    const Float4 line = Float4::all(first) + Float4::all(slope) * placesFrom(static_cast<float>(i));
    if ((lanesAbove(Float4::load(low + i), line) | lanesAbove(line, Float4::load(high + i))) != 0)
      return true;
  }
  for (; i < count; ++i) {
    const float line = first + slope * static_cast<float>(i);
    if (low[i] > line || line > high[i]) return true;
  }
  return false;
}

/// Chooses the vertices of one level of a tile.
class VertexChooser {
 public:
  VertexChooser(const TileSamples& samples, const HeightBand& band, const MeshLevelRule& rule,
                std::vector<uint8_t>& bits)
      : h_(samples.heights.data()),
        states_(samples.states.data()),
        low_(band.low.data()),
        high_(band.high.data()),
        least_(band.leastMeters),
        along_(static_cast<float>(rule.alongSidesMeters)),
        sides_(rule.level, rule.borderSquare),
        bits_(bits) {}

  void run() {
    chooseAlongLegs();
    for (int level = kDeepestVertexLevel; level >= std::max(sides_.level, 1); --level)
      visitMeshLevel(level, [&](MeshPoint p, const MeshDiamond& d) { decide(p, level, d); });
    if (sides_.level == 0) {
      constexpr MeshPoint kCenter{kTileCells / 2, kTileCells / 2};
      decide(kCenter, 0, meshDiamondAt(kCenter, 0));
    }
  }

 private:
  uint8_t& bitsAt(MeshPoint p) { return bits_[static_cast<size_t>(p.index())]; }

  // ---- sides

  void chooseAlongLegs() {
    const int g = sides_.square;
    if (sides_.level % 2 == 0) {
      for (int y = 0; y <= kTileCells; y += g)
        for (int x = 0; x < kTileCells; x += g) chooseAlong({x, y}, {1, 0}, g);
      for (int y = 0; y < kTileCells; y += g)
        for (int x = 0; x <= kTileCells; x += g) chooseAlong({x, y}, {0, 1}, g);
      return;
    }
    // The halves of both diagonals of each square.
    for (int y = 0; y < kTileCells; y += g) {
      for (int x = 0; x < kTileCells; x += g) {
        chooseAlong({x, y}, {1, 1}, g / 2);
        chooseAlong({x + g / 2, y + g / 2}, {1, 1}, g / 2);
        chooseAlong({x + g, y}, {-1, 1}, g / 2);
        chooseAlong({x + g / 2, y + g / 2}, {-1, 1}, g / 2);
      }
    }
  }

  /// Halves a side until its chords are near enough to the samples along it. note: these may be void; their
  /// heights are as good as any and the same in both tiles at a border.
  void chooseAlong(MeshPoint from, MeshPoint step, int count) {
    if (count < 2) return;
    const int stride = step.y * kStride + step.x;
    const float* h = h_ + from.index();
    const float first = h[0];
    const float slope = (h[count * stride] - first) / static_cast<float>(count);
    const auto leaves = [&](int i) {
      // note: exactly means all that is coded, also what lies on the chord: triangles beside it may bend
      // there.
      if (along_ <= 0.0F) return states_[from.index() + i * stride] == SampleState::Coded;
      return std::abs(h[i * stride] - (first + slope * static_cast<float>(i))) > along_;
    };
    int i = 1;
    while (i < count && !leaves(i)) ++i;
    if (i == count) return;
    const int half = count / 2;
    const MeshPoint middle{from.x + half * step.x, from.y + half * step.y};
    bitsAt(middle) |= kMeshVertex;
    chooseAlong(from, step, half);
    chooseAlong(middle, step, half);
  }

  // ---- insides

  void decide(MeshPoint p, int level, const MeshDiamond& d) {
    uint8_t& bits = bitsAt(p);
    const float reach = reachOf(p, level, d);
    reach_[static_cast<size_t>(p.index())] = reach;
    if (bits == 0 && reach <= least_) return;
    if ((bits & kMeshVertex) == 0 && sides_.has(p)) {
      for (int side = 0; side < 2; ++side) {
        if (!d.apexes[side].isInTile()) continue;
        const auto extra = static_cast<uint8_t>(kMeshExtraFirst << side);
        if ((bits & extra) == 0 && !leaves(p, level, d, side, true)) continue;
        bits |= extra;
        activate(d.apexes[side], p, level - 1);
      }
      return;
    }
    if ((bits & kMeshVertex) == 0 && level >= kDeepestVertexLevel - 1) {
      if (!leavesMiddle(p, d)) return;
      bits |= kMeshVertex;
    } else if ((bits & kMeshVertex) == 0) {
      for (int side = 0; side < 2 && (bits & kMeshVertex) == 0; ++side)
        if (d.apexes[side].isInTile() && leaves(p, level, d, side, false)) bits |= kMeshVertex;
    }
    if ((bits & kMeshVertex) == 0) return;
    for (const MeshPoint apex : d.apexes)
      if (apex.isInTile()) activate(apex, p, level - 1);
  }

  /// A diamond one level up must split for the one at `child`.
  void activate(MeshPoint p, MeshPoint child, int level) {
    if (level < sides_.level) return;
    uint8_t& bits = bitsAt(p);
    if ((bits & kMeshVertex) != 0) return;
    if (sides_.has(p)) {
      bits |= static_cast<uint8_t>(kMeshExtraFirst << sideOf(meshDiamondAt(p, level), p, child));
    } else {
      bits |= kMeshVertex;
    }
  }

  /// As far as the triangles below reach, and what their middle moves by: a bound that spares looking.
  float reachOf(MeshPoint p, int level, const MeshDiamond& d) const {
    const float moved = std::abs(h(p) - 0.5F * (h(d.ends[0]) + h(d.ends[1])));
    if (level == kDeepestVertexLevel) return moved;
    const int s = meshHalfSize(level);
    const float* here = reach_.data() + p.index();
    float below = 0.0F;
    if (level % 2 == 0) {
      below = std::max(std::max(here[-s], here[s]), std::max(here[-s * kStride], here[s * kStride]));
    } else {
      const int half = s / 2;
      for (const int down : {-half, half})
        for (const int right : {-half, half})
          if (MeshPoint{p.x + right, p.y + down}.isInTile())
            below = std::max(below, here[down * kStride + right]);
    }
    return moved + below;
  }

  /// The same for the two smallest sizes: besides its middle a triangle only has corners and, in the middle
  /// of its legs, samples that were looked at before, with the same mean.
  bool leavesMiddle(MeshPoint p, const MeshDiamond& d) const {
    const float mean = 0.5F * (h(d.ends[0]) + h(d.ends[1]));
    const int at = p.index();
    return low_[at] > mean || mean > high_[at];
  }

  /// Does a measured sample in the diamond's triangle on one side leave its plane? `isGiven`: those on the
  /// hypotenuse do not count.
  bool leaves(MeshPoint p, int level, const MeshDiamond& d, int side, bool isGiven) const {
    const int s = meshHalfSize(level);
    if (isGiven && level >= kDeepestVertexLevel - 1) return false;  // nothing but the side itself
    if (level % 2 == 0) return leavesRightAngle(d, side, 2 * s, isGiven);
    if (d.ends[0].y == d.ends[1].y) return leavesHorizontal(p, d, side, s, isGiven);
    return leavesVertical(p, d, side, s, isGiven);
  }

  float h(MeshPoint p) const { return h_[p.index()]; }
  bool leavesRow(int y, int x, int count, float first, float slope) const {
    const int at = y * kStride + x;
    return leavesBand(low_ + at, high_ + at, count, first, slope);
  }

  /// Legs along the axes.
  bool leavesRightAngle(const MeshDiamond& d, int side, int leg, bool isGiven) const {
    const MeshPoint apex = d.apexes[side];
    // The end on the apex's row, and the other, on its column.
    const bool firstOnRow = d.ends[0].y == apex.y;
    const MeshPoint onRow = d.ends[firstOnRow ? 0 : 1];
    const MeshPoint onColumn = d.ends[firstOnRow ? 1 : 0];
    const float share = 1.0F / static_cast<float>(leg);
    const int down = onColumn.y > apex.y ? 1 : -1;
    const bool eastward = onRow.x > apex.x;
    const float alongRow = (h(onRow) - h(apex)) * share;
    const float alongColumn = (h(onColumn) - h(apex)) * share;
    for (int j = 0; j <= leg; ++j) {
      int count = leg - j + 1;
      if (isGiven) --count;
      if (count <= 0) break;
      // From west to east.
      const int y = apex.y + down * j;
      const int x = eastward ? apex.x : apex.x - count + 1;
      const float atApex = h(apex) + alongColumn * static_cast<float>(j);
      const float first = eastward ? atApex : atApex + alongRow * static_cast<float>(count - 1);
      const float slope = eastward ? alongRow : -alongRow;
      if (leavesRow(y, x, count, first, slope)) return true;
    }
    return false;
  }

  bool leavesHorizontal(MeshPoint p, const MeshDiamond& d, int side, int s, bool isGiven) const {
    const MeshPoint west = d.ends[0], east = d.ends[1], apex = d.apexes[side];
    const int down = apex.y > p.y ? 1 : -1;
    const float slope = (h(east) - h(west)) / static_cast<float>(2 * s);
    const float middle = 0.5F * (h(west) + h(east));
    const float across = (h(apex) - middle) / static_cast<float>(s);
    for (int j = isGiven ? 1 : 0; j <= s; ++j) {
      const int x = west.x + j;
      const float first = middle + across * static_cast<float>(j) - slope * static_cast<float>(s - j);
      if (leavesRow(p.y + down * j, x, 2 * (s - j) + 1, first, slope)) return true;
    }
    return false;
  }

  bool leavesVertical(MeshPoint p, const MeshDiamond& d, int side, int s, bool isGiven) const {
    const MeshPoint north = d.ends[0], south = d.ends[1], apex = d.apexes[side];
    const bool eastward = apex.x > p.x;
    const float down = (h(south) - h(north)) / static_cast<float>(2 * s);
    const float middle = 0.5F * (h(north) + h(south));
    const float outward = (h(apex) - middle) / static_cast<float>(s);
    for (int j = -s; j <= s; ++j) {
      int count = s - std::abs(j) + 1;
      if (isGiven) --count;
      if (count <= 0) continue;
      const float onSide = middle + down * static_cast<float>(j);
      const int skip = isGiven ? 1 : 0;
      const float nearest = onSide + outward * static_cast<float>(skip);
      const int x = eastward ? p.x + skip : p.x - skip - count + 1;
      const float first = eastward ? nearest : nearest + outward * static_cast<float>(count - 1);
      const float slope = eastward ? outward : -outward;
      if (leavesRow(p.y + j, x, count, first, slope)) return true;
    }
    return false;
  }

  const float* h_;
  const SampleState* states_;
  const float* low_;
  const float* high_;
  float least_;
  float along_;
  GivenSides sides_;
  /// How far, at most, the triangles of a diamond can be from the samples in them.
  std::vector<float> reach_ = std::vector<float>(kTileSampleCount);
  std::vector<uint8_t>& bits_;
};

}  // namespace

std::vector<uint8_t> measuredSamples(const TileSamples& samples, bool isFinest) {
  const auto isGround = [&](int x, int y) {
    return samples.states[static_cast<size_t>(y * kStride + x)] != SampleState::Void;
  };
  if (std::find(samples.states.begin(), samples.states.end(), SampleState::Void) == samples.states.end())
    return {};
  std::vector<uint8_t> out(kTileSampleCount, 1);
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      if (isGround(x, y)) continue;
      bool counts = false;
      for (int row = std::max(0, y - 1); !isFinest && row <= std::min(kTileCells, y + 1); ++row) {
        for (int col = std::max(0, x - 1); col <= std::min(kTileCells, x + 1); ++col) {
          const bool isCell = row <= y && col <= x && row < kTileCells && col < kTileCells;
          counts |= isGround(col, row) || (isCell && samples.coverage.covered(col, row));
        }
      }
      out[static_cast<size_t>(y * kStride + x)] = counts ? 1 : 0;
    }
  }
  return out;
}

std::vector<uint8_t> chooseMeshVertices(const TileSamples& samples, const HeightBand& band,
                                        std::span<const uint8_t> inherited, const MeshLevelRule& rule) {
  TERRANE_CHECK(samples.heights.size() == kTileSampleCount && band.low.size() == kTileSampleCount &&
                    band.high.size() == kTileSampleCount,
                "{}, {} and {} heights", samples.heights.size(), band.low.size(), band.high.size());
  TERRANE_CHECK(inherited.empty() || inherited.size() == kTileSampleCount, "{} bits", inherited.size());
  std::vector<uint8_t> out(kTileSampleCount, 0);
  for (size_t i = 0; i < inherited.size(); ++i) out[i] = inherited[i] & kMeshVertex;
  VertexChooser(samples, band, rule, out).run();
  return out;
}

std::vector<uint8_t> inheritedVertices(std::span<const uint8_t> parent, int quadrant) {
  std::vector<uint8_t> out(kTileSampleCount, 0);
  constexpr int kHalf = kTileCells / 2;
  const int left = (quadrant & 1) * kHalf, top = (quadrant >> 1) * kHalf;
  for (int y = 0; y <= kHalf; ++y)
    for (int x = 0; x <= kHalf; ++x)
      out[static_cast<size_t>(2 * y * kStride + 2 * x)] =
          parent[static_cast<size_t>((top + y) * kStride + left + x)] & kMeshVertex;
  return out;
}

std::vector<float> meshSurface(std::span<const float> heights, std::span<const uint8_t> vertices, int level,
                               bool centerFalls) {
  std::vector<float> out(heights.begin(), heights.end());
  const auto interpolate = [&](MeshPoint p, const MeshDiamond& d) {
    if ((vertices[static_cast<size_t>(p.index())] & kMeshVertex) != 0) return;
    out[static_cast<size_t>(p.index())] =
        (out[static_cast<size_t>(d.ends[0].index())] + out[static_cast<size_t>(d.ends[1].index())]) * 0.5F;
  };
  constexpr int kCenter = kTileCells / 2;
  if (level <= 0) interpolate({kCenter, kCenter}, quadDiamond({kCenter, kCenter}, kCenter, centerFalls));
  for (int each = std::max(level, 1); each <= kDeepestVertexLevel; ++each) visitMeshLevel(each, interpolate);
  return out;
}

}  // namespace terrane
