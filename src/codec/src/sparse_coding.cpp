#include "sparse_coding.h"

#include <algorithm>
#include <cstdlib>

namespace terrane {
namespace {

/// Models follow so many answers at most.
constexpr int kMost = 200;
/// From this size context on, the lowest bits of a residual are plain: one more each octave.
constexpr int kFirstShiftedSize = 24;

uint32_t magnitude(int32_t value) {
  return value < 0 ? 0U - static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
}
size_t bendClass(uint32_t size) {
  static constexpr std::array<uint8_t, 24> kClasses = {0, 0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 6,
                                                       7, 7, 7, 7, 8, 8, 8, 8, 8, 8, 8, 8};
  return size < kClasses.size() ? kClasses[size] : SparseModels::kBends - 1;
}
size_t missClass(uint32_t size) {
  static constexpr std::array<uint8_t, 40> kClasses = {0, 1, 2, 3, 3, 4, 4, 5, 5, 5, 6, 6, 6, 6,
                                                       6, 7, 7, 7, 7, 7, 7, 7, 7, 8, 8, 8, 8, 8,
                                                       8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8};
  return size < kClasses.size() ? kClasses[size] : SparseModels::kMisses - 1;
}
/// Classes of what is a little further away: half as many.
size_t farMissClass(uint32_t size) {
  return std::min<size_t>(missClass(size) / 2, 5);
}

/// What is known around one sample.
struct Surroundings {
  size_t kind = 0;
  size_t bend = 0;  ///< class
  bool bendsDown = false;
  size_t size = 0;    ///< size context
  size_t coded = 0;   ///< which samples around are Coded
  size_t count = 0;   ///< how many, about
  size_t misses = 0;  ///< classes of what predictions missed around
  size_t more = 0;
  int west = 0;  ///< residuals of the same kind
  int north = 0;
};

/// Finds it.
class Looking {
 public:
  explicit Looking(const SparseRow& row) : row_(row), s_(row.grid.s) {}

  Surroundings at(int x, int west, int north) const {
    const auto i = static_cast<size_t>(x);
    Surroundings out;
    out.kind = static_cast<size_t>(row_.grid.kind);
    out.bend = bendClass(magnitude(row_.predicted.bend[i]));
    out.bendsDown = row_.predicted.bend[i] < 0;
    out.size = std::min<size_t>(row_.predicted.context[i], SparseModels::kSizes - 1);
    out.west = west;
    out.north = north;
    const int at = row_.grid.indexOf(x, row_.y);
    col_ = at % kTileSamples;
    line_ = at / kTileSamples;
    switch (row_.grid.kind) {
      case SampleKind::QuadCenter:
        aroundQuad(out);
        break;
      case SampleKind::HorizontalEdge:
        aroundHorizontal(x, out);
        break;
      case SampleKind::VerticalEdge:
        aroundVertical(x, out);
        break;
    }
    return out;
  }

 private:
  /// Is the sample so many half-sizes away Coded? Beyond the tile all are.
  size_t coded(int right, int down) const {
    const int col = col_ + right * s_;
    const int line = line_ + down * s_;
    if (col < 0 || line < 0 || col > kTileCells || line > kTileCells) return 1;
    return row_.states[line * kTileSamples + col] == SampleState::Coded ? 1 : 0;
  }

