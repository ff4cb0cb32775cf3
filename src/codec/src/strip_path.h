#pragma once

#include <array>
#include <cstdint>

/// The words of the strip (docs/format/strip-mesh-v1.md): how a path goes through triangles, and what a
/// sub-strip's header says. In tiles x runs to the east, y to the south.
namespace terrane {

/// By which edges the path enters and leaves a triangle.
enum class StripType : uint8_t {
  A = 0,    ///< leg, leg
  B = 1,    ///< leg, hypotenuse
  C = 2,    ///< hypotenuse, leg
  End = 3,  ///< no triangle any more
};

/// The windings are no part of the stream but follow from the types. Between two triangles the path has a
/// *sense*: A and C wind that way, B the other; the sense turns with every B and C, and stays with A. That is
/// the table of Follow sets in other words.
constexpr bool windsRight(StripType type, bool senseRight) {
  return senseRight != (type == StripType::B);
}
constexpr bool senseBefore(StripType type, bool right) {
  return right != (type == StripType::B);
}
constexpr bool senseAfter(StripType type, bool right) {
  return right != (type == StripType::C);
}

/// Directions of v2 from v1 in a header: S, SE, E, NE, N, NW, W, SW.
struct StripDirection {
  int x;
  int y;
};
inline constexpr std::array<StripDirection, 8> kStripDirections = {
    {{0, 1}, {1, 1}, {1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}}};

/// A header's fields; the larger distance is what `offset` says, the other one is 1.
struct StripHeader {
  uint32_t x = 0;  ///< of v1
  uint32_t y = 0;
  uint32_t direction = 0;     ///< of v2, kStripDirections
  uint32_t log2Distance = 0;  ///< of v2, larger of x and y
  uint32_t offset = 0;        ///< how many entries before the first triangle's the height is; 2 to 9
  bool offsetIsOfV2 = false;
  bool windsRight = false;
};
constexpr uint32_t packStripHeader(const StripHeader& header) {
  return header.x | header.y << 9 | header.direction << 18 | header.log2Distance << 21 |
         (header.offset - 2) << 25 | uint32_t{header.offsetIsOfV2} << 28 | uint32_t{header.windsRight} << 29;
}
constexpr StripHeader unpackStripHeader(uint32_t word) {
  return {word & 511U,           word >> 9 & 511U,       word >> 18 & 7U,       word >> 21 & 15U,
          (word >> 25 & 7U) + 2, (word >> 28 & 1U) != 0, (word >> 29 & 1U) != 0};
}
/// Bits of a header that mean nothing, and are 0.
inline constexpr uint32_t kStripHeaderUnused = 3U << 30;

}  // namespace terrane
