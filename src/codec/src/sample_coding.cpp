#include "sample_coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include "questions.h"
#include "rans.h"
#include "sample_lattice.h"
#include "sample_prediction.h"
#include "terrane/base/check.h"

namespace terrane {
namespace {

/// How far a tile's numbers are spread, compared with what their contexts say: one number for each octave.
constexpr int kOctaves = kSizeContexts / 4;
using SpreadShifts = std::array<int8_t, kOctaves>;

/// Contexts of the question "is it void", by how many of four neighbours are, and by the samples of the same
/// kind to the west and north.
constexpr int kVoidContexts = 22;
/// Runs of so many samples are asked about together where all around them is void, or nothing is: the last
/// two contexts.
constexpr int kRun = 16;
constexpr size_t kRunContext = 20;
/// Contexts of the question "has it a height of its own", by bend and expected size of a miss.
constexpr int kBendClasses = 6;
constexpr int kSizeClasses = 8;
constexpr int kOwnContexts = kBendClasses * kSizeClasses;

uint8_t spreadOf(uint8_t context, const SpreadShifts& shifts) {
  return static_cast<uint8_t>(std::clamp(context + shifts[context >> 2], 0, kSpreads - 1));
}

int ownContext(int32_t bend, uint8_t context) {
  const auto size = static_cast<uint32_t>(std::abs(static_cast<int64_t>(bend)));
  const int bendClass = size < 3 ? 0 : size < 5 ? 1 : size < 7 ? 2 : size < 10 ? 3 : size < 16 ? 4 : 5;
  const int sizeClass = std::clamp((context - 4) / 3, 0, kSizeClasses - 1);
  return bendClass * kSizeClasses + sizeClass;
}
/// Odds that suit most ground.
int usualOwnOdds(int context) {
  return std::clamp(16 + 3 * (context / kSizeClasses) + (context % kSizeClasses), 1, kOddsSteps - 1);
}
int usualVoidOdds(int context) {
  if (context >= static_cast<int>(kRunContext)) return 4;
  static constexpr std::array<int, 5> kUsual = {4, 16, 24, 32, 44};
  const int odds =
      kUsual[static_cast<size_t>(context % 5)] + (context / 5 % 2 == 0 ? -4 : 4) + (context < 10 ? -4 : 4);
  return std::clamp(odds, 1, kOddsSteps - 1);
}

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

