#include "sparse_coding.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace terrane {
namespace {

/// Models follow so many answers at most.
constexpr int kMost = 200;
/// From this size context on, the lowest bits of a residual are plain: one more each octave.
constexpr int kFirstShiftedSize = 24;

// note: signs are as good as random. What follows from one is arithmetic, for a branch would be guessed
// wrong.
TERRANE_INLINE uint32_t signOf(int32_t value) {
  return static_cast<uint32_t>(value) >> 31;
}
TERRANE_INLINE uint32_t magnitude(int32_t value) {
  const uint32_t sign = signOf(value);
  return (static_cast<uint32_t>(value) ^ (0U - sign)) + sign;
}
TERRANE_INLINE size_t bendClass(uint32_t size) {
  static constexpr std::array<uint8_t, 25> kClasses = {0, 0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 6, 7,
                                                       7, 7, 7, 8, 8, 8, 8, 8, 8, 8, 8, 9};
  static_assert(kClasses.back() == SparseModels::kBends - 1);
  return kClasses[std::min<size_t>(size, kClasses.size() - 1)];
}
TERRANE_INLINE size_t missClass(int32_t size) {
  static constexpr std::array<uint8_t, 41> kClasses = {0, 1, 2, 3, 3, 4, 4, 5, 5, 5, 6, 6, 6, 6,
                                                       6, 7, 7, 7, 7, 7, 7, 7, 7, 8, 8, 8, 8, 8,
                                                       8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 9};
  static_assert(kClasses.back() == SparseModels::kMisses - 1);
  return kClasses[static_cast<size_t>(std::min<int32_t>(size, kClasses.size() - 1))];
}
/// Classes of what is a little further away: half as many.
TERRANE_INLINE size_t farMissClass(int32_t size) {
  return std::min<size_t>(missClass(size) / 2, 5);
}

/// How many of so many low bits are set.
constexpr size_t countOf(size_t bits, int count) {
  size_t sum = 0;
  for (int i = 0; i < count; ++i) sum += bits >> i & 1;
  return sum;
}
/// f(0) to f(kCount - 1).
template <size_t kCount, class F>
constexpr std::array<uint8_t, kCount> tableOf(F f) {
  std::array<uint8_t, kCount> made{};
  for (size_t i = 0; i < kCount; ++i) made[i] = static_cast<uint8_t>(f(i));
  return made;
}

/// What one kind of samples looks at: which ones around are Coded, a bit each, and what predictions missed.
/// count: how many are Coded, about, at most 7; more: the number R of the format.
template <SampleKind kKind>
class Around;

template <>
class Around<SampleKind::QuadCenter> {
 public:
  explicit Around(const SparseRow& row)
      : north_(row.states.of(SampleKind::QuadCenter).coded(row.y - 1)),
        p0_(row.states.corners().coded(row.y - 1)),
        p1_(row.states.corners().coded(row.y)),
        p2_(row.states.corners().coded(row.y + 1)),
        p3_(row.states.corners().coded(row.y + 2)) {}

  TERRANE_INLINE size_t coded(int x, size_t west) const {
    // North-west, north and north-east come in another order.
    static constexpr std::array<uint8_t, 8> kNorth = {0, 4, 2, 6, 8, 12, 10, 14};
    static constexpr auto kSixteenEach = tableOf<512>([](size_t bits) { return 16 * countOf(bits, 9); });
    const size_t corners = (p0_.around(x) & 3) | (p3_.around(x) & 3) << 2 | (p1_.around(x - 1) & 9) << 4 |
                           (p2_.around(x - 1) & 9) << 5;
    return west + kNorth[north_.around(x - 1) & 7] + kSixteenEach[corners];
  }
  TERRANE_INLINE static size_t count(size_t coded) {
    static constexpr auto kCounts =
        tableOf<256>([](size_t bits) { return countOf(bits, 4) + (bits / 16 + 1) / 3; });
    return kCounts[coded];
  }
  TERRANE_INLINE static size_t more(size_t coded) { return coded / 32; }
  TERRANE_INLINE static size_t misses(int, size_t near) { return 6 * near; }