  void aroundQuad(Surroundings& out) const {
    const size_t west = coded(-2, 0), north = coded(0, -2), northWest = coded(-2, -2),
                 northEast = coded(2, -2);
    size_t corners = 0;
    for (const int side : {-1, 1}) {
      for (const int far : {-3, 3}) corners += coded(side, far) + coded(far, side);
    }
    out.coded = west + 2 * north + 4 * northWest + 8 * northEast + 16 * corners;
    out.count = west + north + northWest + northEast + (corners + 1) / 3;
    out.misses = 6 * missClass(magnitude(out.west) + magnitude(out.north));
    out.more = corners / 2;
  }
  void aroundHorizontal(int x, Surroundings& out) const {
    const size_t west = coded(-2, 0), north = coded(0, -2);
    const size_t quads[] = {coded(-2, -1), coded(2, -1), coded(-2, 1), coded(2, 1)};
    out.coded = west + 2 * north + 4 * quads[0] + 8 * quads[1] + 16 * quads[2] + 32 * quads[3] +
                64 * coded(-3, 0) + 128 * coded(3, 0);
    out.count = west + north + quads[0] + quads[1] + quads[2] + quads[3];
    const int32_t* above = row_.planes.quadMisses.row(row_.y - 1) + x;
    const int32_t* below = row_.planes.quadMisses.row(row_.y) + x;
    out.misses =
        6 * missClass(magnitude(above[0]) + magnitude(below[0])) +
        farMissClass(magnitude(above[-1]) + magnitude(below[-1]) + magnitude(above[1]) + magnitude(below[1]));
    out.more = west + 2 * north;
  }
  void aroundVertical(int x, Surroundings& out) const {
    const size_t west = coded(-2, 0), north = coded(0, -2);
    const size_t edges[] = {coded(-1, -1), coded(1, -1), coded(-1, 1), coded(1, 1)};
    const size_t quads = coded(-1, -2) + coded(1, -2) + coded(-1, 2) + coded(1, 2);
    out.coded = west + 2 * north + 4 * edges[0] + 8 * edges[1] + 16 * edges[2] + 32 * edges[3] +
                64 * (quads == 0  ? 0
                      : quads < 3 ? 1
                                  : quads - 1);
    out.count = west + north + edges[0] + edges[1] + edges[2] + edges[3];
    const int32_t* quad = row_.planes.quadMisses.row(row_.y) + x;
    const int32_t* above = row_.planes.horizontalMisses.row(row_.y) + x;
    const int32_t* below = row_.planes.horizontalMisses.row(row_.y + 1) + x;
    out.misses =
        6 * missClass(magnitude(quad[-1]) + magnitude(quad[0])) +
        farMissClass(magnitude(above[-1]) + magnitude(above[0]) + magnitude(below[-1]) + magnitude(below[0]));
    out.more = west + 2 * north;
  }

  const SparseRow& row_;
  int s_;
  mutable int col_ = 0;
  mutable int line_ = 0;
};

/// Asks a tile's models.
template <class Coder>
class Asking {
 public:
  Asking(Coder& coder, SparseModels& models) : coder_(coder), models_(models), tables_(evidenceTables()) {}

  bool isOwn(const Surroundings& a, bool yes) {
    const size_t k = a.kind;
    return codeMixed<Coder, 3>(
        coder_, tables_,
        {&models_.ownByBend[(k * SparseModels::kBends + a.bend) * SparseModels::kSizes + a.size],
         &models_.ownByCoded[(k * 256 + a.coded) * 4 + std::min<size_t>(a.bend / 2, 3)],
         &models_.ownByMisses[(k * SparseModels::kMisses * 6 + a.misses) * 6 + a.more]},
        models_.ownMixers[k * 8 + std::min<size_t>(a.count, 7)], kMost, yes);
  }

  int32_t residual(const Surroundings& a, int plainBits, int32_t value) {
    const int32_t upper = value >> plainBits;
    int32_t out = 0;
    if (!isZero(a, upper == 0)) {
      const bool negative = isNegative(a, upper < 0);
      const auto size = static_cast<int32_t>(sizeOf(a, magnitude(upper)));
      out = negative ? -size : size;
    }
    return static_cast<int32_t>(static_cast<uint32_t>(out) << plainBits |
                                codePlain(coder_, static_cast<uint32_t>(value), plainBits));
  }

 private:
  static size_t signedBend(const Surroundings& a) {
    return a.bend + (a.bendsDown ? SparseModels::kBends : 0);
  }

