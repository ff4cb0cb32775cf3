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

void LevelStates::take(const SampleState* states, int stride, int count, RowBits& coded, RowBits& voids) {
  for (int first = 0; first < count; first += 16) {
    uint32_t codedRun = 0;
    uint32_t voidRun = 0;
    const int run = std::min(16, count - first);
    for (int i = 0; i < run; ++i) {
      const SampleState state = states[(first + i) * stride];
      codedRun |= (state == SampleState::Coded ? 1U : 0U) << i;
      voidRun |= (state == SampleState::Void ? 1U : 0U) << i;
    }
    coded.setRun(first, codedRun);
    voids.setRun(first, voidRun);
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
