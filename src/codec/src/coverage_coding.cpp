#include "coverage_coding.h"

#include <algorithm>
#include <cstring>

#include "questions.h"
#include "rans.h"

namespace terrane {
namespace {

/// By how many of a cell's corners are ground, and the cells to the west, north and north-east; the last two
/// are of eight cells together that should all be void, or all ground, and differ.
constexpr int kContexts = 42;
constexpr int kEightContext = 40;

int usualOdds(int context) {
  if (context >= kEightContext) return 4;
  const int corners = context / 8;
  const int cells = (context & 1) + (context >> 1 & 1) + (context >> 2 & 1);
  return std::clamp(24 + 8 * (corners - 2) + 5 * (2 * cells - 3), 1, kOddsSteps - 1);
}

int contextOf(const std::vector<SampleState>& states, const std::vector<uint8_t>& bits, int col, int row) {
  const SampleState* north = states.data() + row * kTileSamples + col;
  const SampleState* south = north + kTileSamples;
  const auto isGround = [](SampleState state) { return state != SampleState::Void ? 1 : 0; };
  const int corners = isGround(north[0]) + isGround(north[1]) + isGround(south[0]) + isGround(south[1]);
  const auto covered = [&](int x, int y) {
    const int cell = y * kTileCells + x;
    return bits[static_cast<size_t>(cell >> 3)] >> (cell & 7) & 1;
  };
  const int west = col > 0 ? covered(col - 1, row) : corners > 2;
  const int above = row > 0 ? covered(col, row - 1) : corners > 2;
  const int northEast = row > 0 && col + 1 < kTileCells ? covered(col + 1, row - 1) : above;
  return corners * 8 + west + 2 * above + 4 * northEast;
}

/// Eight states, one a byte, as ones where they are ground.
uint64_t groundOfEight(const SampleState* states) {
  static_assert(sizeof(SampleState) == 1 && static_cast<int>(SampleState::Coded) == 2);
  uint64_t bytes;
  std::memcpy(&bytes, states, sizeof(bytes));
  return (bytes | bytes >> 1) & 0x0101010101010101U;
}

/// The corners of eight cells in a row: ones in bytes, for each cell, where all four are ground, and where
/// any is.
struct EightCorners {
  uint64_t all;
  uint64_t any;
};
EightCorners cornersOfEight(const std::vector<SampleState>& states, int col, int row) {
  const SampleState* north = states.data() + row * kTileSamples + col;
  const SampleState* south = north + kTileSamples;
  const uint64_t a = groundOfEight(north);
  const uint64_t b = groundOfEight(north + 1);
  const uint64_t c = groundOfEight(south);
  const uint64_t d = groundOfEight(south + 1);
  return {a & b & c & d, a | b | c | d};
}

/// What eight cells surely are together: 255 where all their corners and the cells to the north are ground, 0
/// where none is, -1 otherwise.
int expectedOfEight(const std::vector<SampleState>& states, const std::vector<uint8_t>& bits, int col,
                    int row) {
  const EightCorners corners = cornersOfEight(states, col, row);
  const int expected = corners.all == 0x0101010101010101U ? 255 : corners.any == 0 ? 0 : -1;
  if (expected < 0 || row == 0) return expected;
  return bits[static_cast<size_t>(((row - 1) * kTileCells + col) / 8)] == expected ? expected : -1;
}

}  // namespace

/// Which cells have four corners that are ground.
std::vector<uint8_t> coverageFromCorners(const std::vector<SampleState>& states) {
  std::vector<uint8_t> bits(Coverage::kBytes);
  for (int row = 0; row < kTileCells; ++row) {
    for (int col = 0; col < kTileCells; col += 8) {
      // The product moves the lowest bit of byte i to bit 56 + i.
      const uint64_t all = cornersOfEight(states, col, row).all;
      bits[static_cast<size_t>((row * kTileCells + col) / 8)] =
          static_cast<uint8_t>(all * 0x0102040810204080U >> 56);
    }
  }
  return bits;
}

void encodeCoverage(const TileSamples& samples, std::vector<uint8_t>& out) {
  const std::vector<uint8_t>& bits = samples.coverage.bits;
  Questions<kContexts> isCovered;
  std::vector<std::pair<uint8_t, bool>> answers;
  answers.reserve(kTileCellCount);
  const auto ask = [&](int context, bool yes) {
    ++isCovered.counts[static_cast<size_t>(context)][yes ? 1 : 0];
    answers.emplace_back(static_cast<uint8_t>(context), yes);
  };
  for (int row = 0; row < kTileCells; ++row) {
    for (int first = 0; first < kTileCells; first += 8) {
      const int expected = expectedOfEight(samples.states, bits, first, row);
      if (expected >= 0) {
        const bool differs = bits[static_cast<size_t>((row * kTileCells + first) / 8)] != expected;
        ask(kEightContext + (expected & 1), differs);
        if (!differs) continue;
      }
      for (int col = first; col < first + 8; ++col)
        ask(contextOf(samples.states, bits, col, row), samples.coverage.covered(col, row));
    }
  }
  SegmentWriter writer;
  isCovered.write(writer, usualOdds);
  for (const auto& [context, yes] : answers) writer.answer(isCovered.odds[context], yes);
  writer.finish(out);
}

Result<size_t> decodeCoverage(std::span<const uint8_t> bytes, TileSamples& samples) {
  size_t used = 0;
  TERRANE_ASSIGN(SegmentReader in, SegmentReader::open(bytes, used));
  samples.coverage.kind = Coverage::Kind::Partial;
  std::vector<uint8_t>& bits = samples.coverage.bits;
  bits.assign(Coverage::kBytes, 0);
  Questions<kContexts> isCovered;
  const bool ok = isCovered.read(in, usualOdds);
  const auto answer = [&](int context) { return in.answer(isCovered.odds[static_cast<size_t>(context)]); };
  for (int row = 0; row < kTileCells; ++row) {
    for (int first = 0; first < kTileCells; first += 8) {
      uint8_t& eight = bits[static_cast<size_t>((row * kTileCells + first) / 8)];
      const int expected = expectedOfEight(samples.states, bits, first, row);
      if (expected >= 0 && !answer(kEightContext + (expected & 1))) {
        eight = static_cast<uint8_t>(expected);
        continue;
      }
      for (int col = first; col < first + 8; ++col) {
        const unsigned yes = answer(contextOf(samples.states, bits, col, row)) ? 1 : 0;
        eight |= static_cast<uint8_t>(yes << (col & 7));
      }
    }
  }
  if (!ok || !in.finish()) return makeError("byte 0: the coverage is damaged");
  return used;
}

}  // namespace terrane