  /// The hypotenuse's ends and the apexes of a sample; an apex beyond the tile is -1.
  struct Around {
    int endA, endB, apexA, apexB;
  };
  Around around(int x, int y) const {
    const int at = indexOf(x, y);
    const int up = s * kTileSamples;
    switch (kind) {
      case SampleKind::QuadCenter: {
        const int turn = (x + y) % 2 == 0 ? s : -s;
        return {at - up - turn, at + up + turn, at - up + turn, at + up - turn};
      }
      case SampleKind::HorizontalEdge:
        return {at - s, at + s, y == 0 ? -1 : at - up, y == rows - 1 ? -1 : at + up};
      case SampleKind::VerticalEdge:
        break;
    }
    return {at - up, at + up, x == 0 ? -1 : at - s, x == cols - 1 ? -1 : at + s};
  }
};

/// What the states around a sample say of its own before it is known.
struct StateHint {
  int voids = 0;          ///< of four neighbours
  bool impliedByParents;  ///< an apex is Interpolated: so is the sample, where the tile is closed
};
StateHint hintOf(const Grid::Around& around, const SampleState* states) {
  const auto isVoid = [&](int at) { return states[at] == SampleState::Void ? 1 : 0; };
  const int endA = isVoid(around.endA);
  const int endB = isVoid(around.endB);
  StateHint hint{};
  hint.voids = endA + endB + (around.apexA < 0 ? endA : isVoid(around.apexA)) +
               (around.apexB < 0 ? endB : isVoid(around.apexB));
  const auto isInterpolated = [&](int at) { return at >= 0 && states[at] == SampleState::Interpolated; };
  hint.impliedByParents = isInterpolated(around.apexA) || isInterpolated(around.apexB);
  return hint;
}

/// The context of whether a sample is void.
size_t voidContext(const Grid& grid, int x, int y, const SampleState* states) {
  const int voids = hintOf(grid.around(x, y), states).voids;
  const auto isVoid = [&](int dx, int dy) {
    return states[grid.indexOf(x + dx, y + dy)] == SampleState::Void;
  };
  const bool west = x > 0 ? isVoid(-1, 0) : voids >= 2;
  const bool north = y > 0 ? isVoid(0, -1) : voids >= 2;
  return static_cast<size_t>(voids + (west ? 5 : 0) + (north ? 10 : 0));
}

/// What is around a run of samples: nothing void, all void, or some.
enum class RunAround : uint8_t { Ground = 0, Void = 1, Both = 2 };
RunAround aroundRun(const Grid& grid, int x, int end, int y, const SampleState* states) {
  bool anyVoid = false;
  bool anyGround = false;
  const auto look = [&](int at) {
    if (at < 0) return;
    anyVoid |= states[at] == SampleState::Void;
    anyGround |= states[at] != SampleState::Void;
  };
  for (; x < end; ++x) {
    const auto [endA, endB, apexA, apexB] = grid.around(x, y);
    look(endA);
    look(endB);
    look(apexA);
    look(apexB);
  }
  return anyVoid && anyGround ? RunAround::Both : anyVoid ? RunAround::Void : RunAround::Ground;
}

/// Is a row surely without Void around it? Samples that are not known yet must not be Void.
bool isGroundAround(const Grid& grid, int y, const SampleState* states) {
  const int middle = grid.indexOf(0, y) / kTileSamples;
  const auto holdsVoid = [&](int row) {
    return row >= 0 && row < kTileSamples &&
           std::memchr(states + row * kTileSamples, static_cast<int>(SampleState::Void), kTileSamples) !=
               nullptr;
  };
  return !holdsVoid(middle - grid.s) && !holdsVoid(middle) && !holdsVoid(middle + grid.s);
}

/// Nearest step numbers of heights; exact doubles in a fixed order, so that every machine gets the same.
class StepsOfHeights {
 public:
  explicit StepsOfHeights(const ElevationScale& scale)
      : offset_(scale.heightOffset), stepsPerMeter_(1.0 / scale.heightStep) {}
  int32_t operator()(float height) const {
    const double steps = (static_cast<double>(height) - offset_) * stepsPerMeter_;
    // note: clamped and made positive before the cast, which is then the floor and never out of range.
    return static_cast<int32_t>(std::min(std::max(steps, -kLimit), kLimit) + (kLimit + 0.5)) -
           static_cast<int32_t>(kLimit);
  }

 private:
  static constexpr double kLimit = 1 << 25;
  double offset_;
  double stepsPerMeter_;
};

void resizePlanes(LevelPlanes& planes, int n) {
  planes.corners.resize(n + 1, n + 1);
  planes.quads.resize(n, n);
  planes.horizontal.resize(n + 1, n);
  planes.vertical.resize(n, n + 1);
  planes.quadMisses.resize(n, n);
  planes.horizontalMisses.resize(n + 1, n);
}

void takeCorners(const TileSamples& samples, int s, const ElevationScale& scale, LevelPlanes& planes) {
  const StepsOfHeights steps(scale);
  const int n = kTileCells / (2 * s);
  std::array<float, kTileSamples> heights;
  for (int y = 0; y <= n; ++y) {
    const float* from = samples.heights.data() + 2 * y * s * kTileSamples;
    int32_t* to = planes.corners.row(y);
    for (int x = 0; x <= n; ++x) heights[static_cast<size_t>(x)] = from[2 * x * s];
    for (int x = 0; x <= n; ++x) to[x] = steps(heights[static_cast<size_t>(x)]);
  }
  planes.corners.extend();
}

/// What one kind's predictions missed, where others need it.
int32_t* missesRow(LevelPlanes& planes, SampleKind kind, int y) {
  return kind == SampleKind::QuadCenter       ? planes.quadMisses.row(y)
         : kind == SampleKind::HorizontalEdge ? planes.horizontalMisses.row(y)
                                              : nullptr;
}
void finishPlane(LevelPlanes& planes, SampleKind kind) {
  planes.of(kind).extend();
  if (kind == SampleKind::QuadCenter) planes.quadMisses.repeat();
  if (kind == SampleKind::HorizontalEdge) planes.horizontalMisses.repeat();
}

/// A sample that is not coded has, as a step number, the mean of its ends: what the bend is measured from.
int32_t meanOfEnds(const RowPrediction& predicted, int x) {
  const auto at = static_cast<size_t>(x);
  return static_cast<int32_t>(2 * static_cast<uint32_t>(predicted.values[at]) -
                              static_cast<uint32_t>(predicted.bend[at])) >>
         1;
}

/// Work space that lives as long as its thread: a tile is no reason to allocate.
struct Scratch {
  LevelPlanes planes;
  RowPrediction predicted;
  std::array<std::vector<int32_t>, kSampleKinds> residuals;
  std::array<std::vector<uint8_t>, kSampleKinds> contexts;
  std::vector<uint8_t> counts;
};
Scratch& scratchOfThread() {
  thread_local Scratch scratch;
  return scratch;
}

constexpr std::array<SampleKind, kSampleKinds> kKinds = {SampleKind::QuadCenter, SampleKind::HorizontalEdge,
                                                         SampleKind::VerticalEdge};

// -------------------------------------------------------------------------------------------- encoding

/// How often each small number stands in each context, to choose spreads by.
class SpreadChooser {
 public:
  void add(const std::vector<uint8_t>& contexts, const std::vector<int32_t>& residuals) {
    for (size_t i = 0; i < residuals.size(); ++i) {
      const auto size = static_cast<uint32_t>(std::abs(residuals[i]));
      ++counts_[contexts[i]][std::min(size, kBins - 1)];
      sizes_[contexts[i]] += size;
    }
  }

