#include "terrane/codec/patch_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh_lattice.h"
#include "terrane/base/check.h"

namespace terrane {

namespace {

using MeshTriangle = std::array<uint16_t, 3>;
constexpr uint16_t kNoNumber = 0xffff;

MeshPoint pointOf(std::array<int, 2> p) {
  return {p[0], p[1]};
}
MeshPoint pointOf(const PatchVertex& v) {
  return {v.x(), v.y()};
}
MeshPoint middleOf(MeshPoint a, MeshPoint b) {
  return {(a.x + b.x) / 2, (a.y + b.y) / 2};
}

/// Which samples are vertices of the patch at hand, and their numbers. Work space of a thread.
struct PatchScratch {
  enum : uint8_t { kNo = 0, kYes = 1, kExtra = 2 };
  std::vector<uint8_t> kinds = std::vector<uint8_t>(kTileSampleCount, kNo);
  std::vector<uint16_t> numbers = std::vector<uint16_t>(kTileSampleCount, kNoNumber);
  std::vector<uint16_t> extras;
  std::vector<uint8_t> isExtra;
  std::vector<uint16_t> moved;
  std::vector<MeshTriangle> loose;
  std::vector<std::array<uint16_t, 2>> edges;
  std::vector<uint16_t> polygon;
  std::vector<MeshPoint> wanted;
};
PatchScratch& scratchOfThread() {
  thread_local PatchScratch scratch;
  return scratch;
}

/// Makes one patch's mesh.
class PatchMesher {
 public:
  PatchMesher(const PatchCorners& corners, int level, std::span<const uint8_t> vertices,
              std::span<const float> heights, std::span<const float> coarse, const HeightBand& band,
              PatchMesh& out)
      : level_(level),
        chosen_(vertices),
        heights_(heights),
        coarse_(coarse),
        band_(band),
        scratch_(scratchOfThread()),
        out_(out) {
    corners_[0] = pointOf(corners.ends[0]);
    corners_[1] = pointOf(corners.ends[1]);
    corners_[2] = pointOf(corners.apex);
    if (doubleArea(corners_[0], corners_[1], corners_[2]) < 0) std::swap(corners_[0], corners_[1]);
    top_ = std::min({corners_[0].y, corners_[1].y, corners_[2].y});
    bottom_ = std::max({corners_[0].y, corners_[1].y, corners_[2].y});
  }

  void run() {
    takeVertices();
    do {
      out_.excessMeters = out_.startExcessMeters = 0.0;
      listVertices();
      listTriangles();
      scratch_.wanted.clear();
      if (!scratch_.extras.empty()) replaceExtras();
      for (const MeshPoint p : scratch_.wanted) addVertex(p);
    } while (!scratch_.wanted.empty());
    measureSides();
    forget();
  }

 private:
  uint8_t& kindAt(MeshPoint p) { return scratch_.kinds[static_cast<size_t>(p.index())]; }
  uint16_t& numberAt(MeshPoint p) { return scratch_.numbers[static_cast<size_t>(p.index())]; }
  MeshPoint place(uint16_t number) const { return pointOf(out_.vertices[number]); }

  bool isInPatch(MeshPoint p) const {
    return doubleArea(corners_[0], corners_[1], p) >= 0 && doubleArea(corners_[1], corners_[2], p) >= 0 &&
           doubleArea(corners_[2], corners_[0], p) >= 0;
  }
  bool isOnSide(MeshPoint p) const {
    return doubleArea(corners_[0], corners_[1], p) == 0 || doubleArea(corners_[1], corners_[2], p) == 0 ||
           doubleArea(corners_[2], corners_[0], p) == 0;
  }

  template <class Visit>
  void visitSamples(Visit&& visit) {
    for (int y = top_; y <= bottom_; ++y) {
      const RowSpan row = rowOf(corners_, y);
      for (int x = row.first; x <= row.last; ++x) visit(MeshPoint{x, y});
    }
  }

  // ---- vertices

  void takeVertices() {
    visitSamples([&](MeshPoint p) {
      const uint8_t bits = chosen_[static_cast<size_t>(p.index())];
      if (bits == 0) return;
      if ((bits & kMeshVertex) != 0) {
        kindAt(p) = PatchScratch::kYes;
        return;
      }
      // Needed by the patch on this side of it?
      const MeshDiamond d = meshDiamondAt(p, vertexLevel(p));
      for (int side = 0; side < 2; ++side)
        if ((bits & kMeshExtraFirst << side) != 0 && isInPatch(d.apexes[side]))
          kindAt(p) = PatchScratch::kExtra;
    });
    for (const MeshPoint corner : corners_) kindAt(corner) = PatchScratch::kYes;
  }