  bool isZero(const Surroundings& a, bool yes) {
    const size_t k = a.kind;
    const size_t residuals =
        5 * std::min<size_t>(magnitude(a.west), 4) + std::min<size_t>(magnitude(a.north), 4);
    return codeMixed<Coder, 3>(
        coder_, tables_,
        {&models_.zeroBySize[k * SparseModels::kSizes + a.size],
         &models_
              .zeroByBend[(k * 2 * SparseModels::kBends + signedBend(a)) * 5 + std::min<size_t>(a.count, 4)],
         &models_.zeroByResiduals[(k * 25 + residuals) * 4 + std::min<size_t>(a.size / 4, 3)]},
        models_.zeroMixers[k], kMost, yes);
  }
  bool isNegative(const Surroundings& a, bool yes) {
    const size_t k = a.kind;
    const auto sign = [](int value) { return static_cast<size_t>(value < 0 ? 0 : value == 0 ? 1 : 2); };
    return codeMixed<Coder, 2>(coder_, tables_,
                               {&models_.signByBend[k * 2 * SparseModels::kBends + signedBend(a)],
                                &models_.signByResiduals[k * 9 + 3 * sign(a.west) + sign(a.north)]},
                               models_.signMixers[k], kMost, yes);
  }
  uint32_t sizeOf(const Surroundings& a, uint32_t size) {
    const size_t near = missClass(magnitude(a.west) + magnitude(a.north));
    for (uint32_t i = 1; i < SparseModels::kSteps; ++i) {
      const bool isLarger =
          codeMixed<Coder, 2>(coder_, tables_,
                              {&models_.largerBySize[a.size * SparseModels::kSteps + i],
                               &models_.largerByResiduals[near * SparseModels::kSteps + i]},
                              models_.largerMixers[std::min<uint32_t>(i, 4) - 1], kMost, size > i);
      if (!isLarger) return i;
    }
    return SparseModels::kSteps + codeLarge(coder_, size - static_cast<uint32_t>(SparseModels::kSteps));
  }

  Coder& coder_;
  SparseModels& models_;
  const EvidenceTables& tables_;
};

}  // namespace

SparseModels::SparseModels() {
  for (auto& mixer : ownMixers) mixer.weights.fill(23000);
  for (auto& mixer : zeroMixers) mixer.weights.fill(23000);
  for (auto& mixer : signMixers) mixer.weights.fill(36000);
  for (auto& mixer : largerMixers) mixer.weights.fill(36000);
}

template <class Coder>
bool codeSparseRow(Coder& coder, SparseModels& models, const SparseRow& row) {
  const Looking looking(row);
  Asking<Coder> asking(coder, models);
  const Grid& grid = row.grid;
  int32_t* values = row.planes.of(grid.kind).row(row.y);
  bool isInRange = true;
  int8_t west = 0;
  for (int x = 0; x < grid.cols; ++x) {
    SampleState& state = row.states[grid.indexOf(x, row.y)];
    int8_t& last = row.lastResiduals[x];
    bool isCoded =
        state != SampleState::Void && !(row.closed && grid.hasInterpolatedParent(x, row.y, row.states));
    int32_t residual = 0;
    if (isCoded) {
      const Surroundings around = looking.at(x, west, last);
      isCoded = asking.isOwn(around, state == SampleState::Coded);
      if (isCoded) {
        const auto at = static_cast<size_t>(x);
        const auto expected = static_cast<uint32_t>(row.predicted.values[at]);
        const int plainBits = std::max(0, (row.predicted.context[at] - kFirstShiftedSize) / 4);
        const int32_t known =
            Coder::kReads ? 0 : static_cast<int32_t>(static_cast<uint32_t>(values[x]) - expected);
        residual = asking.residual(around, plainBits, known);
        if constexpr (Coder::kReads) {
          values[x] = static_cast<int32_t>(expected + static_cast<uint32_t>(residual));
          isInRange &= values[x] <= kLargestInteger && values[x] >= -kLargestInteger;
        }
      }
    }
    if constexpr (Coder::kReads) {
      if (!isCoded) values[x] = meanOfEnds(row.predicted, x);
      if (state != SampleState::Void) state = isCoded ? SampleState::Coded : SampleState::Interpolated;
    }
    west = last = static_cast<int8_t>(std::clamp(residual, -100, 100));
  }
  return isInRange;
}
template bool codeSparseRow(BinaryWriter& coder, SparseModels& models, const SparseRow& row);
template bool codeSparseRow(BinaryReader& coder, SparseModels& models, const SparseRow& row);

}  // namespace terrane
