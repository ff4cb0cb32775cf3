#include "significance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "terrane/base/check.h"
#include "terrane/base/float4.h"

namespace terrane {

namespace {

constexpr int kSide = 2 * kLargestOptional;  ///< cells along a square: below it everything is optional
constexpr int kSideSamples = kSide + 1;
constexpr int kStride = kSide + 4;  ///< so that four may be loaded anywhere
constexpr int kSquares = kTileCells / kSide;

/// One row of a square, a bit a sample, the westernmost lowest.
using RowBits = uint32_t;

/// The samples of a square's row that are odd multiples of s, and the even ones.
constexpr RowBits multiples(int s, bool odd) {
  RowBits out = 0;
  for (int x = odd ? s : 0; x < kSideSamples; x += 2 * s) out |= RowBits{1} << x;
  return out;
}
constexpr RowBits oddMultiples(int s) {
  return multiples(s, true);
}
constexpr RowBits evenMultiples(int s) {
  return multiples(s, false);
}

/// Does the hypotenuse of the quad-centre fall from north-west to south-east? (tiling/lattice.h; a tile's
/// side is an even number of any such squares, so local coordinates tell.)
constexpr bool fallsEastward(int x, int y, int s) {
  return (((x / s) ^ (y / s)) & 2) == 0;
}

/// A square of 16 x 16 cells with its border, from the bottom up. Rows of needs hold the diamonds' bits.
class Square {
 public:
  /// False where there is no height at all.
  bool load(std::span<const float> given, std::span<const float> onStep, int left, int top,
            double maxErrorMeters) {
    left_ = left;
    top_ = top;
    needed_.fill(0);
    const auto at = [&](int x, int y) { return static_cast<size_t>((top + y) * kTileSamples + left + x); };
    // Heights relative to one of them, so that rounding follows the square's relief.
    float base = onStep[at(0, 0)];
    for (int y = 0; std::isnan(base) && y < kSideSamples; ++y) {
      for (int x = 0; std::isnan(base) && x < kSideSamples; ++x) base = onStep[at(x, y)];
    }
    if (std::isnan(base)) return false;
    const Float4 base4 = Float4::all(base);
    Float4 relief4 = Float4::all(0.0F), sum4 = Float4::all(0.0F);
    for (int y = 0; y < kSideSamples; ++y) {
      const float* fromGiven = given.data() + at(0, y);
      const float* fromStep = onStep.data() + at(0, y);
      float* z = given_ + y * kStride;
      float* h = onStep_ + y * kStride;
      for (int x = 0; x < kSide; x += 4) {
        const Float4 z4 = Float4::load(fromGiven + x) - base4;
        const Float4 h4 = Float4::load(fromStep + x) - base4;
        z4.store(z + x);
        h4.store(h + x);
        relief4 = larger(absolute(z4), larger(absolute(h4), relief4));
        sum4 = sum4 + z4;
      }
      const float z1 = fromGiven[kSide] - base;
      const float h1 = fromStep[kSide] - base;
      Float4::all(z1).store(z + kSide);
      Float4::all(h1).store(h + kSide);
      relief4 = larger(absolute(Float4::all(z1)), larger(absolute(Float4::all(h1)), relief4));
      sum4 = sum4 + Float4::all(z1);
    }
    float relief[4], sum[4];
    relief4.store(relief);
    sum4.store(sum);
    hasVoid_ = std::isnan(sum[0] + sum[1] + sum[2] + sum[3]);

    // What the means between a sample and its triangle's corners round, at most two for each of the sizes,
    // and what the planes here do.
    const double most = std::max(std::max(relief[0], relief[1]), std::max(relief[2], relief[3]));
    constexpr double kHalfUlp = 1.0 / (1 << 24);
    const double rounding =
        8.0 * kHalfUlp * (std::abs(static_cast<double>(base)) + most) + 16.0 * kHalfUlp * most;
    bound_ = static_cast<float>((maxErrorMeters - rounding) * (1.0 - 4.0 * kHalfUlp));
    return true;
  }

  void measure() {
    if (!(bound_ > 0.0F)) {
      // note: a float cannot tell; then every sample with a height is needed, and their ancestors.
      needed_.fill((RowBits{1} << kSideSamples) - 1);
    } else if (hasVoid_) {
      measureBesideVoid();
    } else {
      measureSmallest();
      measureSize<2>();
      measureSize<4>();
      measureSize<8>();
    }
  }

