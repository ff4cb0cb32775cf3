#include "coverage_coding.h"

#include <algorithm>

#include "questions.h"
#include "rans.h"

namespace terrane {
namespace {

/// By how many of a cell's corners are ground, and the cells to the west, north and north-east.
constexpr int kContexts = 40;

int usualOdds(int context) {
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

}  // namespace

/// Which cells have four corners that are ground.
std::vector<uint8_t> coverageFromCorners(const std::vector<SampleState>& states) {
  std::vector<uint8_t> bits(Coverage::kBytes, 0);
  for (int row = 0; row < kTileCells; ++row) {
    const SampleState* north = states.data() + row * kTileSamples;
    const SampleState* south = north + kTileSamples;
    for (int col = 0; col < kTileCells; ++col) {
      const bool ground = std::min(std::min(north[col], north[col + 1]),
                                   std::min(south[col], south[col + 1])) != SampleState::Void;
      const int cell = row * kTileCells + col;
      bits[static_cast<size_t>(cell >> 3)] |= static_cast<uint8_t>((ground ? 1U : 0U) << (cell & 7));
    }
  }
  return bits;
}

void encodeCoverage(const TileSamples& samples, std::vector<uint8_t>& out) {
  const std::vector<uint8_t>& bits = samples.coverage.bits;
  Questions<kContexts> isCovered;
  std::vector<std::pair<uint8_t, bool>> answers;
  answers.reserve(kTileCellCount);
  for (int row = 0; row < kTileCells; ++row) {
    for (int col = 0; col < kTileCells; ++col) {
      const int context = contextOf(samples.states, bits, col, row);
      const bool yes = samples.coverage.covered(col, row);
      ++isCovered.counts[static_cast<size_t>(context)][yes ? 1 : 0];
      answers.emplace_back(static_cast<uint8_t>(context), yes);
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
  for (int row = 0; row < kTileCells; ++row) {
    for (int col = 0; col < kTileCells; ++col) {
      const int context = contextOf(samples.states, bits, col, row);
      const unsigned yes = in.answer(isCovered.odds[static_cast<size_t>(context)]) ? 1 : 0;
      const int cell = row * kTileCells + col;
      bits[static_cast<size_t>(cell >> 3)] |= static_cast<uint8_t>(yes << (cell & 7));
    }
  }
  if (!ok || !in.finish()) return makeError("byte 0: the coverage is damaged");
  return used;
}

}  // namespace terrane