  SpreadShifts choose() const {
    SpreadShifts shifts{};
    int last = 0;
    for (int octave = 0; octave < kOctaves; ++octave) {
      uint64_t count = 0;
      uint64_t size = 0;
      for (size_t context = 4 * static_cast<size_t>(octave); context < 4 * static_cast<size_t>(octave) + 4;
           ++context) {
        for (const uint32_t n : counts_[context]) count += n;
        size += sizes_[context];
      }
      if (count > 0) last = bestShift(octave, static_cast<double>(size) / static_cast<double>(count), last);
      shifts[static_cast<size_t>(octave)] = static_cast<int8_t>(last);
    }
    return shifts;
  }

 private:
  static constexpr uint32_t kBins = 64;

  int bestShift(int octave, double meanSize, int last) const {
    // Where numbers are large, their mean size says it all.
    const double middle = 4.0 * (std::log2(std::max(meanSize, 0.02)) + 4.0);
    const int guess = std::clamp(static_cast<int>(std::lround(middle - 4 * octave - 1.5)), -60, 60);
    if (meanSize > 8.0) return guess;
    const auto costOf = [&](int shift) {
      double bits = 1.0 + 2.0 * std::bit_width(static_cast<uint32_t>(2 * std::abs(shift - last)));
      for (int context = 4 * octave; context < 4 * octave + 4; ++context) {
        const int spread = std::clamp(context + shift, 0, kSpreads - 1);
        const auto& costs = costTable()[static_cast<size_t>(spread)];
        const auto& counts = counts_[static_cast<size_t>(context)];
        for (size_t i = 0; i < kBins; ++i) bits += static_cast<double>(costs[i]) * counts[i];
      }
      return bits;
    };
    int best = last;
    double least = costOf(last);
    for (int shift = guess - 3; shift <= guess + 3; ++shift) {
      const double bits = costOf(shift);
      if (bits < least) {
        least = bits;
        best = shift;
      }
    }
    return best;
  }

  using CostTable = std::array<std::array<float, kBins>, kSpreads>;
  static const CostTable& costTable() {
    static const CostTable table = [] {
      CostTable made;
      for (size_t spread = 0; spread < kSpreads; ++spread) {
        for (size_t size = 0; size < kBins; ++size) {
          const auto value = static_cast<int32_t>(size);
          const float bits = spreadTables().cost(static_cast<int>(spread), value) +
                             spreadTables().cost(static_cast<int>(spread), -value);
          made[spread][size] = 0.5F * bits;
        }
      }
      return made;
    }();
    return table;
  }