  /// Adds a vertex and the ancestors that must split before it.
  void addVertex(MeshPoint p) {
    if (kindAt(p) != PatchScratch::kNo) return;
    kindAt(p) = isOnSide(p) ? PatchScratch::kExtra : PatchScratch::kYes;
    out_.hasMore = true;
    const int level = vertexLevel(p);
    if (level <= level_) return;
    const MeshDiamond d = meshDiamondAt(p, level);
    for (const MeshPoint apex : d.apexes)
      if (isInPatch(apex)) addVertex(apex);
  }

  void listVertices() {
    out_.vertices.clear();
    scratch_.extras.clear();
    visitSamples([&](MeshPoint p) {
      const uint8_t kind = kindAt(p);
      if (kind == PatchScratch::kNo) return;
      const auto number = static_cast<uint16_t>(out_.vertices.size());
      numberAt(p) = number;
      if (kind == PatchScratch::kExtra) scratch_.extras.push_back(number);
      const auto at = static_cast<size_t>(p.index());
      out_.vertices.push_back(
          {static_cast<uint32_t>(p.x) | static_cast<uint32_t>(p.y) << 9, heights_[at], coarse_[at]});
    });
  }

  // ---- triangles of bisection

  void listTriangles() {
    out_.indices.clear();
    scratch_.loose.clear();
    bisect();
    out_.bisected = out_.triangles();
  }
  void bisect() {
    if (kindAt(middleOf(corners_[0], corners_[1])) == PatchScratch::kNo) {
      add(corners_[0], corners_[1], corners_[2]);
      return;
    }
    for (const PatchVertex& v : out_.vertices) {
      const MeshPoint p = pointOf(v);
      const int level = vertexLevel(p);
      // What is coarser is a corner, and was split before.
      if (level < level_) continue;
      const int s = meshHalfSize(level);
      const bool isQuad = level % 2 == 0;
      const bool onSide = isOnSide(p);
      const MeshPoint ring[4] = {isQuad ? MeshPoint{p.x - s, p.y - s} : MeshPoint{p.x, p.y - s},
                                 isQuad ? MeshPoint{p.x + s, p.y - s} : MeshPoint{p.x + s, p.y},
                                 isQuad ? MeshPoint{p.x + s, p.y + s} : MeshPoint{p.x, p.y + s},
                                 isQuad ? MeshPoint{p.x - s, p.y + s} : MeshPoint{p.x - s, p.y}};
      for (int i = 0; i < 4; ++i) {
        const MeshPoint a = ring[i], b = ring[(i + 1) % 4];
        if (onSide && (!isInPatch(a) || !isInPatch(b))) continue;
        if (level < kDeepestVertexLevel && kindAt(middleOf(a, b)) != PatchScratch::kNo) continue;
        add(a, b, p);
      }
    }
  }
  void add(MeshPoint a, MeshPoint b, MeshPoint c) {
    const MeshTriangle t{numberAt(a), numberAt(b), numberAt(c)};
    if (kindAt(a) == PatchScratch::kExtra || kindAt(b) == PatchScratch::kExtra ||
        kindAt(c) == PatchScratch::kExtra)
      scratch_.loose.push_back(t);
    else
      add(t);
  }
  void add(const MeshTriangle& t) { out_.indices.insert(out_.indices.end(), t.begin(), t.end()); }

  // ---- extra vertices

  /// Takes each extra vertex out of the triangles around it, finest first, and adds what is left of them.
  void replaceExtras() {
    std::vector<uint16_t>& extras = scratch_.extras;
    std::stable_sort(extras.begin(), extras.end(),
                     [&](uint16_t a, uint16_t b) { return vertexLevel(place(a)) > vertexLevel(place(b)); });
    for (const uint16_t extra : extras) removeVertex(extra);
    for (const MeshTriangle& t : scratch_.loose) {
      add(t);
      const Excess excess = excessIn(t, &PatchVertex::heightMeters);
      if (excess.meters > 0.0 && excess.hasRemedy) scratch_.wanted.push_back(excess.remedy);
      out_.excessMeters = std::max(out_.excessMeters, excess.meters);
      out_.startExcessMeters =
          std::max(out_.startExcessMeters, excessIn(t, &PatchVertex::coarseMeters).meters);
    }
    if (scratch_.wanted.empty()) dropExtras();
  }

