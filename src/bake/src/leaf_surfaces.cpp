#include "leaf_surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrane/base/check.h"
#include "terrane/base/float4.h"

namespace terrane {

namespace {

constexpr int kCells = TileBisection::kSquareCells;
constexpr int kSquares = TileBisection::kSquares;

/// Masks of the columns at or beyond t, and up to t, of a square's 16 western ones, for t in [0, 16].
struct ColumnMasks {
  std::array<std::array<uint32_t, kCells>, kCells + 1> from{};
  std::array<std::array<uint32_t, kCells>, kCells + 1> upTo{};
  ColumnMasks() {
    for (size_t t = 0; t <= kCells; ++t) {
      for (size_t x = 0; x < kCells; ++x) {
        from[t][x] = x >= t ? ~0U : 0U;
        upTo[t][x] = x <= t ? ~0U : 0U;
      }
    }
  }
};
const ColumnMasks kMasks;

TileBisection makeBisection(int parity) {
  // A lattice one level deeper than the root has a tile of either parity in its northern row.
  const Lattice lattice(1);
  const int originX = parity * kTileCells;
  const Diamond middle{originX + kTileCells / 2, kTileCells / 2, 2};
  std::vector<Triangle> triangles;
  for (const LatticePoint& apex : lattice.apexes(middle)) triangles.push_back({middle, apex});

  TileBisection out;
  for (int depth = 0; depth <= TileBisection::kDepth; ++depth) {
    auto& centers = out.centers[static_cast<size_t>(depth)];
    auto& apexes = out.apexes[static_cast<size_t>(depth)];
    for (const Triangle& t : triangles) {
      centers.push_back({t.diamond.x - originX, t.diamond.y});
      apexes.push_back({t.apex.x - originX, t.apex.y});
    }
    if (depth == TileBisection::kDepth) break;

    // Each triangle's halves have its hypotenuse's middle as apex and its legs' middles as centres.
    std::vector<Triangle> halves;
    for (const Triangle& t : triangles) {
      for (const LatticePoint& end : lattice.hypotenuse(t.diamond)) {
        halves.push_back(
            {{(t.apex.x + end.x) / 2, (t.apex.y + end.y) / 2, t.diamond.level + 1}, t.diamond.center()});
      }
    }
    triangles = std::move(halves);
  }

  for (size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    const int col = (t.diamond.x - originX) / kCells;
    const int row = t.diamond.y / kCells;
    out.atoms[i] = {row * kSquares + col, t.apex.x > t.diamond.x};
  }
  return out;
}

}  // namespace

const TileBisection& TileBisection::of(TileId id) {
  static const std::array<TileBisection, 2> both = {makeBisection(0), makeBisection(1)};
  return both[static_cast<size_t>((id.col + id.row) & 1)];
}

void AtomMaximum::begin() {
  west_.fill(floor_);
  east_.fill(floor_);
  westLast_.fill(floor_);
  eastLast_.fill(floor_);
}

void AtomMaximum::addRow(int y, const float* values) {
  // A row between two bands of squares belongs to both.
  const int band = y / kCells;
  if (y % kCells == 0 && band > 0) addToBand(band - 1, kCells, values);
  if (band < kSquares) addToBand(band, y % kCells, values);
}

void AtomMaximum::addToBand(int band, int row, const float* values) {
  const Float4 floor = Float4::all(floor_);
  for (int col = 0; col < kSquares; ++col) {
    // The diagonal meets this row at column t; the eastern half lies from there on, the western up to there.
    const bool falls = ((col + band) & 1) == 0;
    const auto t = static_cast<size_t>(falls ? row : kCells - row);
    const uint32_t* from = kMasks.from[t].data();
    const uint32_t* upTo = kMasks.upTo[t].data();
    const auto square = static_cast<size_t>(band * kSquares + col);
    float* west = west_.data() + square * kCells;
    float* east = east_.data() + square * kCells;
    const float* in = values + col * kCells;
    for (size_t lane = 0; lane < kCells; lane += 4) {
      const Float4 value = Float4::load(in + lane);
      larger(choose(from + lane, value, floor), Float4::load(east + lane)).store(east + lane);
      larger(choose(upTo + lane, value, floor), Float4::load(west + lane)).store(west + lane);
    }
    const float last = in[kCells];
    if (last > eastLast_[square]) eastLast_[square] = last;
    if (t == kCells && last > westLast_[square]) westLast_[square] = last;
  }
}

void AtomMaximum::finish(const TileBisection& bisection, AtomValues& out) const {
  const auto largestOf = [&](const std::array<float, 256 * 16>& lanes, size_t square, float best) {
    const float* begin = lanes.data() + square * kCells;
    return std::max(best, *std::max_element(begin, begin + kCells));
  };
  for (size_t i = 0; i < out.size(); ++i) {
    const auto square = static_cast<size_t>(bisection.atoms[i].square);
    out[i] = bisection.atoms[i].east ? largestOf(east_, square, eastLast_[square])
                                     : largestOf(west_, square, westLast_[square]);
  }
}

void doubleRow(const float* north, const float* south, int cells, int parity, float* even, float* odd) {
  // Where the hypotenuse falls to the south-east, cell by cell in turn.
  alignas(16) static constexpr uint32_t kFalls[2][4] = {{~0U, 0U, ~0U, 0U}, {0U, ~0U, 0U, ~0U}};
  const uint32_t* falls = kFalls[parity];
  const Float4 half = Float4::all(0.5F);
  for (int i = 0; i <= cells; i += 4) {
    const Float4 northWest = Float4::load(north + i);
    const Float4 northEast = Float4::load(north + i + 1);
    const Float4 southWest = Float4::load(south + i);
    const Float4 southEast = Float4::load(south + i + 1);
    storeInterleaved(northWest, (northWest + northEast) * half, even + 2 * i);
    const Float4 center = choose(falls, northWest + southEast, northEast + southWest) * half;
    storeInterleaved((northWest + southWest) * half, center, odd + 2 * i);
  }
}

LeafSurfaces::LeafSurfaces()
    : coarse_(static_cast<size_t>(kStride) * (kTileSamples + 1)),
      fine_(static_cast<size_t>(kStride) * (kTileSamples + 1)),
      differences_(2 * kStride),
      maximum_(0.0F) {}

void LeafSurfaces::setTile(TileId id, const std::vector<float>& heights, const std::vector<float>& ground) {
  id_ = id;
  heights_ = heights.data();
  ground_ = ground.data();
}

void LeafSurfaces::range(AtomValues& low, AtomValues& high) {
  const TileBisection& bisection = TileBisection::of(id_);
  AtomMaximum highest(-std::numeric_limits<float>::infinity());
  AtomMaximum deepest(-std::numeric_limits<float>::infinity());
  highest.begin();
  deepest.begin();
  for (int y = 0; y < kTileSamples; ++y) {
    const float* row = ground_ + y * kTileSamples;
    highest.addRow(y, row);
    for (int x = 0; x < kTileSamples; ++x) differences_[static_cast<size_t>(x)] = -row[x];
    deepest.addRow(y, differences_.data());
  }
  highest.finish(bisection, high);
  deepest.finish(bisection, low);
  for (float& value : low) value = -value;
}

int LeafSurfaces::takeLattice(int cellShift, bool quincunx, const std::array<float, 4>& corners) {
  TERRANE_CHECK(cellShift >= 0 && cellShift <= 8, "{}", cellShift);
  const int cells = kTileCells >> cellShift;
  float* coarse = coarse_.data();
  if (needsCorners(cellShift)) {
    coarse[0] = corners[0];
    coarse[1] = corners[1];
    coarse[kStride] = corners[2];
    coarse[kStride + 1] = corners[3];
    return cells;
  }
  for (int y = 0; y <= cells; ++y) {
    const float* from = heights_ + (y << cellShift) * kTileSamples;
    for (int x = 0; x <= cells; ++x) coarse[y * kStride + x] = from[x << cellShift];
  }
  if (!quincunx) return cells;
  for (int y = 0; y <= cells; ++y) {
    float* row = coarse + y * kStride;
    const int step = y % 2 == 0 ? 1 : kStride;
    for (int x = 1 - y % 2; x <= cells; x += 2) row[x] = (row[x - step] + row[x + step]) * 0.5F;
  }
  return cells;
}

void LeafSurfaces::doubleTo(int wanted, int& cells) {
  for (; cells < wanted; cells *= 2) {
    const float* coarse = coarse_.data();
    float* fine = fine_.data();
    const int parity = parityOf(cells);
    for (int y = 0; y < cells; ++y) {
      doubleRow(coarse + y * kStride, coarse + (y + 1) * kStride, cells, (parity + y) & 1,
                fine + 2 * y * kStride, fine + (2 * y + 1) * kStride);
    }
    // note: the last row has nothing south of it; what comes between is not used.
    doubleRow(coarse + cells * kStride, coarse + cells * kStride, cells, 0, fine + 2 * cells * kStride,
              fine + (2 * cells + 1) * kStride);
    std::swap(coarse_, fine_);
  }
}

void LeafSurfaces::atSquareCorners(int cellShift, bool quincunx, const std::array<float, 4>& corners,
                                   SquareCorners& out) {
  TERRANE_CHECK(cellShift >= kLinearShift, "{}", cellShift);
  int cells = takeLattice(cellShift, quincunx, corners);
  doubleTo(kSquares, cells);
  for (size_t y = 0; y <= kSquares; ++y)
    std::copy_n(coarse_.data() + y * kStride, kSquares + 1, out.data() + y * (kSquares + 1));
}

float LeafSurfaces::compareAtom(const TileBisection::Atom& atom, const SquareCorners& surface) const {
  const int col = atom.square % kSquares;
  const int row = atom.square / kSquares;
  const float* corner = surface.data() + row * (kSquares + 1) + col;
  const float nw = corner[0];
  const float ne = corner[1];
  const float sw = corner[kSquares + 1];
  const float se = corner[kSquares + 2];

  // The plane through the atom's three corners; two of them lie on its long side to the west or east, two on
  // its side to the north or south.
  constexpr float kPerCell = 1.0F / kCells;
  const bool falls = ((col + row) & 1) == 0;
  const bool north = falls == atom.east;
  const float gx = (north ? ne - nw : se - sw) * kPerCell;
  const float gy = (atom.east ? se - ne : sw - nw) * kPerCell;
  const bool hasNorthWest = falls || !atom.east;
  const float origin = hasNorthWest ? nw : se - (gx + gy) * static_cast<float>(kCells);

  float largest = 0.0F;
  const float* ground = ground_ + row * kCells * kTileSamples + col * kCells;
  for (int y = 0; y <= kCells; ++y) {
    const int t = falls ? y : kCells - y;
    const float base = origin + static_cast<float>(y) * gy;
    const float* values = ground + y * kTileSamples;
    const int end = atom.east ? kCells : t;
    for (int x = atom.east ? t : 0; x <= end; ++x) {
      const float difference = std::abs(values[x] - (base + static_cast<float>(x) * gx));
      if (difference > largest) largest = difference;
    }
  }
  return largest;
}

void LeafSurfaces::compare(int cellShift, bool quincunx, const std::array<float, 4>& corners,
                           AtomValues& out) {
  int cells = takeLattice(cellShift, quincunx, corners);
  if (cells < kTileCells) doubleTo(kTileCells / 2, cells);
  const float* coarse = coarse_.data();
  const int parity = parityOf(cells);

  // The last step is compared row by row while it is made.
  maximum_.begin();
  std::array<float, kStride> even;
  std::array<float, kStride + 8> odd;
  std::array<float, kStride> difference;
  const auto compareRow = [&](int y, const float* surface) {
    const float* ground = ground_ + y * kTileSamples;
    for (int x = 0; x + 4 <= kTileSamples; x += 4) {
      absolute(Float4::load(ground + x) - Float4::load(surface + x)).store(difference.data() + x);
    }
    difference[kTileCells] = std::abs(ground[kTileCells] - surface[kTileCells]);
    maximum_.addRow(y, difference.data());
  };
  if (cells == kTileCells) {
    for (int y = 0; y < kTileSamples; ++y) compareRow(y, coarse + y * kStride);
  } else {
    for (int y = 0; y <= cells; ++y) {
      const float* north = coarse + y * kStride;
      doubleRow(north, y < cells ? north + kStride : north, cells, (parity + y) & 1, even.data(), odd.data());
      compareRow(2 * y, even.data());
      if (y < cells) compareRow(2 * y + 1, odd.data());
    }
  }
  maximum_.finish(TileBisection::of(id_), out);
}

}  // namespace terrane