  void addTo(uint8_t* bits) const {
    for (int y = 0; y < kSideSamples; ++y) {
      const auto first = static_cast<size_t>((top_ + y) * kTileSamples + left_);
      uint32_t word = 0;
      std::memcpy(&word, bits + first / 8, sizeof(word));
      word |= needed_[static_cast<size_t>(y)] << (first % 8);
      std::memcpy(bits + first / 8, &word, sizeof(word));
    }
  }

 private:
  RowBits& row(int y) { return needed_[static_cast<size_t>(y)]; }
  bool isNeeded(int x, int y) { return (row(y) >> x & 1) != 0; }
  void need(int x, int y) { row(y) |= RowBits{1} << x; }

  /// Edge-centres take over what the quad-centres half their size inside the square need.
  void needEdgesAbove(int s) {
    const int half = s / 2;
    for (int y = 0; y < kSideSamples; y += s) {
      RowBits quads = 0;
      if (y > 0) quads |= row(y - half);
      if (y < kSide) quads |= row(y + half);
      quads &= oddMultiples(half);
      const RowBits mask = (y / s) % 2 == 0 ? oddMultiples(s) : evenMultiples(s);
      row(y) |= (quads << half | quads >> half) & mask;
    }
  }
  /// Quad-centres take over what the edge-centres of their size need.
  void needQuadsAbove(int s) {
    for (int y = s; y < kSideSamples; y += 2 * s) {
      row(y) |= (row(y - s) | row(y + s) | row(y) << s | row(y) >> s) & oddMultiples(s);
    }
  }

  // ---- without void

  /// Half-size 1: a triangle holds its own centre, and on its legs its children's.
  void measureSmallest() {
    const Float4 half = Float4::all(0.5F);
    const Float4 bound = Float4::all(bound_);
    const auto mean = [&](const float* a, const float* b) {
      return (Float4::load(a) + Float4::load(b)) * half;
    };
    for (int y = 0; y < kSideSamples; ++y) {
      const float* h = onStep_ + y * kStride;
      const float* z = given_ + y * kStride;
      RowBits bits = 0;
      if (y % 2 == 0) {
        for (int x = 1; x < kSide; x += 4) {
          const Float4 off = absolute(mean(h + x - 1, h + x + 1) - Float4::load(z + x));
          bits |= lanesAbove(off, bound) << x;
        }
        row(y) |= bits & oddMultiples(1);
      } else {
        for (int x = 0; x < kStride; x += 4) {
          const Float4 off = absolute(mean(h + x - kStride, h + x + kStride) - Float4::load(z + x));
          bits |= lanesAbove(off, bound) << x;
        }
        row(y) |= bits & evenMultiples(1);
      }
    }
    needQuadsAbove(1);
    for (int y = 1; y < kSideSamples; y += 2) {
      if ((row(y) & oddMultiples(1)) == oddMultiples(1)) continue;
      const float* north = onStep_ + (y - 1) * kStride;
      const float* south = onStep_ + (y + 1) * kStride;
      const float* z = given_ + y * kStride;
      RowBits falling = 0, rising = 0;
      for (int x = 1; x < kSide; x += 4) {
        const Float4 z4 = Float4::load(z + x);
        falling |= lanesAbove(absolute(mean(north + x - 1, south + x + 1) - z4), bound) << x;
        rising |= lanesAbove(absolute(mean(north + x + 1, south + x - 1) - z4), bound) << x;
      }
      constexpr RowBits kFirst = 0x2222, kSecond = 0x8888;  // odd samples, every other one
      const bool firstFalls = fallsEastward(1, y, 1);
      row(y) |= (firstFalls ? falling : rising) & kFirst;
      row(y) |= (firstFalls ? rising : falling) & kSecond;
    }
  }

  /// Half-size s. note: samples on a triangle's legs are measured with its children, whose hypotenuses the
  /// legs are: same line, same samples, and a child's need becomes the parent's.
  template <int s>
  void measureSize() {
    constexpr int kQuad = 2 * s;
    needEdgesAbove(s);
    measureHypotenuses<s>();
    for (int y = 0; y < kSide; y += kQuad) {
      for (int x = 0; x < kSide; x += kQuad) {
        if (!isNeeded(x + s, y) || !isNeeded(x, y + s) || !isNeeded(x + kQuad, y + s) ||
            !isNeeded(x + s, y + kQuad)) {
          measureQuarters<s>(x, y);
        }
      }
    }
    needQuadsAbove(s);
    for (int y = 0; y < kSide; y += kQuad) {
      for (int x = 0; x < kSide; x += kQuad) {
        if (isNeeded(x + s, y + s)) continue;
        if (leavesHalves<s>(x, y)) need(x + s, y + s);
      }
    }
  }

