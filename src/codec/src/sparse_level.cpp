#include "sparse_level.h"

namespace terrane {

void SparseLevel::begin(int s, bool closed, const SampleState* states) {
  closed_ = closed;
  states_.begin(s, states);
}

void SparseLevel::beginPass(const Grid& grid) {
  kind_ = grid.kind;
  for (RowResiduals& residuals : residuals_) residuals.fill(0);
  // What edges are asked about follows from the quad-centres.
  if (kind_ == SampleKind::VerticalEdge) return;
  takeAsked(kind_, grid.rows);
  if (kind_ == SampleKind::HorizontalEdge) takeAsked(SampleKind::VerticalEdge, grid.rows - 1);
}

void SparseLevel::takeAsked(SampleKind kind, int rows) {
  std::vector<RowBits>& asked = asked_[static_cast<size_t>(kind)];
  asked.assign(static_cast<size_t>(rows + 2), RowBits());
  const RowBits& inside = states_.of(kind).inside();
  for (int y = 0; y < rows; ++y) {
    RowBits& row = asked[static_cast<size_t>(y + 1)];
    row = closed_ ? inside & ~states_.withInterpolatedParent(kind, y) : inside;
  }
}

uint32_t SparseLevel::eightsOf(SampleKind kind, int y) const {
  const RowBits& asked = askedIn(kind, y);
  if (kind != SampleKind::HorizontalEdge) return asked.eights();
  const RowBits beside = askedIn(SampleKind::VerticalEdge, y - 1) | askedIn(SampleKind::VerticalEdge, y);
  return (asked | beside | beside.fromEast()).eights();
}

uint32_t SparseLevel::eightsOfQuadMisses(int y) const {
  const RowBits across = askedIn(SampleKind::HorizontalEdge, y) | askedIn(SampleKind::HorizontalEdge, y + 1);
  const RowBits along = askedIn(SampleKind::VerticalEdge, y - 1) | askedIn(SampleKind::VerticalEdge, y) |
                        askedIn(SampleKind::VerticalEdge, y + 1);
  return (across | across.fromEast() | across.fromWest() | along | along.fromEast()).eights();
}

}  // namespace terrane
