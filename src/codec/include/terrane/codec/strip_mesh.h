#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"

/// The form in which Dick, Schneider and Westermann (2009, "Efficient Geometry Compression for GPU-Based
/// Decoding in Realtime Terrain Rendering") store a tile: a restricted quadtree mesh within an error bound,
/// as one generalised triangle strip in pieces of 16 triangles that decode independently of each other. It is
/// what Terrane's own form is measured against; no dataset holds it. Pure functions, any thread. Bytes:
/// docs/format/strip-mesh-v1.md.
namespace terrane {

/// Samples along a tile's side are 2^n + 1, from 3 to 513: a header has 9 bits for a coordinate.
inline constexpr int kMaxStripSide = 513;
/// Triangles of a sub-strip; the last one may have fewer.
inline constexpr uint32_t kStripLength = 16;
/// A packed vertex has 12 bits for its height.
inline constexpr int kMaxStripHeightBits = 12;

struct StripMeshOptions {
  double boundMeters = 0.0;         ///< no sample with a height is further from the mesh; more than 0
  double quantizationMeters = 0.0;  ///< what vertices may be off, at most the bound; 0: a quarter of it
};

/// A tile as the GPU takes it.
struct StripMesh {
  int side = 0;             ///< samples along a side, 2^n + 1
  int heightBits = 0;       ///< k: bits of a height q
  double baseMeters = 0.0;  ///< the height of q = 0
  double stepMeters = 0.0;  ///< between q and q + 1
  uint32_t triangleCount = 0;
  /// One a sub-strip, from the lowest bit: x and y of v1 (9 bits each), direction of v2 from v1 (3), log2 of
  /// their distance (4), the larger of their heights' two distances in entries - 2 (3), is it that of v2 (1),
  /// does the first triangle wind right (1); the highest two bits are 0.
  std::vector<uint32_t> headers;
  /// The heights v1 and v2 of the first triangle, then one entry a triangle, then an end marker, without gaps
  /// from the lowest bit: type (2 bits: 0 A, 1 B, 2 C, 3 end), q of the new vertex (heightBits). Bits behind
  /// the end are 0, and one more word of 0 stands there, so that two words can always be read.
  std::vector<uint32_t> entries;

  double heightMeters(uint32_t q) const { return baseMeters + q * stepMeters; }

  /// What the tile costs, by what it is spent on; the first two vertices and the end marker included.
  size_t headerBitCount() const { return headers.size() * 32; }
  size_t topologyBitCount() const { return entryCount() * 2; }
  size_t heightBitCount() const { return entryCount() * static_cast<size_t>(heightBits); }
  size_t bitCount() const { return headerBitCount() + topologyBitCount() + heightBitCount(); }
  size_t entryCount() const { return size_t{triangleCount} + 3; }
};

/// A decoded vertex in 32 bits: from the lowest x (10 bits, to the east), y (10, to the south), q (12).
struct StripVertex {
  uint32_t x = 0;
  uint32_t y = 0;
  uint32_t q = 0;
};
constexpr uint32_t packStripVertex(const StripVertex& vertex) {
  return vertex.x | vertex.y << 10 | vertex.q << 20;
}
constexpr StripVertex unpackStripVertex(uint32_t packed) {
  return {packed & 1023U, packed >> 10 & 1023U, packed >> 20};
}

/// The mesh of side * side heights, row by row from the north-west; what is not finite is no data: it never
/// forces a split, and where it is a vertex it takes the height of what is known nearby. Starting from four
/// triangles about the middle, a triangle is split while a sample on it is further than the bound from the
/// heights as they were given, and with it what keeps the mesh without T-vertices: the smallest such mesh.
/// Errors: a side, bound or quantisation that is not allowed; heights that need more than 12 bits. Cost: each
/// sample is looked at a few times.
Result<StripMesh> encodeStripMesh(std::span<const float> heights, int side, const StripMeshOptions& options);

/// The mesh as bytes, and bytes as a mesh. Errors: bytes cut short or too long, another version, numbers out
/// of their range; what headers and entries say is left to those who decode.
std::vector<uint8_t> bytesOf(const StripMesh& mesh);
Result<StripMesh> parseStripMesh(std::span<const uint8_t> bytes);

/// Replaces `vertices` by three packed vertices a triangle, in the order of the strip, counter-clockwise seen
/// from above; gives the number of triangles. Errors: a vertex off the tile, a sub-strip that does not go on
/// where the one before ended, an end marker that is missing or too early; `vertices` is empty then. Never
/// reads beyond the mesh's vectors, whatever they hold. A vector that is used again is not allocated again.
Result<size_t> decodeStripMesh(const StripMesh& mesh, std::vector<uint32_t>& vertices);

/// Would decodeStripMesh() succeed? For those who decode elsewhere: on a GPU there are no errors.
Status validateStripMesh(const StripMesh& mesh);

}  // namespace terrane