  std::array<std::array<uint32_t, kBins>, kSizeContexts> counts_{};
  std::array<uint64_t, kSizeContexts> sizes_{};
};

void writeWeights(SampleKind kind, const PairWeights& weights, SegmentWriter& out) {
  const PairWeights& usual = usualWeights(kind);
  out.plain(weights == usual ? 0 : 1, 1);
  if (weights == usual) return;
  for (size_t i = 0; i < static_cast<size_t>(pairCount(kind)); ++i) out.plainNumber(weights[i] - usual[i]);
}
bool readWeights(SampleKind kind, SegmentReader& in, PairWeights& weights) {
  weights = usualWeights(kind);
  if (in.plain(1) == 0) return true;
  bool ok = true;
  for (size_t i = 0; i < static_cast<size_t>(pairCount(kind)); ++i) {
    const int64_t weight = int64_t{weights[i]} + in.plainNumber();
    ok &= weight >= -127 && weight <= 127;
    weights[i] = static_cast<int8_t>(std::clamp<int64_t>(weight, -127, 127));
  }
  return ok;
}

void writeShifts(const SpreadShifts& shifts, SegmentWriter& out) {
  int last = 0;
  for (const int8_t octave : shifts) {
    const int shift{octave};
    out.plainNumber(shift - last);
    last = shift;
  }
}
bool readShifts(SegmentReader& in, SpreadShifts& shifts) {
  int64_t last = 0;
  bool ok = true;
  for (int8_t& shift : shifts) {
    last += in.plainNumber();
    ok &= last >= -64 && last <= 64;
    last = std::clamp<int64_t>(last, -64, 64);
    shift = static_cast<int8_t>(last);
  }
  return ok;
}

/// Encodes one lattice level of a tile.
class LevelEncoder {
 public:
  LevelEncoder(const TileSamples& samples, int s, const OwnStates& states, const ElevationScale& scale)
      : samples_(samples), s_(s), ownStates_(states), scale_(scale), scratch_(scratchOfThread()) {
    resizePlanes(scratch_.planes, kTileCells / (2 * s));
    takeCorners(samples, s, scale, scratch_.planes);
  }

  void encode(std::vector<uint8_t>& out) {
    encodeKind(SampleKind::QuadCenter);
    writer_.finish(out);
    encodeKind(SampleKind::HorizontalEdge);
    encodeKind(SampleKind::VerticalEdge);
    writer_.finish(out);
  }

 private:
  void encodeKind(SampleKind kind) {
    const Grid grid(kind, s_);
    takeValues(grid);
    // Small levels and mostly interpolated tiles are not worth weights of their own.
    PairWeights weights = usualWeights(kind);
    if (codedCount_ >= 1500) weights = fitWeights(scratch_.planes, kind, scratch_.counts.data());
    writeWeights(kind, weights, writer_);

    // First what will be said, then how best to say it.
    std::vector<int32_t>& residuals = scratch_.residuals[0];
    std::vector<uint8_t>& contexts = scratch_.contexts[0];
    residuals.clear();
    contexts.clear();
    Questions<kVoidContexts> isVoid;
    Questions<kOwnContexts> isOwn;
    std::vector<std::pair<uint8_t, uint8_t>>& answers = answers_;  // context (void ones first), answer
    answers.clear();
    std::vector<size_t> answersOfRow;
    std::vector<size_t> numbersOfRow;
    const bool asks = ownStates_.isMixed();
    for (int y = 0; y < grid.rows; ++y) {
      predictRow(scratch_.planes, kind, y, weights, scratch_.predicted);
      const int32_t* values = scratch_.planes.of(kind).row(y);
      if (int32_t* misses = missesRow(scratch_.planes, kind, y))
        setMisses(values, scratch_.predicted, grid.cols, misses);
      if (asks) askRow(grid, y, isVoid, isOwn);
      const uint8_t* coded = scratch_.counts.data() + y * grid.cols;
      for (int x = 0; x < grid.cols; ++x) {
        if (coded[x] == 0) continue;
        const auto at = static_cast<size_t>(x);
        residuals.push_back(values[x] - scratch_.predicted.values[at]);
        contexts.push_back(scratch_.predicted.context[at]);
      }
      answersOfRow.push_back(answers.size());
      numbersOfRow.push_back(residuals.size());
    }
    finishPlane(scratch_.planes, kind);

    SpreadChooser chooser;
    chooser.add(contexts, residuals);
    const SpreadShifts shifts = chooser.choose();
    if (ownStates_.anyCoded) writeShifts(shifts, writer_);
    if (asks && ownStates_.anyVoid) isVoid.write(writer_, usualVoidOdds);
    if (asks && ownStates_.anyCoded && ownStates_.anyInterpolated) isOwn.write(writer_, usualOwnOdds);

    size_t answer = 0;
    size_t number = 0;
    for (size_t row = 0; row < static_cast<size_t>(grid.rows); ++row) {
      for (; answer < answersOfRow[row]; ++answer) {
        const auto [context, yes] = answers[answer];
        const int odds =
            context < kVoidContexts ? isVoid.odds[context] : isOwn.odds[context - size_t{kVoidContexts}];
        writer_.answer(odds, yes != 0);
      }
      for (; number < numbersOfRow[row]; ++number)
        writer_.number(spreadOf(contexts[number], shifts), residuals[number]);
    }
  }

