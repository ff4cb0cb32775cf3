#include "level_states.h"

namespace terrane {

void LevelStates::begin(int s, const SampleState* states) {
  const int n = kTileCells / (2 * s);
  corners_.resize(n + 1, n + 1);
  quads_.resize(n, n);
  horizontal_.resize(n + 1, n);
  vertical_.resize(n, n + 1);
  for (int y = 0; y <= n; ++y) {
    RowBits coded;
    RowBits voids;
    take(states + 2 * y * s * kTileSamples, 2 * s, n + 1, coded, voids);
    corners_.set(y, coded, voids);
  }
}

namespace {

/// Which of some samples are Coded and which Void, a bit each.
struct StateRun {
  uint32_t coded = 0;
  uint32_t voids = 0;
};

/// Four states, one in every second byte.
StateRun runOfFour(const SampleState* states) {
  static_assert(sizeof(SampleState) == 1 && static_cast<int>(SampleState::Void) == 0 &&
                static_cast<int>(SampleState::Coded) == 2);
  uint64_t bytes;
  std::memcpy(&bytes, states, sizeof(bytes));
  // The product moves bit 16 i to bit 48 + i.
  constexpr uint64_t kEach = 0x0001000100010001U;
  const auto gathered = [](uint64_t bits) {
    return static_cast<uint32_t>((bits & kEach) * 0x0001000200040008U >> 48 & 15);
  };
  return {gathered(bytes >> 1), gathered(~(bytes | bytes >> 1))};
}

StateRun runOf(const SampleState* states, int stride, int count) {
  StateRun out;
  for (int i = 0; i < count; ++i) {
    const SampleState state = states[i * stride];
    out.coded |= (state == SampleState::Coded ? 1U : 0U) << i;
    out.voids |= (state == SampleState::Void ? 1U : 0U) << i;
  }
  return out;
}

StateRun runOfSixteen(const SampleState* states, int stride) {
  if (stride != 2) return runOf(states, stride, 16);
  StateRun out;
  for (int i = 0; i < 16; i += 4) {
    const StateRun four = runOfFour(states + 2 * i);
    out.coded |= four.coded << i;
    out.voids |= four.voids << i;
  }
  return out;
}

}  // namespace

void LevelStates::take(const SampleState* states, int stride, int count, RowBits& coded, RowBits& voids) {
  for (int first = 0; first < count; first += 16) {
    const SampleState* run = states + first * stride;
    // note: a whole run of a row is followed by a sample between it and the next one, or by that one.
    const StateRun bits = count - first >= 16 ? runOfSixteen(run, stride) : runOf(run, stride, count - first);
    coded.setRun(first, bits.coded);
    voids.setRun(first, bits.voids);
  }
}

RowBits LevelStates::withInterpolatedParent(SampleKind kind, int y) const {
  switch (kind) {
    case SampleKind::QuadCenter: {
      // The north-eastern and south-western corners, or the others, by turns.
      const RowBits& north = corners_.interpolated(y);
      const RowBits& south = corners_.interpolated(y + 1);
      const RowBits isTurned = y % 2 == 0 ? RowBits::even() : ~RowBits::even();
      return (isTurned & (north.fromEast() | south)) | (~isTurned & (north | south.fromEast()));
    }
    case SampleKind::HorizontalEdge:
      return quads_.interpolated(y - 1) | quads_.interpolated(y);
    case SampleKind::VerticalEdge:
      break;
  }
  return quads_.interpolated(y) | quads_.interpolated(y).fromWest();
}

}  // namespace terrane
