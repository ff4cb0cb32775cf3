#include "terrane/codec/compact_mesh.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

#include "mesh_lattice.h"
#include "terrane/base/check.h"

namespace terrane {

namespace {

constexpr size_t kHeadWords = 3;
/// In place of a vertex's number.
constexpr uint16_t kNone = 0xffff;
constexpr uint16_t kExtra = 0xfffe;

size_t halvesToWords(uint64_t halves) {
  return static_cast<size_t>((halves + 1) / 2);
}

/// A patch's corners, in the order in which triangles turn, from x towards y.
struct TurningCorners {
  MeshPoint at[3];
};
TurningCorners turningCorners(int level, int index, bool centerFalls) {
  const PatchCorners corners = patchCorners(level, index, centerFalls);
  const auto pointOf = [](std::array<int, 2> p) { return MeshPoint{p[0], p[1]}; };
  TurningCorners out{{pointOf(corners.ends[0]), pointOf(corners.ends[1]), pointOf(corners.apex)}};
  if (doubleArea(out.at[0], out.at[1], out.at[2]) < 0) std::swap(out.at[0], out.at[1]);
  return out;
}

/// A patch's samples and their numbers.
class PatchSamples {
 public:
  PatchSamples(int level, int index, bool centerFalls) {
    const TurningCorners turning = turningCorners(level, index, centerFalls);
    std::copy(turning.at, turning.at + 3, corners_);
    top_ = std::min({corners_[0].y, corners_[1].y, corners_[2].y});
    bottom_ = std::max({corners_[0].y, corners_[1].y, corners_[2].y});
    left_ = std::min({corners_[0].x, corners_[1].x, corners_[2].x});
    right_ = std::max({corners_[0].x, corners_[1].x, corners_[2].x});
    listRows();
  }

  const MeshPoint (&corners() const)[3] { return corners_; }
  MeshPoint middle() const {
    return {(corners_[0].x + corners_[1].x) / 2, (corners_[0].y + corners_[1].y) / 2};
  }
  int area() const { return doubleArea(corners_[0], corners_[1], corners_[2]); }
  uint32_t count() const { return count_; }
  size_t bitmapWords() const { return (count_ + 31) / 32; }

  bool boxHolds(int x, int y) const { return x >= left_ && x <= right_ && y >= top_ && y <= bottom_; }
  /// Does the box hold everything within `s` of a sample?
  bool boxHoldsAround(MeshPoint p, int s) const {
    return p.x - s >= left_ && p.x + s <= right_ && p.y - s >= top_ && p.y + s <= bottom_;
  }
  bool holds(MeshPoint p) const {
    return doubleArea(corners_[0], corners_[1], p) >= 0 && doubleArea(corners_[1], corners_[2], p) >= 0 &&
           doubleArea(corners_[2], corners_[0], p) >= 0;
  }
  bool isOnSide(MeshPoint p) const {
    return doubleArea(corners_[0], corners_[1], p) == 0 || doubleArea(corners_[1], corners_[2], p) == 0 ||
           doubleArea(corners_[2], corners_[0], p) == 0;
  }

  uint32_t numberOf(MeshPoint p) const {
    const Row& row = rows_[static_cast<size_t>(p.y - top_)];
    return row.firstNumber + static_cast<uint32_t>(p.x - row.firstX);
  }
  /// Walks through ascending numbers.
  class Walker {
   public:
    explicit Walker(const PatchSamples& samples) : samples_(samples) {}
    MeshPoint at(uint32_t number) {
      while (number >= samples_.rows_[row_ + 1].firstNumber) ++row_;
      const Row& row = samples_.rows_[row_];
      return {row.firstX + static_cast<int>(number - row.firstNumber),
              samples_.top_ + static_cast<int>(row_)};
    }

   private:
    const PatchSamples& samples_;
    size_t row_ = 0;
  };