  /// The kind's step numbers into its plane, and which of them are coded.
  void takeValues(const Grid& grid) {
    SamplePlane& plane = scratch_.planes.of(grid.kind);
    scratch_.counts.resize(static_cast<size_t>(grid.rows * grid.cols));
    codedCount_ = 0;
    const StepsOfHeights steps(scale_);
    std::array<int32_t, RowPrediction::kRoom> nearest;
    std::array<float, RowPrediction::kRoom> heights;
    for (int y = 0; y < grid.rows; ++y) {
      int32_t* to = plane.row(y);
      uint8_t* coded = scratch_.counts.data() + y * grid.cols;
      const int first = grid.indexOf(0, y);
      for (int x = 0; x < grid.cols; ++x)
        heights[static_cast<size_t>(x)] = samples_.heights[static_cast<size_t>(first + 2 * x * s_)];
      for (int x = 0; x < grid.cols; ++x)
        nearest[static_cast<size_t>(x)] = steps(heights[static_cast<size_t>(x)]);
      for (int x = 0; x < grid.cols; ++x) {
        const int at = first + 2 * x * s_;
        const bool isCoded = samples_.states[static_cast<size_t>(at)] == SampleState::Coded;
        coded[x] = isCoded ? 1 : 0;
        if (isCoded) {
          ++codedCount_;
          const int32_t q = nearest[static_cast<size_t>(x)];
          const float height = heights[static_cast<size_t>(x)];
          const bool isExact = std::abs(q) <= kLargestInteger && scale_.heightFromInteger(q) == height;
          to[x] = isExact ? q : integerOfCoded(height, scale_);
        } else {
          to[x] = meanOfNotCoded(grid, x, y);
        }
      }
    }
  }

  int32_t meanOfNotCoded(const Grid& grid, int x, int y) const {
    const SamplePlane& corners = scratch_.planes.corners;
    const auto [endA, endB, apexA, apexB] = grid.around(x, y);
    const float* heights = samples_.heights.data();
    const float expected = (heights[endA] + heights[endB]) * 0.5F;
    const int center = grid.indexOf(x, y);
    TERRANE_CHECK(heights[center] == expected, "sample {}: {} m instead of its ends' mean {} m", center,
                  heights[center], expected);
    const auto at = [&](int index) {
      return static_cast<uint32_t>(
          corners.row(index / kTileSamples / (2 * s_))[index % kTileSamples / (2 * s_)]);
    };
    return static_cast<int32_t>(at(endA) + at(endB)) >> 1;
  }

  void askRow(const Grid& grid, int y, Questions<kVoidContexts>& isVoid, Questions<kOwnContexts>& isOwn) {
    const SampleState* states = samples_.states.data();
    const auto answer = [&](size_t context, bool yes) {
      ++isVoid.counts[context][yes ? 1 : 0];
      answers_.emplace_back(static_cast<uint8_t>(context), yes);
    };
    for (int x = 0; x < grid.cols && ownStates_.anyVoid; x += kRun) {
      const int end = std::min(x + kRun, grid.cols);
      const RunAround around = aroundRun(grid, x, end, y, states);
      if (around != RunAround::Both) {
        bool differs = false;
        for (int at = x; at < end; ++at) {
          const bool yes = states[grid.indexOf(at, y)] == SampleState::Void;
          differs |= yes != (around == RunAround::Void);
        }
        answer(kRunContext + static_cast<size_t>(around), differs);
        if (!differs) continue;
      }
      for (int at = x; at < end; ++at)
        answer(voidContext(grid, at, y, states), states[grid.indexOf(at, y)] == SampleState::Void);
    }
    if (!ownStates_.anyInterpolated || !ownStates_.anyCoded) return;
    for (int x = 0; x < grid.cols; ++x) {
      const SampleState state = states[grid.indexOf(x, y)];
      if (state == SampleState::Void) continue;
      if (ownStates_.closed && hintOf(grid.around(x, y), states).impliedByParents) continue;
      const auto at = static_cast<size_t>(x);
      const auto context =
          static_cast<size_t>(ownContext(scratch_.predicted.bend[at], scratch_.predicted.context[at]));
      const bool yes = state == SampleState::Coded;
      ++isOwn.counts[context][yes ? 1 : 0];
      answers_.emplace_back(static_cast<uint8_t>(context + kVoidContexts), yes);
    }
  }