 private:
  const RowBits& north_;
  const RowBits& p0_;  ///< corner rows y - 1 to y + 2
  const RowBits& p1_;
  const RowBits& p2_;
  const RowBits& p3_;
};

/// Of edges the first six bits are counted, and the first two once more.
struct AroundEdge {
  TERRANE_INLINE static size_t count(size_t coded) {
    static constexpr auto kCounts = tableOf<64>([](size_t bits) { return countOf(bits, 6); });
    return kCounts[coded & 63];
  }
  TERRANE_INLINE static size_t more(size_t coded) { return coded & 3; }
};

template <>
class Around<SampleKind::HorizontalEdge> : public AroundEdge {
 public:
  explicit Around(const SparseRow& row)
      : north_(row.states.of(SampleKind::HorizontalEdge).coded(row.y - 1)),
        corners_(row.states.corners().coded(row.y)),
        d1_(row.states.of(SampleKind::QuadCenter).coded(row.y - 1)),
        d2_(row.states.of(SampleKind::QuadCenter).coded(row.y)),
        m1_(row.planes.quadMisses.row(row.y - 1)),
        m2_(row.planes.quadMisses.row(row.y)) {}

  TERRANE_INLINE size_t coded(int x, size_t west) const {
    const size_t north = north_.around(x) & 1;
    const size_t above = d1_.around(x - 1);
    const size_t below = d2_.around(x - 1);
    const size_t corners = corners_.around(x - 1);
    return west | north << 1 | (above & 1) << 2 | (above & 4) << 1 | (below & 1) << 4 | (below & 4) << 3 |
           (corners & 1) << 6 | (corners & 8) << 4;
  }
  TERRANE_INLINE size_t misses(int x, size_t) const {
    return 6 * missClass(m1_[x] + m2_[x]) + farMissClass(m1_[x - 1] + m2_[x - 1] + m1_[x + 1] + m2_[x + 1]);
  }

 private:
  const RowBits& north_;
  const RowBits& corners_;
  const RowBits& d1_;  ///< quad-centre rows y - 1 and y
  const RowBits& d2_;
  const int32_t* m1_;  ///< their misses
  const int32_t* m2_;
};

template <>
class Around<SampleKind::VerticalEdge> : public AroundEdge {
 public:
  explicit Around(const SparseRow& row)
      : north_(row.states.of(SampleKind::VerticalEdge).coded(row.y - 1)),
        h1_(row.states.of(SampleKind::HorizontalEdge).coded(row.y)),
        h2_(row.states.of(SampleKind::HorizontalEdge).coded(row.y + 1)),
        d0_(row.states.of(SampleKind::QuadCenter).coded(row.y - 1)),
        d2_(row.states.of(SampleKind::QuadCenter).coded(row.y + 1)),
        m1_(row.planes.quadMisses.row(row.y)),
        n1_(row.planes.horizontalMisses.row(row.y)),
        n2_(row.planes.horizontalMisses.row(row.y + 1)) {}

  TERRANE_INLINE size_t coded(int x, size_t west) const {
    static constexpr std::array<uint8_t, 16> kQuads = tableOf<16>([](size_t bits) {
      const size_t quads = countOf(bits, 4);
      return 64 * (quads == 0 ? 0 : quads < 3 ? 1 : quads - 1);
    });
    const size_t north = north_.around(x) & 1;
    const size_t quads = (d0_.around(x - 1) & 3) | (d2_.around(x - 1) & 3) << 2;
    return west | north << 1 | (h1_.around(x - 1) & 3) << 2 | (h2_.around(x - 1) & 3) << 4 | kQuads[quads];
  }
  TERRANE_INLINE size_t misses(int x, size_t) const {
    return 6 * missClass(m1_[x - 1] + m1_[x]) + farMissClass(n1_[x - 1] + n1_[x] + n2_[x - 1] + n2_[x]);
  }

 private:
  const RowBits& north_;
  const RowBits& h1_;  ///< horizontal edges' rows y and y + 1
  const RowBits& h2_;
  const RowBits& d0_;  ///< quad-centre rows y - 1 and y + 1
  const RowBits& d2_;
  const int32_t* m1_;  ///< misses of quad-centre row y
  const int32_t* n1_;  ///< misses of the horizontal edges
  const int32_t* n2_;
};

/// What is known of one sample.
struct Surroundings {
  size_t bend;        ///< class
  size_t signedBend;  ///< the same, and its sign
  size_t size;        ///< size context
  int west;           ///< residuals of the same kind
  int north;
  size_t near;   ///< class of their sizes
  size_t coded;  ///< which samples around are Coded
  size_t count;  ///< how many, about
};

/// What is asked about a sample, of a tile's models.
class Questions {
 public:
  using Models = SparseModels;