  /// A vertex in the middle of a straight side: the polygon that its triangles make is cut anew.
  void removeVertex(uint16_t vertex) {
    auto& edges = scratch_.edges;
    auto& loose = scratch_.loose;
    auto& polygon = scratch_.polygon;
    edges.clear();
    for (size_t i = 0; i < loose.size();) {
      const MeshTriangle t = loose[i];
      const auto at = static_cast<size_t>(std::find(t.begin(), t.end(), vertex) - t.begin());
      if (at == 3) {
        ++i;
        continue;
      }
      edges.push_back({t[(at + 1) % 3], t[(at + 2) % 3]});
      loose[i] = loose.back();
      loose.pop_back();
    }
    // Their far edges make a chain from one neighbour on the side to the other.
    const auto isEnd = [&](uint16_t number) {
      return std::any_of(edges.begin(), edges.end(), [&](const auto& e) { return e[1] == number; });
    };
    const auto first = std::find_if(edges.begin(), edges.end(), [&](const auto& e) { return !isEnd(e[0]); });
    TERRANE_CHECK(first != edges.end(), "vertex {} is not on a side", vertex);
    polygon.assign(1, (*first)[0]);
    while (polygon.size() <= edges.size()) {
      const auto edge =
          std::find_if(edges.begin(), edges.end(), [&](const auto& e) { return e[0] == polygon.back(); });
      TERRANE_CHECK(edge != edges.end(), "the triangles around vertex {} make no chain", vertex);
      polygon.push_back((*edge)[1]);
    }
    while (polygon.size() > 3) cutEar();
    loose.push_back({polygon[0], polygon[1], polygon[2]});
  }

  /// Cuts the ear off the polygon that keeps best to the band.
  void cutEar() {
    std::vector<uint16_t>& polygon = scratch_.polygon;
    const size_t n = polygon.size();
    size_t best = n;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < n; ++i) {
      const MeshTriangle ear{polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]};
      if (!isEar(ear)) continue;
      const double excess = excessIn(ear, &PatchVertex::heightMeters).meters;
      if (best < n && excess >= least) continue;
      best = i;
      least = excess;
    }
    TERRANE_CHECK(best < n, "a polygon of {} corners has no ear", n);
    scratch_.loose.push_back({polygon[(best + n - 1) % n], polygon[best], polygon[(best + 1) % n]});
    polygon.erase(polygon.begin() + static_cast<ptrdiff_t>(best));
  }

  bool isEar(const MeshTriangle& ear) const {
    const MeshPoint a = place(ear[0]), b = place(ear[1]), c = place(ear[2]);
    if (doubleArea(a, b, c) <= 0) return false;
    return std::none_of(scratch_.polygon.begin(), scratch_.polygon.end(), [&](uint16_t other) {
      if (other == ear[0] || other == ear[1] || other == ear[2]) return false;
      const MeshPoint p = place(other);
      return doubleArea(a, b, p) >= 0 && doubleArea(b, c, p) >= 0 && doubleArea(c, a, p) >= 0;
    });
  }

  double excessAt(int index, double height) const {
    const auto at = static_cast<size_t>(index);
    // note: NaN is no excess.
    return std::max(0.0, std::max(static_cast<double>(band_.low[at]) - height,
                                  height - static_cast<double>(band_.high[at])));
  }

  /// By how much a triangle leaves the band, negative within, and which sample would remedy it.
  struct Excess {
    double meters = -std::numeric_limits<double>::infinity();
    bool hasRemedy = false;
    MeshPoint remedy;
  };
  /// Height = base + perColumn * x + perRow * y.
  struct Plane {
    double base = 0.0;
    double perColumn = 0.0;
    double perRow = 0.0;
    double at(double x, double y) const { return base + perColumn * x + perRow * y; }
  };
  using Height = float PatchVertex::*;
  Plane planeOf(const MeshTriangle& t, const MeshPoint (&corners)[3], Height of) const {
    const auto area = static_cast<double>(doubleArea(corners[0], corners[1], corners[2]));
    Plane out;
    for (int i = 0; i < 3; ++i) {
      const MeshPoint p = corners[(i + 1) % 3], q = corners[(i + 2) % 3];
      const double height = static_cast<double>(out_.vertices[t[static_cast<size_t>(i)]].*of) / area;
      out.perColumn += height * (p.y - q.y);
      out.perRow += height * (q.x - p.x);
    }
    out.base = static_cast<double>(out_.vertices[t[0]].*of) - out.perColumn * corners[0].x -
               out.perRow * corners[0].y;
    return out;
  }