 private:
  struct Row {
    uint32_t firstNumber;
    int firstX;
  };
  /// note: sides run along rows, columns or diagonals, so that from row to row they move by -1, 0 or 1.
  void listRows() {
    // Two of the sides bound rows, or three; those that go up on the left, those that go down on the right.
    struct Bound {
      int x, step;
    };
    Bound lefts[2], rights[2];
    int leftCount = 0, rightCount = 0;
    for (int i = 0; i < 3; ++i) {
      const MeshPoint p = corners_[i], q = corners_[(i + 1) % 3];
      if (p.y == q.y) continue;
      const int step = (q.x - p.x) / (q.y - p.y);
      const Bound bound{p.x + (top_ - p.y) * step, step};
      if (q.y < p.y) {
        lefts[leftCount++] = bound;
      } else {
        rights[rightCount++] = bound;
      }
    }
    if (leftCount == 1) lefts[1] = lefts[0];
    if (rightCount == 1) rights[1] = rights[0];
    for (int row = 0; row <= bottom_ - top_; ++row) {
      const int first = std::max(lefts[0].x + row * lefts[0].step, lefts[1].x + row * lefts[1].step);
      const int last = std::min(rights[0].x + row * rights[0].step, rights[1].x + row * rights[1].step);
      rows_[static_cast<size_t>(row)] = {count_, first};
      count_ += static_cast<uint32_t>(last - first + 1);
    }
    rows_[static_cast<size_t>(bottom_ + 1 - top_)] = {count_, 0};
  }

  MeshPoint corners_[3];  ///< as triangles turn
  int top_ = 0, bottom_ = 0, left_ = 0, right_ = 0;
  uint32_t count_ = 0;
  std::array<Row, kTileSamples + 1> rows_;  ///< of the patch, and one more
};

// ---- writing

/// Appends 16-bit numbers, up to a whole word.
template <class Numbers>
void appendHalves(std::vector<uint32_t>& words, const Numbers& numbers) {
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (i % 2 == 0) words.push_back(0);
    words.back() |= static_cast<uint32_t>(numbers[i]) << (i % 2 * 16);
  }
}

MeshPoint pointOf(uint32_t place) {
  return {static_cast<int>(place & 511U), static_cast<int>(place >> 9 & 511U)};
}

// ---- reading

/// Numbers of the vertices at a tile's samples, for one patch at a time. Work space of a thread.
std::vector<uint16_t>& numbersOfThread() {
  thread_local std::vector<uint16_t> numbers(kTileSampleCount, kNone);
  return numbers;
}

/// Expands one patch's record, and holds every word of it against what it must be.
class PatchExpander {
 public:
  PatchExpander(std::span<const uint32_t> record, int level, const PatchSamples& samples,
                std::vector<PatchVertex>& vertices, std::vector<uint16_t>& indices)
      : record_(record),
        level_(level),
        samples_(samples),
        numbers_(numbersOfThread().data()),
        vertices_(vertices),
        indices_(indices),
        firstVertex_(vertices.size()),
        firstIndex_(indices.size()) {}

  /// Appends to the vectors; with an error these hold anything.
  Status run() {
    TERRANE_TRY(readHead());
    Status read = expand();
    forget();
    return read;
  }
  uint32_t vertexCount() const { return vertexCount_; }
  uint32_t bisectedCount() const { return bisectedCount_; }
  uint32_t triangleCount() const { return bisectedCount_ + replacingCount_; }

 private:
  Status readHead() {
    if (record_.size() < kHeadWords) return makeError("{} words are no record", record_.size());
    vertexCount_ = record_[0] & 0xffffU;
    extraCount_ = record_[0] >> 16;
    bisectedCount_ = record_[1];
    replacingCount_ = record_[2];
    const uint64_t due = kHeadWords + samples_.bitmapWords() + halvesToWords(extraCount_) +
                         halvesToWords(uint64_t{3} * replacingCount_) + uint64_t{2} * vertexCount_;
    if (record_.size() != due) return makeError("the record has {} words, not {}", record_.size(), due);
    if (bisectedCount_ > 4 * vertexCount_)
      return makeError("{} vertices have not {} triangles", vertexCount_, bisectedCount_);
    bitmap_ = record_.subspan(kHeadWords, samples_.bitmapWords());
    extras_ = record_.subspan(kHeadWords + bitmap_.size(), halvesToWords(extraCount_));
    replacing_ = record_.subspan(kHeadWords + bitmap_.size() + extras_.size(),
                                 halvesToWords(uint64_t{3} * replacingCount_));
    heights_ = record_.last(size_t{2} * vertexCount_);
    return {};
  }

