#include "coverage_coding.h"

#include <array>
#include <cstring>

#include "binary_coding.h"

namespace terrane {
namespace {

/// By how many of a cell's corners are ground, and the cells to the west, north and north-east; the last two
/// are of eight cells together that should all be void, or all ground, and differ.
constexpr int kContexts = 42;
constexpr int kEightContext = 40;
/// Models follow so many answers at most.
constexpr int kMost = 60;

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

namespace {

/// Both ways: the writer finds the cells in `bits`, the reader leaves them there.
template <class Coder>
void codeCoverage(Coder& coder, const std::vector<SampleState>& states, std::vector<uint8_t>& bits) {
  std::array<AnswerModel, kContexts> models;
  const auto ask = [&](int context, bool yes) {
    AnswerModel& model = models[static_cast<size_t>(context)];
    yes = coder.code(model.chance, yes);
    model.learn(yes, kMost);
    return yes;
  };
  for (int row = 0; row < kTileCells; ++row) {
    for (int first = 0; first < kTileCells; first += 8) {
      uint8_t& eight = bits[static_cast<size_t>((row * kTileCells + first) / 8)];
      const int expected = expectedOfEight(states, bits, first, row);
      if (expected >= 0 && !ask(kEightContext + (expected & 1), eight != expected)) {
        eight = static_cast<uint8_t>(expected);
        continue;
      }
      const unsigned known = eight;
      if (Coder::kReads) eight = 0;
      for (int i = 0; i < 8; ++i) {
        const bool yes = ask(contextOf(states, bits, first + i, row), (known >> i & 1) != 0);
        if (Coder::kReads) eight |= static_cast<uint8_t>((yes ? 1U : 0U) << i);
      }
    }
  }
}

}  // namespace

void encodeCoverage(const TileSamples& samples, std::vector<uint8_t>& out) {
  std::vector<uint8_t> bits = samples.coverage.bits;
  BinaryWriter writer;
  codeCoverage(writer, samples.states, bits);
  writer.finish(out);
}

Result<size_t> decodeCoverage(std::span<const uint8_t> bytes, TileSamples& samples) {
  size_t used = 0;
  TERRANE_ASSIGN(BinaryReader in, BinaryReader::open(bytes, used));
  samples.coverage.kind = Coverage::Kind::Partial;
  samples.coverage.bits.assign(Coverage::kBytes, 0);
  codeCoverage(in, samples.states, samples.coverage.bits);
  if (!in.finish()) return makeError("byte 0: the coverage is damaged");
  return used;
}

}  // namespace terrane
