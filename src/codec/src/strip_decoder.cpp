#include <algorithm>
#include <bit>
#include <cmath>

#include "strip_path.h"
#include "terrane/codec/strip_mesh.h"

namespace terrane {

namespace {

/// Reads entries where one says. Precondition: one more word behind the entry's first.
class EntryReader {
 public:
  explicit EntryReader(const StripMesh& mesh)
      : words_(mesh.entries.data()),
        bits_(2 + static_cast<uint32_t>(mesh.heightBits)),
        mask_((1U << bits_) - 1) {}

  uint32_t operator[](uint32_t index) const {
    const uint64_t bit = uint64_t{index} * bits_;
    const uint32_t* words = words_ + bit / 32;
    return static_cast<uint32_t>((words[0] | uint64_t{words[1]} << 32) >> (bit % 32)) & mask_;
  }

 private:
  const uint32_t* words_;
  uint32_t bits_;
  uint32_t mask_;
};

/// Are the numbers in range, and the vectors as long as they say?
Status checkShape(const StripMesh& mesh) {
  if (mesh.side < 3 || mesh.side > kMaxStripSide ||
      !std::has_single_bit(static_cast<unsigned>(mesh.side - 1)))
    return makeError("strip mesh: a side of {} samples", mesh.side);
  if (mesh.heightBits < 0 || mesh.heightBits > kMaxStripHeightBits)
    return makeError("strip mesh: heights of {} bits", mesh.heightBits);
  const auto cells = static_cast<uint32_t>(mesh.side - 1);
  if (mesh.triangleCount < 4 || mesh.triangleCount > 2 * cells * cells)
    return makeError("strip mesh: {} triangles", mesh.triangleCount);
  if (!std::isfinite(mesh.baseMeters) || !std::isfinite(mesh.stepMeters) || mesh.stepMeters < 0.0)
    return makeError("strip mesh: heights from {} m in steps of {} m", mesh.baseMeters, mesh.stepMeters);
  const size_t headers = (size_t{mesh.triangleCount} + kStripLength - 1) / kStripLength;
  const size_t bits = mesh.topologyBitCount() + mesh.heightBitCount();
  if (mesh.headers.size() != headers || mesh.entries.size() != (bits + 31) / 32 + 1)
    return makeError("strip mesh: {} headers and {} words for {} triangles", mesh.headers.size(),
                     mesh.entries.size(), mesh.triangleCount);
  const uint32_t behind = bits % 32 == 0 ? 0 : mesh.entries[bits / 32] >> (bits % 32);
  if (behind != 0 || mesh.entries.back() != 0) return makeError("strip mesh: bits behind the end marker");
  return {};
}

/// Where the path stands between two triangles: the edge it crosses from v1 (left) to v2 (right), and its
/// sense (strip_path.h).
struct Front {
  int x1;
  int y1;
  int edgeX;  ///< v2 - v1
  int edgeY;
  uint32_t v1;  ///< packed
  uint32_t v2;
  uint32_t senseRight;
};

/// The front that a header describes, `entry` being that of the first triangle; false if it is off the tile.
bool readHeader(uint32_t word, const EntryReader& entries, uint32_t entry, uint32_t last, Front& front) {
  const StripHeader header = unpackStripHeader(word);
  const StripDirection direction = kStripDirections[header.direction];
  front.x1 = static_cast<int>(header.x);
  front.y1 = static_cast<int>(header.y);
  front.edgeX = direction.x * (1 << header.log2Distance);
  front.edgeY = direction.y * (1 << header.log2Distance);
  const auto x2 = static_cast<uint32_t>(front.x1 + front.edgeX);
  const auto y2 = static_cast<uint32_t>(front.y1 + front.edgeY);
  if ((word & kStripHeaderUnused) != 0 || header.x > last || header.y > last || x2 > last || y2 > last ||
      header.offset > entry)
    return false;
  const uint32_t far = entries[entry - header.offset] >> 2;
  const uint32_t near = entries[entry - 1] >> 2;
  front.v1 = packStripVertex({header.x, header.y, header.offsetIsOfV2 ? near : far});
  front.v2 = packStripVertex({x2, y2, header.offsetIsOfV2 ? far : near});
  const auto first = static_cast<StripType>(entries[entry] & 3U);
  front.senseRight = senseBefore(first, header.windsRight) ? 1 : 0;
  return true;
}

/// Follows the path through up to a sub-strip's triangles and gives each to `put`; false if one is off the
/// tile, or none.
/// note: without branches, by masks that are all ones if so, since types are as good as random; what is wrong
/// is told at the end.
template <class Put>
bool follow(const EntryReader& entries, uint32_t entry, uint32_t count, uint32_t last, Front& front,
            const Put& put) {
  Front at = front;
  uint32_t offTile = 0;
  uint32_t noTriangle = 0;  // the end, or a hypotenuse without a middle
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t word = entries[entry + i];
    const uint32_t type = word & 3U;
    const uint32_t isB = type & 1U;
    const uint32_t isC = type >> 1;
    // Ahead is the edge turned to the left. From v1 (A_L, B_R) or v2 (A_R, B_L) the new vertex is an edge's
    // length ahead; for C it is half of it ahead of the edge's middle.
    const int ifAcross = -static_cast<int>(at.senseRight | isC);
    const int toX = ((at.edgeX & ifAcross) + at.edgeY) >> isC;
    const int toY = ((at.edgeY & ifAcross) - at.edgeX) >> isC;
    const auto x3 = static_cast<uint32_t>(at.x1 + toX);
    const auto y3 = static_cast<uint32_t>(at.y1 + toY);
    // Below 0 or above `last` is what has the highest bit set, itself or what is left.
    offTile |= x3 | y3 | (last - x3) | (last - y3);
    noTriangle |= (isB | static_cast<uint32_t>(at.edgeX + at.edgeY)) & isC;
    const uint32_t v3 = x3 | y3 << 10 | (word >> 2) << 20;
    put(at.v1, at.v2, v3);

    // Winding left the path turns about v1, and v3 is on the right from now on.
    const uint32_t right = at.senseRight ^ isB;
    const int ifRight = -static_cast<int>(right);
    const uint32_t v2 = at.v2;
    at.v2 = right != 0 ? v2 : v3;
    at.v1 = right != 0 ? v3 : at.v1;
    at.x1 += toX & ifRight;
    at.y1 += toY & ifRight;
    at.edgeX = ((at.edgeX & ifRight) - ifRight) + (toX ^ ifRight);  // edge - to, or to
    at.edgeY = ((at.edgeY & ifRight) - ifRight) + (toY ^ ifRight);
    at.senseRight = right ^ isC;
  }
  front = at;
  return offTile >> 31 == 0 && noTriangle == 0;
}

/// All of the strip, each triangle given to `put`.
template <class Put>
Status followAll(const StripMesh& mesh, const Put& put) {
  TERRANE_TRY(checkShape(mesh));
  const EntryReader entries(mesh);
  const auto last = static_cast<uint32_t>(mesh.side - 1);
  Front front{};
  for (uint32_t i = 0; i < mesh.headers.size(); ++i) {
    const uint32_t first = i * kStripLength;
    Front begin{};
    if (!readHeader(mesh.headers[i], entries, first + 2, last, begin))
      return makeError("strip mesh: the header of sub-strip {} is off the tile", i);
    // What headers say beyond the first is known from the path.
    if (i > 0 && (begin.v1 != front.v1 || begin.v2 != front.v2 || begin.senseRight != front.senseRight))
      return makeError("strip mesh: sub-strip {} does not begin where the one before ends", i);
    front = begin;
    const uint32_t count = std::min(kStripLength, mesh.triangleCount - first);
    if (!follow(entries, first + 2, count, last, front, put))
      return makeError("strip mesh: a triangle of sub-strip {} is off the tile, or the end", i);
  }
  if (entries[mesh.triangleCount + 2] != static_cast<uint32_t>(StripType::End))
    return makeError("strip mesh: no end marker behind {} triangles", mesh.triangleCount);
  return {};
}

}  // namespace

Result<size_t> decodeStripMesh(const StripMesh& mesh, std::vector<uint32_t>& vertices) {
  const Status shape = checkShape(mesh);
  vertices.resize(shape.ok() ? size_t{mesh.triangleCount} * 3 : 0);
  uint32_t* next = vertices.data();
  const Status followed = followAll(mesh, [&next](uint32_t v1, uint32_t v2, uint32_t v3) {
    next[0] = v1;
    next[1] = v2;
    next[2] = v3;
    next += 3;
  });
  if (!followed.ok()) {
    vertices.clear();
    return followed.error();
  }
  return size_t{mesh.triangleCount};
}

Status validateStripMesh(const StripMesh& mesh) {
  return followAll(mesh, [](uint32_t, uint32_t, uint32_t) {});
}

}  // namespace terrane
