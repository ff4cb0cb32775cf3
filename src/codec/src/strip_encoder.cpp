#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "quadtree_mesh.h"
#include "strip_heights.h"
#include "strip_path.h"
#include "terrane/base/check.h"
#include "terrane/codec/strip_mesh.h"

namespace terrane {

namespace {

struct Sample {
  int x;
  int y;
};

/// Writes a tile's path: the triangles in the order in which they come.
class StripWriter {
 public:
  StripWriter(const StripHeights& heights, const std::vector<uint8_t>& isSplit, int side, StripMesh& mesh)
      : heights_(heights), isSplit_(isSplit), side_(side), mesh_(mesh) {}

  /// A_L A_L A_L A_L: once around the middle, against the clock, beginning in the north-west.
  void run() {
    const int last = side_ - 1;
    const Sample middle{last / 2, last / 2};
    const std::array<Sample, 5> corners = {{{0, 0}, {0, last}, {last, last}, {last, 0}, {0, 0}}};
    for (size_t i = 0; i < 4; ++i) visit(StripType::A, false, middle, corners[i], corners[i + 1]);
    putBits(static_cast<uint32_t>(StripType::End), 2 + mesh_.heightBits);
    mesh_.entries.push_back(static_cast<uint32_t>(held_));
    if (heldBits_ > 0) mesh_.entries.push_back(0);
  }

 private:
  size_t indexOf(Sample p) const { return static_cast<size_t>(p.y) * static_cast<size_t>(side_) + p.x; }

  /// Is the hypotenuse from a to b split, and where?
  bool splitBetween(Sample a, Sample b, Sample& midpoint) const {
    if (((a.x + b.x) & 1) != 0 || ((a.y + b.y) & 1) != 0) return false;
    midpoint = {(a.x + b.x) / 2, (a.y + b.y) / 2};
    return isSplit_[indexOf(midpoint)] != 0;
  }

  /// The path through a triangle that is entered from v1 (left) to v2 (right): itself, or what replaces it.
  void visit(StripType type, bool right, Sample v1, Sample v2, Sample v3) {
    Sample m{};
    switch (type) {
      case StripType::A:
        if (!splitBetween(right ? v1 : v2, v3, m)) break;
        visit(StripType::C, right, v1, v2, m);
        return right ? visit(StripType::B, right, m, v2, v3) : visit(StripType::B, right, v1, m, v3);
      case StripType::B:
        if (!splitBetween(right ? v2 : v1, v3, m)) break;
        visit(StripType::C, !right, v1, v2, m);
        return right ? visit(StripType::A, right, v1, m, v3) : visit(StripType::A, right, m, v2, v3);
      default:
        if (!splitBetween(v1, v2, m)) break;
        if (right) {
          visit(StripType::A, right, v1, m, v3);
          return visit(StripType::B, !right, v3, m, v2);
        }
        visit(StripType::A, right, m, v2, v3);
        return visit(StripType::B, !right, m, v3, v1);
    }
    putTriangle(type, right, v1, v2, v3);
  }

  void putTriangle(StripType type, bool right, Sample v1, Sample v2, Sample v3) {
    if (mesh_.triangleCount == 0) {
      putEntry(StripType::A, v1);
      putEntry(StripType::A, v2);
    }
    if (mesh_.triangleCount % kStripLength == 0) putHeader(right, v1, v2);
    (right ? v1Entry_ : v2Entry_) = mesh_.triangleCount + 2;
    putEntry(type, v3);
    ++mesh_.triangleCount;
  }

  void putHeader(bool right, Sample v1, Sample v2) {
    const int distance = std::max(std::abs(v2.x - v1.x), std::abs(v2.y - v1.y));
    const auto direction =
        std::find_if(kStripDirections.begin(), kStripDirections.end(), [&](const StripDirection& candidate) {
          return v1.x + distance * candidate.x == v2.x && v1.y + distance * candidate.y == v2.y;
        });
    const uint32_t entry = mesh_.triangleCount + 2;
    const uint32_t offset = std::max(entry - v1Entry_, entry - v2Entry_);
    // Triangles have no angle below 45 degrees, so that no more than eight share a vertex.
    TERRANE_CHECK(offset >= 2 && offset <= 9 && direction != kStripDirections.end(), "offset {}", offset);
    mesh_.headers.push_back(
        packStripHeader({static_cast<uint32_t>(v1.x), static_cast<uint32_t>(v1.y),
                         static_cast<uint32_t>(direction - kStripDirections.begin()),
                         static_cast<uint32_t>(std::countr_zero(static_cast<unsigned>(distance))), offset,
                         v2Entry_ < v1Entry_, right}));
  }

  void putEntry(StripType type, Sample vertex) {
    putBits(static_cast<uint32_t>(type) | uint32_t{heights_.q[indexOf(vertex)]} << 2, 2 + mesh_.heightBits);
  }

  void putBits(uint32_t bits, int count) {
    held_ |= uint64_t{bits} << heldBits_;
    heldBits_ += count;
    if (heldBits_ < 32) return;
    mesh_.entries.push_back(static_cast<uint32_t>(held_));
    held_ >>= 32;
    heldBits_ -= 32;
  }

  const StripHeights& heights_;
  const std::vector<uint8_t>& isSplit_;
  int side_;
  StripMesh& mesh_;
  uint32_t v1Entry_ = 0;  ///< where the height of the next triangle's v1 is
  uint32_t v2Entry_ = 1;
  uint64_t held_ = 0;  ///< bits that fill no word yet
  int heldBits_ = 0;
};

}  // namespace

Result<StripMesh> encodeStripMesh(std::span<const float> heights, int side, const StripMeshOptions& options) {
  const auto cells = static_cast<unsigned>(side - 1);
  if (side < 3 || side > kMaxStripSide || !std::has_single_bit(cells))
    return makeError("a strip mesh has 2^n + 1 samples along a side, 3 to {}, not {}", kMaxStripSide, side);
  if (heights.size() != static_cast<size_t>(side) * static_cast<size_t>(side))
    return makeError("a strip mesh of side {} has {} samples, not {}", side, side * side, heights.size());
  if (!(options.boundMeters > 0.0) || !std::isfinite(options.boundMeters))
    return makeError("a strip mesh needs a bound above 0 m, not {}", options.boundMeters);
  if (!(options.quantizationMeters >= 0.0 && options.quantizationMeters <= options.boundMeters))
    return makeError("a strip mesh with a bound of {} m cannot be quantised within {} m", options.boundMeters,
                     options.quantizationMeters);

  TERRANE_ASSIGN(const StripHeights quantized, quantizeStripHeights(heights, side, options));
  StripMesh mesh;
  mesh.side = side;
  mesh.heightBits = quantized.bits;
  mesh.baseMeters = quantized.baseMeters;
  mesh.stepMeters = quantized.stepMeters;
  const std::vector<uint8_t> isSplit = splitsWithin(quantized, side, options.boundMeters);
  StripWriter(quantized, isSplit, side, mesh).run();
  return mesh;
}

}  // namespace terrane