  const TileSamples& samples_;
  int s_;
  OwnStates ownStates_;
  const ElevationScale& scale_;
  Scratch& scratch_;
  SegmentWriter writer_;
  std::vector<std::pair<uint8_t, uint8_t>> answers_;
  int codedCount_ = 0;
};

// -------------------------------------------------------------------------------------------- decoding

/// Decodes one lattice level of a tile.
class LevelDecoder {
 public:
  LevelDecoder(int s, const OwnStates& states, const ElevationScale& scale, TileSamples& samples)
      : samples_(samples), s_(s), ownStates_(states), scale_(scale), scratch_(scratchOfThread()) {
    resizePlanes(scratch_.planes, kTileCells / (2 * s));
    takeCorners(samples, s, scale, scratch_.planes);
  }

  Result<size_t> decode(std::span<const uint8_t> bytes) {
    size_t start = 0;
    for (const bool isEdges : {false, true}) {
      size_t used = 0;
      auto opened = SegmentReader::open(bytes.subspan(start), used);
      if (!opened.ok()) return makeError("{} (of a segment at byte {})", opened.error().message, start);
      SegmentReader& in = *opened;
      bool ok = true;
      if (isEdges) {
        ok = decodeKind(SampleKind::HorizontalEdge, in) && decodeKind(SampleKind::VerticalEdge, in);
      } else {
        ok = decodeKind(SampleKind::QuadCenter, in);
      }
      if (outOfRange_) {
        return makeError("byte {}: a height is beyond 2^24 steps of {} m", start, scale_.heightStep);
      }
      if (!ok || !in.finish()) return makeError("byte {}: the segment's symbols are damaged", start);
      start += used;
    }
    return start;
  }

 private:
  bool decodeKind(SampleKind kind, SegmentReader& in) {
    const Grid grid(kind, s_);
    PairWeights weights;
    SpreadShifts shifts{};
    Questions<kVoidContexts> isVoid;
    Questions<kOwnContexts> isOwn;
    const bool asks = ownStates_.isMixed();
    bool ok = readWeights(kind, in, weights);
    if (ownStates_.anyCoded) ok &= readShifts(in, shifts);
    if (asks && ownStates_.anyVoid) ok &= isVoid.read(in, usualVoidOdds);
    if (asks && ownStates_.anyCoded && ownStates_.anyInterpolated) ok &= isOwn.read(in, usualOwnOdds);
    if (!ok) return false;

    std::array<uint8_t, kSizeContexts> spreads;
    for (size_t context = 0; context < kSizeContexts; ++context)
      spreads[context] = spreadOf(static_cast<uint8_t>(context), shifts);
    for (int y = 0; y < grid.rows; ++y) {
      predictRow(scratch_.planes, kind, y, weights, scratch_.predicted);
      if (asks) {
        decodeStates(grid, y, isVoid, isOwn, in);
        if (const auto range = codedRange(grid, y)) {
          decodeRange(grid, y, range->first, range->second, spreads, in);
        } else {
          decodeSome(grid, y, spreads, in);
        }
      } else {
        const SampleState all = ownStates_.anyVoid    ? SampleState::Void
                                : ownStates_.anyCoded ? SampleState::Coded
                                                      : SampleState::Interpolated;
        SampleState* states = samples_.states.data() + grid.indexOf(0, y);
        // note: what is not known yet is Coded.
        for (int x = 0; x < grid.cols && all != SampleState::Coded; ++x) states[2 * x * s_] = all;
        if (ownStates_.anyCoded) {
          decodeRange(grid, y, 0, grid.cols, spreads, in);
          continue;
        }
        decodeSome(grid, y, spreads, in);
      }
      if (int32_t* misses = missesRow(scratch_.planes, kind, y))
        setMisses(scratch_.planes.of(kind).row(y), scratch_.predicted, grid.cols, misses);
    }
    finishPlane(scratch_.planes, kind);
    return !outOfRange_;
  }