  Status expand() {
    TERRANE_TRY(readVertices());
    TERRANE_TRY(readExtras());
    // With room to write past the end by what one vertex may have too many.
    indices_.resize(firstIndex_ + size_t{3} * triangleCount() + kTooMany);
    next_ = indices_.data() + firstIndex_;
    endOfBisected_ = next_ + size_t{3} * bisectedCount_;
    TERRANE_TRY(bisect());
    if (next_ != endOfBisected_) return makeError("there are not {} triangles of bisection", bisectedCount_);
    TERRANE_TRY(readReplacing());
    indices_.resize(indices_.size() - kTooMany);
    if (area_ != samples_.area()) return makeError("the triangles do not cover it");
    return {};
  }

  uint16_t& numberAt(MeshPoint p) { return numbers_[p.index()]; }
  static uint32_t halfOf(std::span<const uint32_t> words, size_t index) {
    return words[index / 2] >> (index % 2 * 16) & 0xffffU;
  }
  static bool isOddHalfClear(std::span<const uint32_t> words, uint64_t count) {
    return count % 2 == 0 || words.back() >> 16 == 0;
  }

  Status readVertices() {
    vertices_.resize(firstVertex_ + vertexCount_);
    PatchVertex* vertex = vertices_.data() + firstVertex_;
    PatchSamples::Walker walker(samples_);
    bool isFinite = true;
    for (size_t w = 0; w < bitmap_.size(); ++w) {
      for (uint32_t bits = bitmap_[w]; bits != 0; bits &= bits - 1) {
        const auto number = static_cast<uint32_t>(w * 32) + static_cast<uint32_t>(std::countr_zero(bits));
        if (number >= samples_.count()) return makeError("there is no sample {}", number);
        if (readCount_ == vertexCount_) return makeError("there are more than {} vertices", vertexCount_);
        const MeshPoint p = walker.at(number);
        const uint32_t* heights = heights_.data() + size_t{2} * readCount_;
        isFinite &= (heights[0] & kExponent) != kExponent && (heights[1] & kExponent) != kExponent;
        vertex->place = static_cast<uint32_t>(p.x) | static_cast<uint32_t>(p.y) << 9;
        std::memcpy(&vertex->heightMeters, heights, sizeof(float));
        std::memcpy(&vertex->coarseMeters, heights + 1, sizeof(float));
        ++vertex;
        numberAt(p) = static_cast<uint16_t>(readCount_++);
      }
    }
    if (readCount_ != vertexCount_) return makeError("there are not {} vertices", vertexCount_);
    if (!isFinite) return makeError("a height is not finite");
    for (const MeshPoint corner : samples_.corners())
      if (numberAt(corner) == kNone) return makeError("a corner is no vertex");
    return {};
  }

  Status readExtras() {
    PatchSamples::Walker walker(samples_);
    for (uint32_t i = 0; i < extraCount_; ++i) {
      const uint32_t number = halfOf(extras_, i);
      if (number >= samples_.count() || (i > 0 && number <= halfOf(extras_, i - 1)))
        return makeError("extra vertex {} cannot be sample {}", i, number);
      const MeshPoint p = walker.at(number);
      if (numberAt(p) != kNone || !samples_.isOnSide(p))
        return makeError("sample {} is no extra vertex", number);
      numberAt(p) = kExtra;
      readExtraCount_ = i + 1;
    }
    if (!isOddHalfClear(extras_, extraCount_))
      return makeError("there are more than {} extra vertices", extraCount_);
    // What they shape is not emitted; their parents are there all the same.
    PatchSamples::Walker again(samples_);
    for (uint32_t i = 0; i < extraCount_; ++i) {
      const MeshPoint p = again.at(halfOf(extras_, i));
      const int level = vertexLevel(p);
      if (level == level_) continue;
      const MeshDiamond d = meshDiamondAt(p, level);
      for (const MeshPoint apex : d.apexes)
        if (samples_.holds(apex) && numberAt(apex) == kNone) return makeError("a parent is missing");
    }
    return {};
  }

