#include "terrane/codec/mesh_relief.h"

#include <algorithm>
#include <limits>

#include "find_relief.h"

namespace terrane {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kSquaresAlongHeight = 4;

int patchHeight(int level) {
  return kTileCells >> (level + 1) / 2;
}

/// Codes of one patch. note: floats round; each code is held against what it stands for.
class PatchCoder {
 public:
  explicit PatchCoder(std::vector<uint8_t>& out) : out_(out) {}
  void take(float height) {
    heights_.push_back(height);
    low_ = std::min(low_, height);
    high_ = std::max(high_, height);
  }
  /// The first `tops` are rounded up, the others down.
  MeshRelief::Range finish(int tops) {
    const MeshRelief::Range range{low_, (high_ - low_) / 254.0F};
    for (size_t i = 0; i < heights_.size(); ++i) {
      const float steps = range.unitMeters > 0.0F ? (heights_[i] - low_) / range.unitMeters : 0.0F;
      int code = std::clamp(static_cast<int>(steps), 0, 255);
      if (i < static_cast<size_t>(tops)) {
        while (code < 255 && range.height(static_cast<uint8_t>(code)) < heights_[i]) ++code;
      } else {
        while (code > 0 && range.height(static_cast<uint8_t>(code)) > heights_[i]) --code;
      }
      out_.push_back(static_cast<uint8_t>(code));
    }
    heights_.clear();
    low_ = kInfinity;
    high_ = -kInfinity;
    return range;
  }

 private:
  std::vector<uint8_t>& out_;
  std::vector<float> heights_;
  float low_ = kInfinity, high_ = -kInfinity;
};

}  // namespace

int reliefStep(int level) {
  return std::max(patchHeight(level) / kSquaresAlongHeight, 1);
}

ReliefCounts reliefCounts(int level, const PatchOutline& outline) {
  const int n = patchHeight(level) / reliefStep(level);
  if (level % 2 == 0) return {n * (n + 1) / 2, n * (n + 1) / 2, n * (n + 1) / 2};
  const bool isWide = outline.right - outline.left > outline.bottom - outline.top;
  // Lines beside the hypotenuse get shorter by two squares, those across it by one.
  return {n * (n + 1), isWide ? n * (n + 1) : n * n, isWide ? n * n : n * (n + 1)};
}

ReliefFinder::ReliefFinder(std::span<const float> own, std::span<const float> coarse, int level)
    : level_(level), step_(reliefStep(level)), squares_(kTileCells / step_) {
  const auto count = static_cast<size_t>(squares_);
  onRows_.assign((count + 1) * count, kInfinity);
  onColumns_.assign((count + 1) * count, kInfinity);
  tops_.assign(count * count, -kInfinity);
  for (int y = 0; y < kTileSamples; ++y) {
    const float* ownRow = own.data() + y * kTileSamples;
    const float* coarseRow = coarse.data() + y * kTileSamples;
    // The squares that the row lies in: where it is between two, in both.
    const int after = std::min(y / step_, squares_ - 1), before = std::max(y - 1, 0) / step_;
    for (int square = 0; square < squares_; ++square) {
      float low = kInfinity, high = -kInfinity;
      for (int x = square * step_; x <= (square + 1) * step_; ++x) {
        low = std::min(low, std::min(ownRow[x], coarseRow[x]));
        high = std::max(high, std::max(ownRow[x], coarseRow[x]));
      }
      top(square, before) = std::max(top(square, before), high);
      top(square, after) = std::max(top(square, after), high);
      if (y % step_ == 0) onRow(y / step_, square) = low;
    }
    for (int column = 0; column <= squares_; ++column) {
      const float low = std::min(ownRow[column * step_], coarseRow[column * step_]);
      onColumn(column, before) = std::min(onColumn(column, before), low);
      onColumn(column, after) = std::min(onColumn(column, after), low);
    }
  }
}

void ReliefFinder::add(const MeshPoint (&corners)[3], float low, float high) {
  const auto [left, right] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
  const auto [upper, lower] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const int firstColumn = left / step_, lastColumn = std::min(right / step_, squares_ - 1);
  const int firstRow = upper / step_, lastRow = std::min(lower / step_, squares_ - 1);
  for (int row = (upper + step_ - 1) / step_; row * step_ <= lower; ++row)
    for (int square = firstColumn; square <= lastColumn; ++square)
      onRow(row, square) = std::min(onRow(row, square), low);
  for (int column = (left + step_ - 1) / step_; column * step_ <= right; ++column)
    for (int square = firstRow; square <= lastRow; ++square)
      onColumn(column, square) = std::min(onColumn(column, square), low);
  for (int row = firstRow; row <= lastRow; ++row)
    for (int column = firstColumn; column <= lastColumn; ++column)
      top(column, row) = std::max(top(column, row), high);
}

MeshRelief ReliefFinder::find(bool centerFalls) const {
  MeshRelief out;
  out.step = step_;
  PatchCoder coder(out.codes);
  for (int index = 0; index < patchCount(level_); ++index) {
    const PatchOutline outline(patchCorners(level_, index, centerFalls));
    for (int y = outline.top; y < outline.bottom; y += step_) {
      const auto [from, to] = outline.inRows(y, step_);
      for (int x = from; x < to; x += step_)
        coder.take(tops_[static_cast<size_t>(y / step_ * squares_ + x / step_)]);
    }
    for (int y = outline.top; y <= outline.bottom; y += step_) {
      const auto [from, to] = outline.onRow(y);
      for (int x = from; x < to; x += step_)
        coder.take(onRows_[static_cast<size_t>(y / step_ * squares_ + x / step_)]);
    }
    for (int x = outline.left; x <= outline.right; x += step_) {
      const auto [from, to] = outline.onColumn(x);
      for (int y = from; y < to; y += step_)
        coder.take(onColumns_[static_cast<size_t>(x / step_ * squares_ + y / step_)]);
    }
    out.ranges.push_back(coder.finish(reliefCounts(level_, outline).squares));
  }
  return out;
}

}  // namespace terrane
