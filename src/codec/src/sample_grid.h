#pragma once

#include "sample_prediction.h"
#include "terrane/codec/tile.h"

namespace terrane {

/// Where the samples of one kind and half-size stand in a tile's arrays.
struct Grid {
  SampleKind kind;
  int s;
  int rows;
  int cols;

  Grid(SampleKind of, int halfSize) : kind(of), s(halfSize) {
    const int n = kTileCells / (2 * s);
    rows = kind == SampleKind::HorizontalEdge ? n + 1 : n;
    cols = kind == SampleKind::VerticalEdge ? n + 1 : n;
  }
  int indexOf(int x, int y) const {
    const int left = kind == SampleKind::VerticalEdge ? 2 * x * s : (2 * x + 1) * s;
    const int top = kind == SampleKind::HorizontalEdge ? 2 * y * s : (2 * y + 1) * s;
    return top * kTileSamples + left;
  }
  /// The hypotenuse's ends stand so far before and behind a sample.
  int toEnd(int x, int y) const {
    const int up = s * kTileSamples;
    switch (kind) {
      case SampleKind::QuadCenter:
        return (x + y) % 2 == 0 ? up + s : up - s;
      case SampleKind::HorizontalEdge:
        return s;
      case SampleKind::VerticalEdge:
        break;
    }
    return up;
  }
  /// So do the apexes, as far as they are in the tile.
  int toApex(int x, int y) const {
    const int up = s * kTileSamples;
    switch (kind) {
      case SampleKind::QuadCenter:
        return (x + y) % 2 == 0 ? up - s : up + s;
      case SampleKind::HorizontalEdge:
        return up;
      case SampleKind::VerticalEdge:
        break;
    }
    return s;
  }
  bool hasFirstApex(int x, int y) const {
    return kind == SampleKind::QuadCenter || (kind == SampleKind::HorizontalEdge ? y > 0 : x > 0);
  }
  bool hasSecondApex(int x, int y) const {
    return kind == SampleKind::QuadCenter ||
           (kind == SampleKind::HorizontalEdge ? y < rows - 1 : x < cols - 1);
  }
  /// Has a sample an apex that is Interpolated?
  bool hasInterpolatedParent(int x, int y, const SampleState* states) const {
    const int at = indexOf(x, y);
    const int apex = toApex(x, y);
    return (hasFirstApex(x, y) && states[at - apex] == SampleState::Interpolated) ||
           (hasSecondApex(x, y) && states[at + apex] == SampleState::Interpolated);
  }
};

inline constexpr std::array<SampleKind, kSampleKinds> kKinds = {
    SampleKind::QuadCenter, SampleKind::HorizontalEdge, SampleKind::VerticalEdge};

/// What one kind's predictions missed, where others need it.
inline int32_t* missesRow(LevelPlanes& planes, SampleKind kind, int y) {
  return kind == SampleKind::QuadCenter       ? planes.quadMisses.row(y)
         : kind == SampleKind::HorizontalEdge ? planes.horizontalMisses.row(y)
                                              : nullptr;
}

/// A sample that is not coded has, as a step number, the mean of its ends: what the bend is measured from.
inline int32_t meanOfEnds(const RowPrediction& predicted, int x) {
  const auto at = static_cast<size_t>(x);
  return static_cast<int32_t>(2 * static_cast<uint32_t>(predicted.values[at]) -
                              static_cast<uint32_t>(predicted.bend[at])) >>
         1;
}

}  // namespace terrane