  // ---- triangles

  Status bisect() {
    if (numberAt(samples_.middle()) == kNone) {
      if (bisectedCount_ != 1 || vertexCount_ != 3) return makeError("the middle is missing");
      for (const MeshPoint corner : samples_.corners()) *next_++ = numberAt(corner);
      area_ += samples_.area();
      return {};
    }
    const PatchVertex* vertices = vertices_.data() + firstVertex_;
    for (uint32_t i = 0; i < vertexCount_; ++i) {
      const MeshPoint p = pointOf(vertices[i].place);
      const auto bits = static_cast<unsigned>(p.x) | static_cast<unsigned>(p.y);
      const int shift = bits == 0 ? 8 : std::countr_zero(bits);
      if (shift >= 8) continue;  // a corner of the tile
      const int s = 1 << shift;
      const bool isQuad = ((p.x & p.y) >> shift & 1) != 0;
      // What is coarser is a corner, and was split before.
      if (2 * (7 - shift) + (isQuad ? 0 : 1) < level_) continue;
      const bool isInside = samples_.boxHoldsAround(p, s);
      if (!(isQuad ? addRing<true>(p, s, static_cast<uint16_t>(i), isInside)
                   : addRing<false>(p, s, static_cast<uint16_t>(i), isInside)))
        return makeError("the triangles around {}, {} are no bisection", p.x, p.y);
    }
    return {};
  }

  /// The triangles that a vertex's split made and that are not split on. `isInside`: the box holds them all.
  template <bool IsQuad>
  bool addRing(MeshPoint p, int s, uint16_t number, bool isInside) {
    static constexpr int kX[5] = {IsQuad ? -1 : 0, 1, IsQuad ? 1 : 0, -1, IsQuad ? -1 : 0};
    static constexpr int kY[5] = {-1, IsQuad ? -1 : 0, 1, IsQuad ? 1 : 0, -1};
    const auto lookUp = [&](int dx, int dy) {
      if (!isInside && !samples_.boxHolds(p.x + dx, p.y + dy)) return kNone;
      return numbers_[p.index() + dy * kTileSamples + dx];
    };
    uint16_t ring[5];
    for (int i = 0; i < 4; ++i) {
      ring[i] = lookUp(kX[i] * s, kY[i] * s);
      if (ring[i] == kNone && samples_.holds({p.x + kX[i] * s, p.y + kY[i] * s})) return false;
    }
    ring[4] = ring[0];
    // Which are leaves nobody can foretell: each is written, and stays or is written over.
    const bool areLast = !IsQuad && s == 1;
    const uint16_t* const before = next_;
    for (int i = 0; i < 4; ++i) {
      const bool isFree =
          areLast || lookUp((kX[i] + kX[i + 1]) * s / 2, (kY[i] + kY[i + 1]) * s / 2) == kNone;
      const bool isLeaf = (std::max(ring[i], ring[i + 1]) < kExtra) & isFree;
      next_[0] = ring[i];
      next_[1] = ring[i + 1];
      next_[2] = number;
      next_ += isLeaf ? 3 : 0;
    }
    area_ += (next_ - before) / 3 * (IsQuad ? 2 * s * s : s * s);
    return next_ <= endOfBisected_;
  }

  Status readReplacing() {
    const PatchVertex* vertices = vertices_.data() + firstVertex_;
    for (uint32_t i = 0; i < replacingCount_; ++i) {
      MeshPoint corners[3];
      for (size_t j = 0; j < 3; ++j) {
        const uint32_t number = halfOf(replacing_, size_t{3} * i + j);
        if (number >= vertexCount_) return makeError("there is no vertex {}", number);
        corners[j] = pointOf(vertices[number].place);
        *next_++ = static_cast<uint16_t>(number);
      }
      const int area = doubleArea(corners[0], corners[1], corners[2]);
      if (area <= 0) return makeError("triangle {} turns the wrong way", bisectedCount_ + i);
      area_ += area;
    }
    if (!isOddHalfClear(replacing_, uint64_t{3} * replacingCount_))
      return makeError("there are more than {} triangles", triangleCount());
    return {};
  }