  /// note: these triangles are no halves of coarser ones, so where their sides cross those of the finest
  /// triangles counts as well as the samples in them.
  Excess excessIn(const MeshTriangle& t, Height of) const {
    const MeshPoint corners[3] = {place(t[0]), place(t[1]), place(t[2])};
    const Plane plane = planeOf(t, corners, of);
    Excess out;
    const int top = std::min({corners[0].y, corners[1].y, corners[2].y});
    const int bottom = std::max({corners[0].y, corners[1].y, corners[2].y});
    for (int y = top; y <= bottom; ++y) {
      const RowSpan row = rowOf(corners, y);
      for (int x = row.first; x <= row.last; ++x) {
        const MeshPoint p{x, y};
        if (isOnSide(p) || p == corners[0] || p == corners[1] || p == corners[2]) continue;
        meet(plane.at(x, y), p, p, 0.0, out);
      }
    }
    for (int i = 0; i < 3; ++i) crossFinest(corners[i], corners[(i + 1) % 3], plane, out);
    return out;
  }

  /// Where a triangle's side crosses the lines along which the finest triangles meet: columns, rows, and
  /// diagonals through the samples with an even sum of coordinates.
  void crossFinest(MeshPoint p, MeshPoint q, const Plane& plane, Excess& out) const {
    const int dx = q.x - p.x, dy = q.y - p.y;
    const auto crossLines = [&](int from, int to, int step, MeshPoint along) {
      const int low = std::min(from, to), high = std::max(from, to);
      for (int value = (low / step + 1) * step; value < high; value += step) {
        const double share = static_cast<double>(value - from) / (to - from);
        const double x = p.x + share * dx, y = p.y + share * dy;
        // The two samples on the line between which it is crossed.
        const int first = along.x != 0 ? static_cast<int>(std::floor(x)) : static_cast<int>(std::floor(y));
        const double between = (along.x != 0 ? x : y) - first;
        MeshPoint a;
        if (along.x == 0) {
          a = {value, first};
        } else if (along.y == 0) {
          a = {first, value};
        } else {
          a = {first, along.y > 0 ? first - (value - kTileCells) : value - first};
        }
        meet(plane.at(x, y), a, {a.x + along.x, a.y + along.y}, between, out);
      }
    };
    if (dx != 0) crossLines(p.x, q.x, 1, {0, 1});
    if (dy != 0) crossLines(p.y, q.y, 1, {1, 0});
    if (dx != dy) crossLines(p.x - p.y + kTileCells, q.x - q.y + kTileCells, 2, {1, 1});
    if (dx != -dy) crossLines(p.x + p.y, q.x + q.y, 2, {1, -1});
  }

  /// A height between two samples, or at one.
  void meet(double height, MeshPoint a, MeshPoint b, double between, Excess& out) const {
    if (between > 0.0 && !b.isInTile()) return;
    const auto first = static_cast<size_t>(a.index());
    double low = band_.low[first], high = band_.high[first];
    if (between > 0.0) {
      const auto second = static_cast<size_t>(b.index());
      low += between * (static_cast<double>(band_.low[second]) - low);
      high += between * (static_cast<double>(band_.high[second]) - high);
    }
    const double off = std::max(low - height, height - high);
    if (!(off > out.meters)) return;
    out.meters = off;
    out.hasRemedy = true;
    if (canBeAdded(a) && (between <= 0.5 || !canBeAdded(b)))
      out.remedy = a;
    else if (canBeAdded(b))
      out.remedy = b;
    else
      out.hasRemedy = false;
  }
  bool canBeAdded(MeshPoint p) const {
    return p.isInTile() && scratch_.kinds[static_cast<size_t>(p.index())] == PatchScratch::kNo &&
           isInPatch(p) && !isOnSide(p);
  }