  void decodeStates(const Grid& grid, int y, const Questions<kVoidContexts>& isVoid,
                    const Questions<kOwnContexts>& isOwn, SegmentReader& in) {
    SampleState* states = samples_.states.data();
    const SampleState ground = ownStates_.anyInterpolated ? SampleState::Interpolated : SampleState::Coded;
    const bool isAllGround = !ownStates_.anyVoid || isGroundAround(grid, y, states);
    for (int x = 0; x < grid.cols; x += kRun) {
      const int end = std::min(x + kRun, grid.cols);
      const RunAround around = isAllGround ? RunAround::Ground : aroundRun(grid, x, end, y, states);
      const bool isAlike =
          !ownStates_.anyVoid ||
          (around != RunAround::Both && !in.answer(isVoid.odds[kRunContext + static_cast<size_t>(around)]));
      for (int at = x; at < end; ++at) {
        const bool yes =
            isAlike ? around == RunAround::Void : in.answer(isVoid.odds[voidContext(grid, at, y, states)]);
        states[grid.indexOf(at, y)] = yes ? SampleState::Void : ground;
      }
    }
    if (!ownStates_.anyInterpolated || !ownStates_.anyCoded) return;
    for (int x = 0; x < grid.cols; ++x) {
      SampleState& state = states[grid.indexOf(x, y)];
      if (state == SampleState::Void) continue;
      if (ownStates_.closed && hintOf(grid.around(x, y), states).impliedByParents) continue;
      const auto at = static_cast<size_t>(x);
      const int context = ownContext(scratch_.predicted.bend[at], scratch_.predicted.context[at]);
      if (in.answer(isOwn.odds[static_cast<size_t>(context)])) state = SampleState::Coded;
    }
  }

  /// The first and one past the last coded sample of a row, where all between are coded as well.
  std::optional<std::pair<int, int>> codedRange(const Grid& grid, int y) const {
    const SampleState* states = samples_.states.data() + grid.indexOf(0, y);
    const auto isCoded = [&](int x) { return states[2 * x * s_] == SampleState::Coded; };
    int first = 0;
    int end = grid.cols;
    while (first < end && !isCoded(first)) ++first;
    while (first < end && !isCoded(end - 1)) --end;
    for (int x = first; x < end; ++x) {
      if (!isCoded(x)) return std::nullopt;
    }
    return std::pair(first, end);
  }

  /// A row of which the samples from `first` to before `end` are coded, and no others.
  void decodeRange(const Grid& grid, int y, int first, int end,
                   const std::array<uint8_t, kSizeContexts>& spreadOfContext, SegmentReader& in) {
    const RowPrediction& predicted = scratch_.predicted;
    std::array<uint8_t, RowPrediction::kRoom> spreads;
    std::array<int32_t, RowPrediction::kRoom> residuals;
    std::array<float, RowPrediction::kRoom> heights;
    const int count = end - first;
    for (size_t i = 0; i < static_cast<size_t>(count); ++i)
      spreads[i] = spreadOfContext[predicted.context[static_cast<size_t>(first) + i]];
    in.numbers(spreads.data(), count, residuals.data());
    int32_t* values = scratch_.planes.of(grid.kind).row(y);
    int32_t* misses = missesRow(scratch_.planes, grid.kind, y);
    std::array<int32_t, RowPrediction::kRoom> unused;
    outOfRange_ |=
        !addResiduals(predicted.values.data() + first, residuals.data(), count, scale_, values + first,
                      misses != nullptr ? misses + first : unused.data(), heights.data());
    float* to = samples_.heights.data() + grid.indexOf(first, y);
    if (s_ == 1) {
      for (int i = 0; i < count; ++i) to[2 * i] = heights[static_cast<size_t>(i)];
    } else {
      for (int i = 0; i < count; ++i) to[2 * i * s_] = heights[static_cast<size_t>(i)];
    }
    if (count == grid.cols) return;
    for (int x = 0; x < first; ++x) takeMean(grid, x, y, values);
    for (int x = end; x < grid.cols; ++x) takeMean(grid, x, y, values);
  }