  void forget() {
    for (uint32_t i = 0; i < readCount_; ++i) numberAt(pointOf(vertices_[firstVertex_ + i].place)) = kNone;
    PatchSamples::Walker walker(samples_);
    for (uint32_t i = 0; i < readExtraCount_; ++i) numberAt(walker.at(halfOf(extras_, i))) = kNone;
  }

  static constexpr uint32_t kExponent = 0x7f800000;
  static constexpr size_t kTooMany = 15;

  std::span<const uint32_t> record_;
  int level_;
  const PatchSamples& samples_;
  uint16_t* numbers_;
  std::vector<PatchVertex>& vertices_;
  std::vector<uint16_t>& indices_;
  size_t firstVertex_;
  size_t firstIndex_;

  uint32_t vertexCount_ = 0;
  uint32_t extraCount_ = 0;
  uint32_t bisectedCount_ = 0;
  uint32_t replacingCount_ = 0;
  std::span<const uint32_t> bitmap_;
  std::span<const uint32_t> extras_;
  std::span<const uint32_t> replacing_;
  std::span<const uint32_t> heights_;

  uint32_t readCount_ = 0;       ///< vertices whose numbers are set
  uint32_t readExtraCount_ = 0;  ///< and extra vertices
  uint16_t* next_ = nullptr;
  uint16_t* endOfBisected_ = nullptr;
  int64_t area_ = 0;  ///< twice that of the triangles so far
};

/// The records, one after the other and nothing between them.
Result<std::vector<std::span<const uint32_t>>> recordsOf(std::span<const uint32_t> words) {
  if (words.empty()) return makeError("compact meshes: there are no words");
  if (words[0] >> 5 != 0) return makeError("compact meshes: {:#x} is no mesh level", words[0]);
  const auto count = static_cast<size_t>(patchCount(static_cast<int>(words[0] & 15U)));
  if (words.size() < 1 + count)
    return makeError("compact meshes: {} words do not hold {} patches", words.size(), count);
  std::vector<std::span<const uint32_t>> out;
  out.reserve(count);
  size_t begin = 1 + count;
  if (words[1] != begin) return makeError("compact meshes: the records begin at word {}", words[1]);
  for (size_t i = 0; i < count; ++i) {
    const size_t end = i + 1 < count ? words[2 + i] : words.size();
    if (end < begin || end > words.size())
      return makeError("compact meshes: the record of patch {} ends at word {}", i, end);
    out.push_back(words.subspan(begin, end - begin));
    begin = end;
  }
  return out;
}

}  // namespace

CompactLevel compactOf(const MeshLevel& meshes) {
  CompactLevel out;
  std::vector<uint32_t>& words = out.words;
  words.resize(1 + meshes.patches.size());
  words[0] = static_cast<uint32_t>(meshes.level) | (meshes.centerFalls ? 16U : 0U);
  for (size_t i = 0; i < meshes.patches.size(); ++i) {
    const MeshLevel::Patch& patch = meshes.patches[i];
    const auto vertices = std::span(meshes.vertices).subspan(patch.firstVertex, patch.vertexCount);
    const auto extras = std::span(meshes.extras).subspan(patch.firstExtra, patch.extraCount);
    const auto indices = std::span(meshes.indices).subspan(patch.firstIndex, patch.indexCount);
    const PatchSamples samples(meshes.level, static_cast<int>(i), meshes.centerFalls);
    words[1 + i] = static_cast<uint32_t>(words.size());
    words.push_back(patch.vertexCount | patch.extraCount << 16);
    words.push_back(patch.bisectedCount);
    words.push_back(patch.indexCount / 3 - patch.bisectedCount);

    const size_t bitmap = words.size();
    words.resize(bitmap + samples.bitmapWords());
    for (const PatchVertex& vertex : vertices) {
      const uint32_t number = samples.numberOf(pointOf(vertex.place));
      words[bitmap + number / 32] |= 1U << (number % 32);
    }
    std::vector<uint16_t> numbers;
    for (const uint32_t place : extras)
      numbers.push_back(static_cast<uint16_t>(samples.numberOf(pointOf(place))));
    appendHalves(words, numbers);
    appendHalves(words, indices.subspan(size_t{3} * patch.bisectedCount));

    const size_t heights = words.size();
    words.resize(heights + 2 * vertices.size());
    for (size_t j = 0; j < vertices.size(); ++j) {
      std::memcpy(&words[heights + 2 * j], &vertices[j].heightMeters, sizeof(float));
      std::memcpy(&words[heights + 2 * j + 1], &vertices[j].coarseMeters, sizeof(float));
    }
  }
  return out;
}