  template <int s>
  void measureHypotenuses() {
    constexpr int kQuad = 2 * s;
    constexpr float kShare = 1.0F / kQuad;
    const auto leaves = [&](int x, int y, int step) {
      const float* h = onStep_ + y * kStride + x;
      const float* z = given_ + y * kStride + x;
      const float slope = (h[kQuad * step] - h[0]) * kShare;
      float worst = 0.0F;
      for (int i = 1; i < kQuad; ++i) {
        const float off = std::abs(h[0] + slope * static_cast<float>(i) - z[i * step]);
        worst = off > worst ? off : worst;
      }
      return worst > bound_;
    };
    for (int y = 0; y < kSideSamples; y += kQuad) {
      for (int x = 0; x < kSide; x += kQuad) {
        if (!isNeeded(x + s, y) && leaves(x, y, 1)) need(x + s, y);
      }
    }
    for (int y = 0; y < kSide; y += kQuad) {
      for (int x = 0; x < kSideSamples; x += kQuad) {
        if (!isNeeded(x, y + s) && leaves(x, y, kStride)) need(x, y + s);
      }
    }
  }

  /// A quad cut along both diagonals: the inner triangles of the edge-centres on its four sides.
  template <int s>
  void measureQuarters(int x, int y) {
    constexpr int kQuad = 2 * s;
    constexpr float kShare = 1.0F / kQuad;
    const float* h = onStep_ + y * kStride + x;
    const float nw = h[0], ne = h[kQuad], sw = h[kQuad * kStride], se = h[kQuad * kStride + kQuad];
    const float center = h[s * kStride + s];
    // The planes' slopes: the western one's both ways, the others' along the row.
    const float westX = (2.0F * center - (nw + sw)) * kShare;
    const float westY = (sw - nw) * kShare;
    const float northX = (ne - nw) * kShare;
    const float southX = (se - sw) * kShare;
    const float eastX = ((ne + se) - 2.0F * center) * kShare;

    // A row crosses three of them, and bends where it enters the next.
    RowBits north = 0, west = 0, east = 0, south = 0;
    for (int j = 1; j < kQuad; ++j) {
      const int enter = j < s ? j : kQuad - j;
      const int leave = kQuad - enter;
      const float middleX = j < s ? northX : southX;
      const RowBits off = lanesOff<kQuad>(given_ + (y + j) * kStride + x, nw + westY * static_cast<float>(j),
                                          westX, middleX - westX, enter, eastX - middleX, leave);
      const RowBits middle = ((RowBits{1} << leave) - 1) & ~((RowBits{2} << enter) - 1);
      (j < s ? north : south) |= off & middle;
      west |= off & ((RowBits{1} << enter) - 1);
      east |= off & ~((RowBits{2} << leave) - 1);
    }
    if (north != 0) need(x + s, y);
    if (south != 0) need(x + s, y + kQuad);
    if (west != 0) need(x, y + s);
    if (east != 0) need(x + kQuad, y + s);
  }

  /// A quad cut along its hypotenuse: does a sample inside leave its triangle?
  template <int s>
  bool leavesHalves(int x, int y) {
    constexpr int kQuad = 2 * s;
    constexpr float kShare = 1.0F / kQuad;
    const float* h = onStep_ + y * kStride + x;
    const float nw = h[0], ne = h[kQuad], sw = h[kQuad * kStride], se = h[kQuad * kStride + kQuad];
    const bool falls = fallsEastward(left_ + x + s, top_ + y + s, s);
    const float northX = (ne - nw) * kShare;
    const float southX = (se - sw) * kShare;
    const float westY = (sw - nw) * kShare;
    for (int j = 1; j < kQuad; ++j) {
      const float first = nw + westY * static_cast<float>(j);
      const float* z = given_ + (y + j) * kStride + x;
      const RowBits off = falls ? lanesOff<kQuad>(z, first, southX, northX - southX, j, 0.0F, kQuad)
                                : lanesOff<kQuad>(z, first, northX, southX - northX, kQuad - j, 0.0F, kQuad);
      if (off != 0) return true;
    }
    return false;
  }