  /// Vertices that no triangle has any more go, and the others move up.
  void dropExtras() {
    std::vector<PatchVertex>& vertices = out_.vertices;
    scratch_.isExtra.assign(vertices.size(), 0);
    for (const uint16_t extra : scratch_.extras) scratch_.isExtra[extra] = 1;
    scratch_.moved.resize(vertices.size());
    uint16_t kept = 0;
    for (size_t i = 0; i < vertices.size(); ++i) {
      scratch_.moved[i] = kept;
      if (scratch_.isExtra[i] == 0) {
        vertices[kept++] = vertices[i];
      } else {
        out_.extras.push_back(vertices[i].place);
      }
    }
    vertices.resize(kept);
    for (uint16_t& index : out_.indices) index = scratch_.moved[index];
  }

  /// What the given vertices of the sides get wrong along them.
  void measureSides() {
    for (size_t i = 0; i < 3; ++i) {
      const MeshPoint from = corners_[i], to = corners_[(i + 1) % 3];
      const int count = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
      const MeshPoint step{(to.x - from.x) / count, (to.y - from.y) / count};
      const int stride = step.y * kTileSamples + step.x;
      for (int begin = 0; begin < count;) {
        int end = begin + 1;
        while (scratch_.kinds[static_cast<size_t>(from.index() + end * stride)] != PatchScratch::kYes) ++end;
        const double first = heights_[static_cast<size_t>(from.index() + begin * stride)];
        const double last = heights_[static_cast<size_t>(from.index() + end * stride)];
        for (int j = begin + 1; j < end; ++j) {
          const double height = first + (last - first) * (j - begin) / (end - begin);
          out_.excessMeters = std::max(out_.excessMeters, excessAt(from.index() + j * stride, height));
        }
        begin = end;
      }
    }
  }

  void forget() {
    visitSamples([&](MeshPoint p) { kindAt(p) = PatchScratch::kNo; });
  }

  int level_;
  MeshPoint corners_[3];  ///< ends of the hypotenuse, apex; from x towards y
  int top_ = 0;
  int bottom_ = 0;
  std::span<const uint8_t> chosen_;
  std::span<const float> heights_;
  std::span<const float> coarse_;
  const HeightBand& band_;
  PatchScratch& scratch_;
  PatchMesh& out_;
};

}  // namespace

int patchCount(int level) {
  const int side = 1 << level / 2;
  return side * side * (level % 2 == 0 ? 2 : 4);
}

PatchCorners patchCorners(int level, int index, bool centerFalls) {
  const int square = meshSquare(level);
  const int each = level % 2 == 0 ? 2 : 4;
  const int side = kTileCells / square;
  const int left = index / each % side * square, top = index / each / side * square;
  const int right = left + square, bottom = top + square;
  const int which = index % each;
  if (level % 2 == 0) {
    const bool falls = level == 0 ? centerFalls : ((left / square + top / square) & 1) == 0;
    if (falls)
      return {{{{left, top}, {right, bottom}}}, {which == 0 ? right : left, which == 0 ? top : bottom}};
    return {{{{right, top}, {left, bottom}}}, {which == 0 ? left : right, which == 0 ? top : bottom}};
  }
  const std::array<int, 2> middle{left + square / 2, top + square / 2};
  switch (which) {
    case 0:
      return {{{{left, top}, {right, top}}}, middle};
    case 1:
      return {{{{right, top}, {right, bottom}}}, middle};
    case 2:
      return {{{{right, bottom}, {left, bottom}}}, middle};
    default:
      return {{{{left, bottom}, {left, top}}}, middle};
  }
}

int patchIndex(int level, std::array<int, 2> middle, std::array<int, 2> apex) {
  const int square = meshSquare(level);
  const int side = kTileCells / square;
  // Between hypotenuse and apex one is inside of the square.
  const int col = (middle[0] + apex[0]) / (2 * square), row = (middle[1] + apex[1]) / (2 * square);
  const int first = row * side + col;
  if (level % 2 == 0) return 2 * first + (apex[1] < middle[1] ? 0 : 1);
  const int dx = middle[0] - apex[0], dy = middle[1] - apex[1];
  return 4 * first + (dy < 0 ? 0 : dx > 0 ? 1 : dy > 0 ? 2 : 3);
}

PatchMesh makePatchMesh(const PatchCorners& corners, int level, std::span<const uint8_t> vertices,
                        std::span<const float> heights, std::span<const float> coarse,
                        const HeightBand& band) {
  PatchMesh out;
  PatchMesher(corners, level, vertices, heights, coarse, band, out).run();
  return out;
}

}  // namespace terrane
