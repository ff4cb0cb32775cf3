#include "sample_coding.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>
#include <utility>

#include "parent_samples.h"
#include "rans.h"
#include "sample_grid.h"
#include "sample_lattice.h"
#include "sample_prediction.h"
#include "sparse_level.h"
#include "spread_chooser.h"
#include "terrane/base/check.h"

namespace terrane {
namespace {

void resizePlanes(LevelPlanes& planes, int n) {
  planes.corners.resize(n + 1, n + 1);
  planes.quads.resize(n, n);
  planes.horizontal.resize(n + 1, n);
  planes.vertical.resize(n, n + 1);
  planes.quadMisses.resize(n, n);
  planes.horizontalMisses.resize(n + 1, n);
}

void takeCorners(const TileSamples& samples, int s, const ElevationScale& scale, LevelPlanes& planes) {
  const int n = kTileCells / (2 * s);
  for (int y = 0; y <= n; ++y)
    stepsOf(samples.heights.data() + 2 * y * s * kTileSamples, 2 * s, n + 1, scale, planes.corners.row(y));
  planes.corners.extend();
}

/// Makes the rims that the passes after this one look at.
void finishPlane(LevelPlanes& planes, SampleKind kind) {
  if (kind == SampleKind::VerticalEdge) return;
  planes.of(kind).extend();
  if (kind == SampleKind::QuadCenter) planes.quadMisses.repeat();
  if (kind == SampleKind::HorizontalEdge) planes.horizontalMisses.repeat();
}

/// Work space that lives as long as its thread: a tile is no reason to allocate.
struct Scratch {
  LevelPlanes planes;
  RowPrediction predicted;
  std::vector<int32_t> residuals;
  std::vector<uint8_t> contexts;
  std::vector<uint8_t> counts;
  std::vector<float> before;  ///< heights that layers before have
  VoidLevel voids;
  SparseLevel sparse;
};
Scratch& scratchOfThread() {
  thread_local Scratch scratch;
  return scratch;
}

// -------------------------------------------------------------------------------------------- encoding

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

/// Weights by answers: are they other than the usual ones, and then eight bits for each.
template <class Coder>
void codeWeights(Coder& coder, SampleKind kind, PairWeights& weights) {
  constexpr uint32_t kRarely = 1U << (kChanceBits - 3);
  if (!coder.code(kRarely, weights != usualWeights(kind))) return;
  for (size_t i = 0; i < static_cast<size_t>(pairCount(kind)); ++i)
    weights[i] = static_cast<int8_t>(codePlain(coder, static_cast<uint8_t>(weights[i]), 8));
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
  LevelEncoder(const TileSamples& samples, int s, int layer, const OwnStates& states,
               const ElevationScale& scale, SampleModels* models)
      : samples_(samples),
        s_(s),
        layer_(layer),
        ownStates_(states),
        scale_(scale),
        models_(models),
        scratch_(scratchOfThread()) {
    resizePlanes(scratch_.planes, kTileCells / (2 * s));
    takeCorners(samples, s, scale, scratch_.planes);
    if (states.hasVoidAnswers()) scratch_.voids.begin(s, samples.states.data());
    if (states.isSparse()) scratch_.sparse.begin(s, states.closed, samples.states.data());
  }

  void encode(std::vector<uint8_t>& out) {
    encodeKind(SampleKind::QuadCenter);
    finishSegment(out);
    encodeKind(SampleKind::HorizontalEdge);
    encodeKind(SampleKind::VerticalEdge);
    finishSegment(out);
  }

 private:
  void finishSegment(std::vector<uint8_t>& out) {
    if (ownStates_.hasAnswers()) answers_.finish(out);
    if (ownStates_.hasNumbers()) numbers_.finish(out);
  }

  void encodeKind(SampleKind kind) {
    const Grid grid(kind, s_);
    takeValues(grid);
    // Small levels and mostly interpolated tiles are not worth weights of their own.
    PairWeights weights = usualWeights(kind);
    if (codedCount_ >= 1500) weights = fitWeights(scratch_.planes, kind, scratch_.counts.data());
    if (ownStates_.isSparse()) {
      encodeSparse(grid, weights);
    } else {
      encodeDense(grid, weights);
    }
    finishPlane(scratch_.planes, kind);
  }

  void encodeSparse(const Grid& grid, PairWeights weights) {
    if (ownStates_.anyCoded) codeWeights(answers_, grid.kind, weights);
    scratch_.sparse.beginPass(grid);
    for (int y = 0; y < grid.rows; ++y) {
      predictRow(scratch_.planes, grid.kind, y, allEights(grid.cols), weights, scratch_.predicted);
      encodeVoids(grid, y);
      RowBits coded;
      RowBits voids;
      const SampleState* states = samples_.states.data() + grid.indexOf(0, y);
      LevelStates::take(states, 2 * s_, grid.cols, coded, voids);
      const RowBits known = knownIn(grid, y);
      if (ownStates_.anyCoded)
        scratch_.sparse.codeRow(answers_, models_->sparse, scratch_.predicted, scratch_.planes, y, voids,
                                layer_ > 0 ? &known : nullptr, coded);
      takeMisses(grid, y);
    }
  }

  /// What layers before say of a row.
  RowBits knownIn(const Grid& grid, int y) const {
    RowBits known;
    for (int x = 0; layer_ > 0 && x < grid.cols; ++x)
      if (isKnown(static_cast<size_t>(grid.indexOf(x, y)))) known.set(x);
    return known;
  }
  bool isKnown(size_t index) const {
    return layer_ > 0 && samples_.states[index] == SampleState::Coded && samples_.layerAt(index) < layer_;
  }

  /// First what will be said, then how best to say it.
  void encodeDense(const Grid& grid, const PairWeights& weights) {
    if (ownStates_.hasNumbers()) writeWeights(grid.kind, weights, numbers_);
    std::vector<int32_t>& residuals = scratch_.residuals;
    std::vector<uint8_t>& contexts = scratch_.contexts;
    residuals.clear();
    contexts.clear();
    for (int y = 0; y < grid.rows; ++y) {
      predictRow(scratch_.planes, grid.kind, y, allEights(grid.cols), weights, scratch_.predicted);
      encodeVoids(grid, y);
      takeMisses(grid, y);
      const int32_t* values = scratch_.planes.of(grid.kind).row(y);
      const uint8_t* coded = scratch_.counts.data() + y * grid.cols;
      for (int x = 0; x < grid.cols; ++x) {
        if (coded[x] == 0) continue;
        const auto at = static_cast<size_t>(x);
        residuals.push_back(values[x] - scratch_.predicted.values[at]);
        contexts.push_back(scratch_.predicted.context[at]);
      }
    }
    if (!ownStates_.hasNumbers()) return;
    SpreadChooser chooser;
    chooser.add(contexts, residuals);
    const SpreadShifts shifts = chooser.choose();
    writeShifts(shifts, numbers_);
    for (size_t i = 0; i < residuals.size(); ++i)
      numbers_.number(spreadOf(contexts[i], shifts), residuals[i]);
  }

  void encodeVoids(const Grid& grid, int y) {
    if (ownStates_.hasVoidAnswers())
      scratch_.voids.codeRow(answers_, models_->voids, grid, y, samples_.states.data());
  }
  void takeMisses(const Grid& grid, int y) {
    if (int32_t* misses = missesRow(scratch_.planes, grid.kind, y))
      setMisses(scratch_.planes.of(grid.kind).row(y), scratch_.predicted, allEights(grid.cols), misses);
  }

  /// The kind's step numbers into its plane, and which of them will be said.
  void takeValues(const Grid& grid) {
    SamplePlane& plane = scratch_.planes.of(grid.kind);
    scratch_.counts.resize(static_cast<size_t>(grid.rows * grid.cols));
    codedCount_ = 0;
    std::array<int32_t, RowPrediction::kRoom> nearest;
    for (int y = 0; y < grid.rows; ++y) {
      int32_t* to = plane.row(y);
      uint8_t* coded = scratch_.counts.data() + y * grid.cols;
      const int first = grid.indexOf(0, y);
      stepsOf(samples_.heights.data() + first, 2 * s_, grid.cols, scale_, nearest.data());
      for (int x = 0; x < grid.cols; ++x) {
        const int at = first + 2 * x * s_;
        const bool isCoded = samples_.states[static_cast<size_t>(at)] == SampleState::Coded;
        coded[x] = isCoded && !isKnown(static_cast<size_t>(at)) ? 1 : 0;
        codedCount_ += coded[x];
        if (isCoded) {
          const int32_t q = nearest[static_cast<size_t>(x)];
          const float height = samples_.heights[static_cast<size_t>(at)];
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
    const int center = grid.indexOf(x, y);
    const int endA = center - grid.toEnd(x, y);
    const int endB = center + grid.toEnd(x, y);
    const float* heights = samples_.heights.data();
    const float expected = (heights[endA] + heights[endB]) * 0.5F;
    TERRANE_CHECK(heights[center] == expected, "sample {}: {} m instead of its ends' mean {} m", center,
                  heights[center], expected);
    const auto at = [&](int index) {
      return static_cast<uint32_t>(
          corners.row(index / kTileSamples / (2 * s_))[index % kTileSamples / (2 * s_)]);
    };
    return static_cast<int32_t>(at(endA) + at(endB)) >> 1;
  }

  const TileSamples& samples_;
  int s_;
  int layer_;
  OwnStates ownStates_;
  const ElevationScale& scale_;
  SampleModels* models_;
  Scratch& scratch_;
  BinaryWriter answers_;
  SegmentWriter numbers_;
  int codedCount_ = 0;
};

// -------------------------------------------------------------------------------------------- decoding

/// Decodes one lattice level of a tile.
class LevelDecoder {
 public:
  LevelDecoder(int s, int layer, const OwnStates& states, const ElevationScale& scale, SampleModels* models,
               TileSamples& samples)
      : samples_(samples),
        s_(s),
        layer_(layer),
        ownStates_(states),
        scale_(scale),
        models_(models),
        scratch_(scratchOfThread()) {
    if (states.hasVoidAnswers()) scratch_.voids.begin(s, samples.states.data());
    if (layer > 0) scratch_.before = samples.heights;
    if (states.isSparse() || !states.anyCoded) interpolateHeights(s, samples.heights);
    if (!states.anyCoded) return;
    resizePlanes(scratch_.planes, kTileCells / (2 * s));
    takeCorners(samples, s, scale, scratch_.planes);
    if (states.isSparse()) scratch_.sparse.begin(s, states.closed, samples.states.data());
  }

  Result<size_t> decode(std::span<const uint8_t> bytes) {
    size_t start = 0;
    for (const bool isEdges : {false, true}) {
      TERRANE_ASSIGN(Segment in, openSegment(bytes, start));
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
      start += in.used;
    }
    return start;
  }

 private:
  /// What the samples of one pass or two are read from.
  struct Segment {
    BinaryReader answers;
    SegmentReader numbers;
    size_t used = 0;

    bool hasNumbers = false;

    bool finish() const { return answers.finish() && (!hasNumbers || numbers.finish()); }
  };
  Result<Segment> openSegment(std::span<const uint8_t> bytes, size_t start) const {
    Segment segment;
    const auto named = [&](const Error& error) {
      return makeError("{} (of a segment at byte {})", error.message, start + segment.used);
    };
    size_t used = 0;
    if (ownStates_.hasAnswers()) {
      const auto opened = BinaryReader::open(bytes.subspan(start), used);
      if (!opened.ok()) return named(opened.error());
      segment.answers = *opened;
      segment.used = used;
    }
    if (ownStates_.hasNumbers()) {
      const auto opened = SegmentReader::open(bytes.subspan(start + segment.used), used);
      if (!opened.ok()) return named(opened.error());
      segment.numbers = *opened;
      segment.hasNumbers = true;
      segment.used += used;
    }
    return segment;
  }

  bool decodeKind(SampleKind kind, Segment& in) {
    const Grid grid(kind, s_);
    if (!ownStates_.anyCoded) return decodeNone(grid, in);
    const bool ok = ownStates_.isSparse() ? decodeSparse(grid, in) : decodeDense(grid, in);
    finishPlane(scratch_.planes, kind);
    return ok && !outOfRange_;
  }

  /// Where no sample is coded, no step number matters.
  bool decodeNone(const Grid& grid, Segment& in) {
    for (int y = 0; y < grid.rows; ++y) decodeVoids(grid, y, in);
    return true;
  }

  bool decodeSparse(const Grid& grid, Segment& in) {
    PairWeights weights = usualWeights(grid.kind);
    codeWeights(in.answers, grid.kind, weights);
    scratch_.sparse.beginPass(grid);
    if (grid.kind == SampleKind::HorizontalEdge) completeQuadMisses();
    if (grid.kind == SampleKind::QuadCenter) quadWeights_ = weights;
    for (int y = 0; y < grid.rows; ++y) {
      const uint32_t eights = scratch_.sparse.eights(y);
      int32_t* values = scratch_.planes.of(grid.kind).row(y);
      // note: nobody looks at vertical edges.
      if (grid.kind != SampleKind::VerticalEdge) setMeans(scratch_.planes, grid.kind, y, grid.cols, values);
      if (eights != 0) predictRow(scratch_.planes, grid.kind, y, eights, weights, scratch_.predicted);
      RowBits voids;
      if (ownStates_.hasVoidAnswers())
        voids = scratch_.voids.codeRow(in.answers, models_->voids, grid, y, samples_.states.data());
      RowBits known;
      if (layer_ > 0) takeKnown(grid, y, known, voids, values);
      if (!scratch_.sparse.asks(y, known)) return false;
      RowBits coded = known;
      outOfRange_ |=
          !scratch_.sparse.codeRow(in.answers, models_->sparse, scratch_.predicted, scratch_.planes, y, voids,
                                   layer_ > 0 ? &known : nullptr, coded);
      setSamples(grid, y, coded, voids, values);
      if (layer_ > 0) setLayers(grid, y, coded & ~known);
      if (int32_t* misses = missesRow(scratch_.planes, grid.kind, y); misses != nullptr && eights != 0)
        setMisses(values, scratch_.predicted, eights, misses);
    }
    return true;
  }
  /// Quad-centres of which nothing was asked have misses as well, where edges will ask for them.
  void completeQuadMisses() {
    constexpr SampleKind kKind = SampleKind::QuadCenter;
    for (int y = 0; y < scratch_.planes.quads.rows(); ++y) {
      const uint32_t eights = scratch_.sparse.eightsOfQuadMisses(y) & ~scratch_.sparse.eightsOf(kKind, y);
      if (eights == 0) continue;
      predictRow(scratch_.planes, kKind, y, eights, quadWeights_, scratch_.predicted);
      setMisses(scratch_.planes.quads.row(y), scratch_.predicted, eights, scratch_.planes.quadMisses.row(y));
    }
    scratch_.planes.quadMisses.repeat();
  }
  /// What layers before say of a row: which samples are void, which are Coded, and their step numbers.
  void takeKnown(const Grid& grid, int y, RowBits& known, RowBits& voids, int32_t* values) {
    const int first = grid.indexOf(0, y);
    LevelStates::take(samples_.states.data() + first, 2 * s_, grid.cols, known, voids);
    if (!known.any()) return;
    std::array<int32_t, RowPrediction::kRoom> nearest;
    stepsOf(scratch_.before.data() + first, 2 * s_, grid.cols, scale_, nearest.data());
    known.forEach([&](int x) {
      values[x] = stepOfKnown(scratch_.before[static_cast<size_t>(first + 2 * x * s_)],
                              nearest[static_cast<size_t>(x)]);
    });
  }
  int32_t stepOfKnown(float height, int32_t nearest) const {
    const bool isExact = std::abs(nearest) <= kLargestInteger && scale_.heightFromInteger(nearest) == height;
    return isExact ? nearest : integerOfCoded(height, scale_);
  }
  void setLayers(const Grid& grid, int y, const RowBits& news) {
    uint8_t* layers = samples_.layers.data() + grid.indexOf(0, y);
    news.forEach([&](int x) { layers[2 * x * s_] = static_cast<uint8_t>(layer_); });
  }

  /// What samples of a sparse tile's row have, but for those that are interpolated.
  void setSamples(const Grid& grid, int y, const RowBits& coded, const RowBits& voids,
                  const int32_t* values) {
    SampleState* states = samples_.states.data() + grid.indexOf(0, y);
    float* heights = samples_.heights.data() + grid.indexOf(0, y);
    coded.forEach([&](int x) {
      states[2 * x * s_] = SampleState::Coded;
      heights[2 * x * s_] = scale_.heightFromInteger(values[x]);
    });
    voids.forEach([&](int x) { states[2 * x * s_] = SampleState::Void; });
  }

  bool decodeDense(const Grid& grid, Segment& in) {
    PairWeights weights = usualWeights(grid.kind);
    SpreadShifts shifts{};
    if (!(readWeights(grid.kind, in.numbers, weights) && readShifts(in.numbers, shifts))) return false;
    for (int y = 0; y < grid.rows; ++y) {
      predictRow(scratch_.planes, grid.kind, y, allEights(grid.cols), weights, scratch_.predicted);
      if (!decodeVoids(grid, y, in)) {
        decodeRange(grid, y, 0, grid.cols, shifts, in.numbers);
      } else if (const auto range = codedRange(grid, y)) {
        decodeRange(grid, y, range->first, range->second, shifts, in.numbers);
      } else {
        decodeSome(grid, y, shifts, in.numbers);
      }
    }
    return true;
  }

  /// Sets a row's void samples; are there any?
  bool decodeVoids(const Grid& grid, int y, Segment& in) {
    if (!ownStates_.hasVoidAnswers()) return false;
    const RowBits& voids =
        scratch_.voids.codeRow(in.answers, models_->voids, grid, y, samples_.states.data());
    if (!voids.any()) return false;
    SampleState* states = samples_.states.data() + grid.indexOf(0, y);
    voids.forEach([&](int x) { states[2 * x * s_] = SampleState::Void; });
    return true;
  }
  void takeMisses(const Grid& grid, int y) {
    if (int32_t* misses = missesRow(scratch_.planes, grid.kind, y))
      setMisses(scratch_.planes.of(grid.kind).row(y), scratch_.predicted, allEights(grid.cols), misses);
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
  void decodeRange(const Grid& grid, int y, int first, int end, const SpreadShifts& shifts,
                   SegmentReader& in) {
    const RowPrediction& predicted = scratch_.predicted;
    std::array<uint8_t, RowPrediction::kRoom> spreads;
    std::array<int32_t, RowPrediction::kRoom> residuals;
    std::array<float, RowPrediction::kRoom> heights;
    const int count = end - first;
    spreadsOf(predicted.context.data() + first, count, shifts, spreads.data());
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
    takeMisses(grid, y);
  }

  /// A sample that is not coded.
  void takeMean(const Grid& grid, int x, int y, int32_t* values) {
    values[x] = meanOfEnds(scratch_.predicted, x);
    float* height = samples_.heights.data() + grid.indexOf(x, y);
    const int end = grid.toEnd(x, y);
    *height = (height[-end] + height[end]) * 0.5F;
  }

  /// A row of which only some samples are coded.
  void decodeSome(const Grid& grid, int y, const SpreadShifts& shifts, SegmentReader& in) {
    const RowPrediction& predicted = scratch_.predicted;
    const SampleState* states = samples_.states.data();
    float* heights = samples_.heights.data();
    std::array<uint8_t, RowPrediction::kRoom> spreads;
    std::array<int32_t, RowPrediction::kRoom> residuals;
    int count = 0;
    for (int x = 0; x < grid.cols; ++x) {
      if (states[grid.indexOf(x, y)] != SampleState::Coded) continue;
      spreads[static_cast<size_t>(count++)] = spreadOf(predicted.context[static_cast<size_t>(x)], shifts);
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
    takeMisses(grid, y);
  }

  TileSamples& samples_;
  int s_;
  int layer_;
  OwnStates ownStates_;
  const ElevationScale& scale_;
  SampleModels* models_;
  Scratch& scratch_;
  PairWeights quadWeights_{};
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
          own.closed = own.closed && !grid.hasInterpolatedParent(x, y, states.data());
        }
      }
    }
  }
  return own;
}

SampleState usualState(const OwnStates& states) {
  if (states.isSparse()) return SampleState::Interpolated;
  return states.anyCoded ? SampleState::Coded : SampleState::Void;
}

void encodeLevel(const TileSamples& samples, int s, int layer, const OwnStates& states,
                 const ElevationScale& scale, SampleModels* models, std::vector<uint8_t>& out) {
  LevelEncoder(samples, s, layer, states, scale, models).encode(out);
}

Result<size_t> decodeLevel(std::span<const uint8_t> bytes, int s, int layer, const OwnStates& states,
                           const ElevationScale& scale, SampleModels* models, TileSamples& samples) {
  return LevelDecoder(s, layer, states, scale, models, samples).decode(bytes);
}

}  // namespace terrane