  Questions(SparseModels& models, SampleKind kind)
      : all_(models), models_(models.kinds[static_cast<size_t>(kind)]), tables_(evidenceTables()) {}

  TERRANE_INLINE MixedQuestion<3> isOwn(const Surroundings& a, size_t misses, size_t more) const {
    return {tables_,
            {&models_.ownByBend[a.bend * Models::kSizes + a.size],
             &models_.ownByCoded[a.coded * 4 + std::min<size_t>(a.bend / 2, 3)],
             &models_.ownByMisses[misses * 6 + more]},
            models_.ownMixers[a.count]};
  }
  TERRANE_INLINE MixedQuestion<3> isZero(const Surroundings& a) const {
    const int residuals = 5 * std::min(std::abs(a.west), 4) + std::min(std::abs(a.north), 4);
    return {
        tables_,
        {&models_.zeroBySize[a.size], &models_.zeroByBend[a.signedBend * 5 + std::min<size_t>(a.count, 4)],
         &models_.zeroByResiduals[static_cast<size_t>(residuals) * 4 + std::min<size_t>(a.size / 4, 3)]},
        models_.zeroMixer};
  }
  TERRANE_INLINE MixedQuestion<2> isNegative(const Surroundings& a) const {
    const auto sign = [](int value) {
      return static_cast<size_t>((value > 0 ? 2 : 1) - (value < 0 ? 1 : 0));
    };
    return {tables_,
            {&models_.signByBend[a.signedBend], &models_.signByResiduals[3 * sign(a.west) + sign(a.north)]},
            models_.signMixer};
  }
  TERRANE_INLINE MixedQuestion<2> isLarger(const Surroundings& a, size_t than) const {
    return {tables_,
            {&all_.largerBySize[a.size * Models::kSteps + than],
             &all_.largerByResiduals[a.near * Models::kSteps + than]},
            all_.largerMixers[std::min<size_t>(than, 4) - 1]};
  }