  /// The samples 1 to quad - 1 of a row that are off a line with two bends by more than the bound.
  template <int quad>
  RowBits lanesOff(const float* z, float first, float slope, float bend1, int at1, float bend2,
                   int at2) const {
    static constexpr float kPlaces[kSide + 4] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,
                                                 10, 11, 12, 13, 14, 15, 16, 17, 18, 19};
    const Float4 zero = Float4::all(0.0F);
    RowBits out = 0;
    for (int i = 1; i < quad; i += 4) {
      const Float4 place = Float4::load(kPlaces + i);
      const Float4 beyond1 = larger(place - Float4::all(static_cast<float>(at1)), zero);
      const Float4 beyond2 = larger(place - Float4::all(static_cast<float>(at2)), zero);
      const Float4 plane = Float4::all(first) + Float4::all(slope) * place + Float4::all(bend1) * beyond1 +
                           Float4::all(bend2) * beyond2;
      out |= lanesAbove(absolute(plane - Float4::load(z + i)), Float4::all(bound_)) << i;
    }
    return out & ((RowBits{1} << quad) - 2);
  }

  // ---- beside void

  float z(int x, int y) const { return given_[y * kStride + x]; }
  float h(int x, int y) const { return onStep_[y * kStride + x]; }
  /// A sample with a height that is not kept by what interpolation gives; that is NaN where it depends on a
  /// corner without height.
  bool isOff(int x, int y, float interpolated) const {
    const float given = z(x, y);
    return !std::isnan(given) && !(std::abs(interpolated - given) <= bound_);
  }

  /// The same measures, one sample at a time.
  void measureBesideVoid() {
    for (int s = 1; s <= kLargestOptional; s *= 2) {
      if (s > 1) needEdgesAbove(s);
      const int quad = 2 * s;
      const float share = 1.0F / static_cast<float>(quad);
      for (int y = 0; y < kSideSamples; y += quad) {
        for (int x = 0; x < kSideSamples; x += quad) {
          for (int i = 1; i < quad; ++i) {
            const float part = static_cast<float>(i) * share;
            if (x < kSide && isOff(x + i, y, h(x, y) + (h(x + quad, y) - h(x, y)) * part)) need(x + s, y);
            if (y < kSide && isOff(x, y + i, h(x, y) + (h(x, y + quad) - h(x, y)) * part)) need(x, y + s);
          }
          if (x < kSide && y < kSide) measureQuartersBesideVoid(x, y, s);
        }
      }
      needQuadsAbove(s);
      for (int y = 0; y < kSide; y += quad) {
        for (int x = 0; x < kSide; x += quad) {
          if (leavesHalvesBesideVoid(x, y, s)) need(x + s, y + s);
        }
      }
    }
  }

  void measureQuartersBesideVoid(int x, int y, int s) {
    const int quad = 2 * s;
    const float share = 1.0F / static_cast<float>(quad);
    const float nw = h(x, y), ne = h(x + quad, y), sw = h(x, y + quad), se = h(x + quad, y + quad);
    const float center = h(x + s, y + s);
    for (int j = 1; j < quad; ++j) {
      for (int i = 1; i < quad; ++i) {
        if (i == j || i + j == quad) continue;
        const auto u = static_cast<float>(i) * share, v = static_cast<float>(j) * share;
        const bool northEast = i > j, northWest = i + j < quad;
        // A plane through two corners and the center: along the side, and away from it.
        if (northEast && northWest) {
          if (isOff(x + i, y + j, nw + (ne - nw) * u + (2.0F * center - (nw + ne)) * v)) need(x + s, y);
        } else if (northEast) {
          const float off = 1.0F - u;
          if (isOff(x + i, y + j, ne + (se - ne) * v + (2.0F * center - (ne + se)) * off))
            need(x + quad, y + s);
        } else if (northWest) {
          if (isOff(x + i, y + j, nw + (sw - nw) * v + (2.0F * center - (nw + sw)) * u)) need(x, y + s);
        } else {
          const float off = 1.0F - v;
          if (isOff(x + i, y + j, sw + (se - sw) * u + (2.0F * center - (sw + se)) * off))
            need(x + s, y + quad);
        }
      }
    }
  }