  /// A sample that is not coded.
  void takeMean(const Grid& grid, int x, int y, int32_t* values) {
    values[x] = meanOfEnds(scratch_.predicted, x);
    const auto [endA, endB, apexA, apexB] = grid.around(x, y);
    float* heights = samples_.heights.data();
    heights[grid.indexOf(x, y)] = (heights[endA] + heights[endB]) * 0.5F;
  }

  /// A row of which only some samples are coded.
  void decodeSome(const Grid& grid, int y, const std::array<uint8_t, kSizeContexts>& spreadOfContext,
                  SegmentReader& in) {
    const RowPrediction& predicted = scratch_.predicted;
    const SampleState* states = samples_.states.data();
    float* heights = samples_.heights.data();
    std::array<uint8_t, RowPrediction::kRoom> spreads;
    std::array<int32_t, RowPrediction::kRoom> residuals;
    int count = 0;
    for (int x = 0; x < grid.cols; ++x) {
      if (states[grid.indexOf(x, y)] != SampleState::Coded) continue;
      spreads[static_cast<size_t>(count++)] = spreadOfContext[predicted.context[static_cast<size_t>(x)]];
    }
    in.numbers(spreads.data(), count, residuals.data());
    int32_t* values = scratch_.planes.of(grid.kind).row(y);
    size_t next = 0;
    for (int x = 0; x < grid.cols; ++x) {
      const int index = grid.indexOf(x, y);
      if (states[index] == SampleState::Coded) {
        values[x] = static_cast<int32_t>(static_cast<uint32_t>(predicted.values[static_cast<size_t>(x)]) +
                                         static_cast<uint32_t>(residuals[next++]));
        outOfRange_ |= values[x] > kLargestInteger || values[x] < -kLargestInteger;
        heights[index] = scale_.heightFromInteger(values[x]);
      } else {
        takeMean(grid, x, y, values);
      }
    }
  }

  TileSamples& samples_;
  int s_;
  OwnStates ownStates_;
  const ElevationScale& scale_;
  Scratch& scratch_;
  bool outOfRange_ = false;
};

}  // namespace

int32_t integerOfCoded(float height, const ElevationScale& scale) {
  const int64_t nearest = scale.integerFromHeight(static_cast<double>(height));
  // Where a float is coarser than the step, a neighbour's height may be nearer than its own.
  for (const int64_t q : {nearest, nearest - 1, nearest + 1}) {
    if (std::abs(q) <= kLargestInteger && scale.heightFromInteger(q) == height)
      return static_cast<int32_t>(q);
  }
  TERRANE_CHECK(false, "coded sample at {} m is not on the step {} or beyond 2^24 steps", height,
                scale.heightStep);
}

OwnStates ownStatesOf(const std::vector<SampleState>& states, bool isRoot) {
  OwnStates own;
  if (std::all_of(states.begin(), states.end(), [](SampleState s) { return s == SampleState::Coded; })) {
    own.anyCoded = true;
    return own;
  }
  for (int s = isRoot ? kCoarsestHalfSize : 1; s >= 1; s /= 2) {
    for (const SampleKind kind : kKinds) {
      const Grid grid(kind, s);
      for (int y = 0; y < grid.rows; ++y) {
        for (int x = 0; x < grid.cols; ++x) {
          const SampleState state = states[static_cast<size_t>(grid.indexOf(x, y))];
          own.anyVoid |= state == SampleState::Void;
          own.anyInterpolated |= state == SampleState::Interpolated;
          own.anyCoded |= state == SampleState::Coded;
        }
      }
      if (!own.anyCoded) continue;
      for (int y = 0; y < grid.rows; ++y) {
        for (int x = 0; x < grid.cols; ++x) {
          if (states[static_cast<size_t>(grid.indexOf(x, y))] != SampleState::Coded) continue;
          own.closed = own.closed && !hintOf(grid.around(x, y), states.data()).impliedByParents;
        }
      }
    }
  }
  return own;
}

void encodeLevel(const TileSamples& samples, int s, const OwnStates& states, const ElevationScale& scale,
                 std::vector<uint8_t>& out) {
  LevelEncoder(samples, s, states, scale).encode(out);
}

Result<size_t> decodeLevel(std::span<const uint8_t> bytes, int s, const OwnStates& states,
                           const ElevationScale& scale, TileSamples& samples) {
  return LevelDecoder(s, states, scale, samples).decode(bytes);
}

}  // namespace terrane