 private:
  SparseModels& all_;
  SparseModels::OfKind& models_;
  const EvidenceTables& tables_;
};

/// How large a residual is that is not zero; `isLarger`: than 1.
template <class Coder>
TERRANE_INLINE uint32_t codeSize(Coder& coder, const Questions& questions, const Surroundings& a,
                                 MixedQuestion<2> isLarger, uint32_t size) {
  // Up to four each step has a mixer of its own, so that the next one is asked ahead.
  for (uint32_t i = 1; i < 4; ++i) {
    MixedQuestion<2> next = questions.isLarger(a, i + 1);
    if (!isLarger.code(coder, kMost, size > i)) return i;
    isLarger = next;
  }
  if (!isLarger.code(coder, kMost, size > 4)) return 4;
  for (uint32_t i = 5; i < SparseModels::kSteps; ++i) {
    if (!questions.isLarger(a, i).code(coder, kMost, size > i)) return i;
  }
  return SparseModels::kSteps + codeLarge(coder, size - static_cast<uint32_t>(SparseModels::kSteps));
}

/// The upper part of a residual.
template <class Coder>
TERRANE_INLINE int32_t codeResidual(Coder& coder, const Questions& questions, const Surroundings& a,
                                    MixedQuestion<3> isZero, int32_t value) {
  MixedQuestion<2> isNegative = questions.isNegative(a);
  if (isZero.code(coder, kMost, value == 0)) return 0;
  const MixedQuestion<2> isLarger = questions.isLarger(a, 1);
  const int32_t negative = isNegative.code(coder, kMost, value < 0) ? 1 : 0;
  const auto size = static_cast<int32_t>(codeSize(coder, questions, a, isLarger, magnitude(value)));
  return (size ^ -negative) + negative;
}

template <SampleKind kKind, bool kRefines, class Coder>
bool codeRow(Coder& coder, SparseModels& models, const SparseRow& row, RowBits& coded) {
  const Around<kKind> around(row);
  // note: a coder of our own, of which nobody else knows, stays in registers.
  Coder own = std::move(coder);
  const Questions questions(models, kKind);
  int32_t* values = row.planes.of(kKind).row(row.y);
  uint32_t outOfRange = 0;
  int last = -1;  // the first sample to the west counts as Coded
  int lastResidual = 0;
  row.asked.forEach([&](int x) TERRANE_INLINE_LAMBDA {
    const auto at = static_cast<size_t>(x);
    const auto remember = [&](int32_t residual) TERRANE_INLINE_LAMBDA {
      last = x;
      lastResidual = std::clamp(residual, -100, 100);
      row.residuals[at] = static_cast<int16_t>(lastResidual);
    };
    if constexpr (kRefines) {
      if (row.known->at(x)) {
        remember(static_cast<int32_t>(static_cast<uint32_t>(values[x]) -
                                      static_cast<uint32_t>(row.predicted.values[at])));
        return;
      }
    }
    const int32_t bend = row.predicted.bend[at];
    const int westIsCoded = last == x - 1 ? 1 : 0;
    Surroundings a;
    a.bend = bendClass(magnitude(bend));
    a.signedBend = a.bend + signOf(bend) * SparseModels::kBends;
    a.size = std::min<size_t>(row.predicted.context[at], SparseModels::kSizes - 1);
    a.west = lastResidual & -westIsCoded;
    a.north = row.north[at];
    a.near = missClass(std::abs(a.west) + std::abs(a.north));
    a.coded = around.coded(x, static_cast<size_t>(westIsCoded));
    a.count = around.count(a.coded);
    MixedQuestion<3> isOwn = questions.isOwn(a, around.misses(x, a.near), around.more(a.coded));
    const MixedQuestion<3> isZero = questions.isZero(a);
    if (!isOwn.code(own, kMost, !Coder::kReads && coded.at(x))) return;

    const auto expected = static_cast<uint32_t>(row.predicted.values[at]);
    const int plainBits = std::max(0, (row.predicted.context[at] - kFirstShiftedSize) / 4);
    const int32_t known =
        Coder::kReads ? 0 : static_cast<int32_t>(static_cast<uint32_t>(values[x]) - expected);
    const int32_t upper = codeResidual(own, questions, a, isZero, known >> plainBits);
    const auto residual = static_cast<int32_t>(static_cast<uint32_t>(upper) << plainBits |
                                               codePlain(own, static_cast<uint32_t>(known), plainBits));
    if constexpr (Coder::kReads) {
      coded.set(x);
      values[x] = static_cast<int32_t>(expected + static_cast<uint32_t>(residual));
      outOfRange |= magnitude(values[x]) > kLargestInteger ? 1 : 0;
    }
    remember(residual);
  });
  coder = std::move(own);
  return outOfRange == 0;
}

}  // namespace

SparseModels::SparseModels() {
  for (OfKind& kind : kinds) {
    for (auto& mixer : kind.ownMixers) mixer.weights.fill(23000);
    kind.zeroMixer.weights.fill(23000);
    kind.signMixer.weights.fill(36000);
  }
  for (auto& mixer : largerMixers) mixer.weights.fill(36000);
}

template <class Coder>
bool codeSparseRow(Coder& coder, SparseModels& models, const SparseRow& row, RowBits& coded) {
  const auto code = [&]<bool kRefines>() {
    switch (row.kind) {
      case SampleKind::QuadCenter:
        return codeRow<SampleKind::QuadCenter, kRefines>(coder, models, row, coded);
      case SampleKind::HorizontalEdge:
        return codeRow<SampleKind::HorizontalEdge, kRefines>(coder, models, row, coded);
      case SampleKind::VerticalEdge:
        break;
    }
    return codeRow<SampleKind::VerticalEdge, kRefines>(coder, models, row, coded);
  };
  return row.known != nullptr ? code.template operator()<true>() : code.template operator()<false>();
}
template bool codeSparseRow(BinaryWriter& coder, SparseModels& models, const SparseRow& row, RowBits& coded);
template bool codeSparseRow(BinaryReader& coder, SparseModels& models, const SparseRow& row, RowBits& coded);

}  // namespace terrane