  bool leavesHalvesBesideVoid(int x, int y, int s) const {
    const int quad = 2 * s;
    const float share = 1.0F / static_cast<float>(quad);
    const float nw = h(x, y), ne = h(x + quad, y), sw = h(x, y + quad), se = h(x + quad, y + quad);
    const bool falls = fallsEastward(left_ + x + s, top_ + y + s, s);
    for (int j = 1; j < quad; ++j) {
      for (int i = 1; i < quad; ++i) {
        const auto u = static_cast<float>(i) * share, v = static_cast<float>(j) * share;
        float plane = 0.0F;
        if (falls) {
          plane = i == j  ? nw + (se - nw) * u
                  : i > j ? nw + (ne - nw) * u + (se - ne) * v
                          : nw + (sw - nw) * v + (se - sw) * u;
        } else {
          plane = i + j == quad  ? ne + (sw - ne) * v
                  : i + j < quad ? nw + (ne - nw) * u + (sw - nw) * v
                                 : se + (sw - se) * (1.0F - u) + (ne - se) * (1.0F - v);
        }
        if (isOff(x + i, y + j, plane)) return true;
      }
    }
    return false;
  }

  int left_ = 0;
  int top_ = 0;
  bool hasVoid_ = false;
  float bound_ = 0.0F;
  float given_[kSideSamples * kStride];   ///< relative to a height of the square
  float onStep_[kSideSamples * kStride];  ///< likewise
  std::array<RowBits, kSideSamples> needed_{};
};

// ---- closure

/// A tile with a ring of one square around it, a bit a sample.
constexpr int kRingSamples = kTileSamples + 2 * kSide;
constexpr int kWords = (kRingSamples + 63) / 64;
using WideRow = std::array<uint64_t, kWords>;

/// Up to 32 bits from any place.
uint64_t bitsAt(const uint8_t* bits, size_t first, int count) {
  uint64_t out = 0;
  const size_t bytes = (first % 8 + static_cast<size_t>(count) + 7) / 8;
  std::memcpy(&out, bits + first / 8, bytes);
  return out >> (first % 8) & ((uint64_t{1} << count) - 1);
}

void addBits(WideRow& row, int at, const uint8_t* bits, size_t first, int count) {
  for (int done = 0; done < count;) {
    const int inWord = (at + done) % 64;
    const int now = std::min({32, count - done, 64 - inWord});
    row[static_cast<size_t>((at + done) / 64)] |= bitsAt(bits, first + static_cast<size_t>(done), now)
                                                  << inWord;
    done += now;
  }
}

/// (a moved by s to the east) | (a moved by s to the west), where the mask is set. s < 64.
void addShifted(WideRow& to, const WideRow& a, int s, const WideRow& mask) {
  for (size_t i = 0; i < kWords; ++i) {
    uint64_t moved = a[i] << s | a[i] >> s;
    if (i > 0) moved |= a[i - 1] >> (64 - s);
    if (i + 1 < kWords) moved |= a[i + 1] << (64 - s);
    to[i] |= moved & mask[i];
  }
}

WideRow wideMultiples(int s, bool odd) {
  WideRow out{};
  for (int x = odd ? s : 0; x < kRingSamples; x += 2 * s)
    out[static_cast<size_t>(x / 64)] |= uint64_t{1} << (x % 64);
  return out;
}

/// Everything that a needed diamond descends from, below the squares.
void closeRows(std::vector<WideRow>& rows) {
  const auto row = [&](int y) -> WideRow& { return rows[static_cast<size_t>(y)]; };
  constexpr int kLast = kRingSamples - 1;
  for (int s = 1; s <= kLargestOptional; s *= 2) {
    const WideRow odd = wideMultiples(s, true), even = wideMultiples(s, false);
    if (s > 1) {
      const int half = s / 2;
      const WideRow quadColumns = wideMultiples(half, true);
      for (int y = 0; y <= kLast; y += s) {
        WideRow quads{};
        for (size_t i = 0; i < kWords; ++i) {
          if (y > 0) quads[i] |= row(y - half)[i];
          if (y < kLast) quads[i] |= row(y + half)[i];
          quads[i] &= quadColumns[i];
        }
        addShifted(row(y), quads, half, (y / s) % 2 == 0 ? odd : even);
      }
    }
    for (int y = s; y <= kLast; y += 2 * s) {
      for (size_t i = 0; i < kWords; ++i) row(y)[i] |= (row(y - s)[i] | row(y + s)[i]) & odd[i];
      const WideRow edges = row(y);
      addShifted(row(y), edges, s, odd);
    }
  }
}

}  // namespace