Result<ExpandedMeshes> expandMeshes(const CompactLevel& compact) {
  TERRANE_ASSIGN(const std::vector<std::span<const uint32_t>> records, recordsOf(compact.words));
  ExpandedMeshes out;
  out.patches.reserve(records.size());
  size_t vertices = 0, triangles = 0;
  for (const auto& record : records) {
    if (record.size() < kHeadWords) continue;
    // No more than a record of its size may say.
    vertices += std::min<size_t>(record[0] & 0xffffU, record.size());
    triangles += std::min<size_t>(record[1], 4 * record.size()) + std::min<size_t>(record[2], record.size());
  }
  out.vertices.reserve(vertices);
  out.indices.reserve(3 * triangles + 16);
  for (size_t i = 0; i < records.size(); ++i) {
    const PatchSamples samples(compact.level(), static_cast<int>(i), compact.centerFalls());
    MeshLevel::Patch patch;
    patch.firstVertex = static_cast<uint32_t>(out.vertices.size());
    patch.firstIndex = static_cast<uint32_t>(out.indices.size());
    PatchExpander expander(records[i], compact.level(), samples, out.vertices, out.indices);
    if (const Status expanded = expander.run(); !expanded.ok())
      return makeError("compact meshes, patch {}: {}", i, expanded.error().message);
    patch.vertexCount = expander.vertexCount();
    patch.indexCount = 3 * expander.triangleCount();
    out.patches.push_back(patch);
  }
  return out;
}

Status validateCompactLevel(const CompactLevel& compact) {
  TERRANE_ASSIGN(const std::vector<std::span<const uint32_t>> records, recordsOf(compact.words));
  // As expandMeshes(), patch over patch.
  std::vector<PatchVertex> vertices;
  std::vector<uint16_t> indices;
  for (size_t i = 0; i < records.size(); ++i) {
    const PatchSamples samples(compact.level(), static_cast<int>(i), compact.centerFalls());
    vertices.clear();
    indices.clear();
    PatchExpander expander(records[i], compact.level(), samples, vertices, indices);
    if (const Status expanded = expander.run(); !expanded.ok())
      return makeError("compact meshes, patch {}: {}", i, expanded.error().message);
  }
  return {};
}

CompactPatch compactPatch(const CompactLevel& compact, int index) {
  const std::vector<uint32_t>& words = compact.words;
  const int count = patchCount(compact.level());
  TERRANE_CHECK(index >= 0 && index < count, "patch {} of {}", index, count);
  CompactPatch out;
  const auto at = static_cast<size_t>(index);
  out.firstWord = words[1 + at];
  out.wordCount = (index + 1 < count ? words[2 + at] : words.size()) - out.firstWord;
  out.vertexCount = words[out.firstWord] & 0xffffU;
  out.triangleCount = words[out.firstWord + 1] + words[out.firstWord + 2];
  const TurningCorners corners = turningCorners(compact.level(), index, compact.centerFalls());
  for (size_t i = 0; i < 3; ++i) out.corners[i] = {corners.at[i].x, corners.at[i].y};
  return out;
}

}  // namespace terrane