void findNeeded(std::span<const float> given, std::span<const float> onStep, double maxErrorMeters,
                std::span<uint8_t, kSampleBitsBytes> needed) {
  // Room for the last row's word to end in.
  std::vector<uint8_t> bits(kSampleBitsBytes + 4, 0);
  Square square;
  for (int row = 0; row < kSquares; ++row) {
    for (int col = 0; col < kSquares; ++col) {
      if (!square.load(given, onStep, col * kSide, row * kSide, maxErrorMeters)) continue;
      square.measure();
      square.addTo(bits.data());
    }
  }
  std::copy_n(bits.begin(), kSampleBitsBytes, needed.begin());
}

void findSignificant(const NeedsAround& needs, std::span<uint8_t> significant) {
  TERRANE_CHECK(significant.size() == static_cast<size_t>(kTileSampleCount), "{} samples",
                significant.size());
  std::vector<WideRow> rows(kRingSamples, WideRow{});
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const uint8_t* bits = needs[static_cast<size_t>((dy + 1) * 3 + dx + 1)];
      if (bits == nullptr) continue;
      const int firstX = dx < 0 ? kTileCells - kSide : 0;
      const int lastX = dx > 0 ? kSide : kTileCells;
      const int firstY = dy < 0 ? kTileCells - kSide : 0;
      const int lastY = dy > 0 ? kSide : kTileCells;
      for (int y = firstY; y <= lastY; ++y) {
        addBits(rows[static_cast<size_t>(kSide + dy * kTileCells + y)], kSide + dx * kTileCells + firstX,
                bits, static_cast<size_t>(y * kTileSamples + firstX), lastX - firstX + 1);
      }
    }
  }
  closeRows(rows);

  // The squares' corners, and then a byte a sample.
  uint8_t* out = significant.data();
  for (int y = 0; y < kTileSamples; ++y) {
    const WideRow& row = rows[static_cast<size_t>(kSide + y)];
    for (int x = 0; x < kTileSamples; ++x) {
      const int at = kSide + x;
      out[x] = static_cast<uint8_t>(row[static_cast<size_t>(at / 64)] >> (at % 64) & 1);
    }
    if (y % kSide == 0) {
      for (int x = 0; x < kTileSamples; x += kSide) out[x] = 1;
    }
    out += kTileSamples;
  }
}

bool interpolateInsignificant(std::span<const uint8_t> significant, std::span<float> heights,
                              std::span<SampleState> states) {
  // Samples without a height keep none, whatever they are while their neighbours take means of them.
  bool anyVoid = false;
  bool allCoded = true;
  for (size_t i = 0; i < heights.size(); ++i) {
    const bool isVoid = std::isnan(heights[i]);
    const bool isCoded = !isVoid && significant[i] != 0;
    states[i] = isVoid ? SampleState::Void : isCoded ? SampleState::Coded : SampleState::Interpolated;
    anyVoid |= isVoid;
    allCoded &= isCoded;
  }
  if (allCoded) return true;
  for (int s = kLargestOptional; s >= 1; s /= 2) {
    const int south = s * kTileSamples;
    for (int y = s; y < kTileSamples; y += 2 * s) {
      for (int x = s; x < kTileSamples; x += 2 * s) {
        const int at = y * kTileSamples + x;
        const int end = fallsEastward(x, y, s) ? south + s : south - s;
        float* h = heights.data() + at;
        const float mean = (h[-end] + h[end]) * 0.5F;
        *h = states[static_cast<size_t>(at)] == SampleState::Coded ? *h : mean;
      }
    }
    for (int y = 0; y < kTileSamples; y += s) {
      const bool horizontal = (y / s) % 2 == 0;
      const int end = horizontal ? s : south;
      for (int x = horizontal ? s : 0; x < kTileSamples; x += 2 * s) {
        const int at = y * kTileSamples + x;
        float* h = heights.data() + at;
        const float mean = (h[-end] + h[end]) * 0.5F;
        *h = states[static_cast<size_t>(at)] == SampleState::Coded ? *h : mean;
      }
    }
  }
  if (anyVoid) {
    for (size_t i = 0; i < heights.size(); ++i) {
      if (states[i] == SampleState::Void) heights[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return false;
}

}  // namespace terrane
