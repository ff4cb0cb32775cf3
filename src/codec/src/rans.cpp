#include "rans.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "byte_streams.h"
#include "terrane/base/check.h"

namespace terrane {
namespace {

constexpr uint32_t kLowestState = 1U << 16;
/// From about how many bits on a segment has many lanes.
constexpr size_t kManyBits = 16000;

/// e^(-1 / (2 s)) for s = 2^(i / 4 - 4) / (2 ln 2): what a logistic distribution of that mean size loses in
/// half a step. Given as numbers so that no machine's exp() matters.
constexpr std::array<double, kFirstShiftedSpread + 4> kHalfStepDecay = {1.5258789062500007e-05,
                                                                        8.909211976269636e-05,
                                                                        0.00039285689481138327,
                                                                        0.0013680560739015714,
                                                                        0.003906250000000001,
                                                                        0.009438862206998064,
                                                                        0.019820617922037227,
                                                                        0.036987242042379576,
                                                                        0.0625,
                                                                        0.09715380696091154,
                                                                        0.14078571632817452,
                                                                        0.19232067502580052,
                                                                        0.25,
                                                                        0.3116950544376852,
                                                                        0.37521422724648185,
                                                                        0.43854381197983006,
                                                                        0.5,
                                                                        0.5582965649524321,
                                                                        0.612547326536066,
                                                                        0.662226405377972,
                                                                        0.7071067811865476,
                                                                        0.7471924550960295,
                                                                        0.7826540273556803,
                                                                        0.813772944609227,
                                                                        0.8408964152537145,
                                                                        0.8644029471814806,
                                                                        0.8846773577726968,
                                                                        0.902093645144021,
                                                                        0.8408964152537145,
                                                                        0.8644029471814806,
                                                                        0.8846773577726968,
                                                                        0.902093645144021};

/// The logistic distribution's share below x half-steps.
double shareBelow(double decay, int halfSteps) {
  // note: powers by repeated multiplication, the same everywhere.
  double power = 1.0;
  for (int i = std::abs(halfSteps); i > 0; --i) power *= decay;
  return halfSteps < 0 ? power / (1.0 + power) : 1.0 / (1.0 + power);
}

/// Probabilities as whole numbers that add up to 4096, none of them 0.
void fillTable(std::span<const double> shares, TokenTable& table) {
  table.tokens = static_cast<int>(shares.size());
  int sum = 0;
  size_t largest = 0;
  for (size_t t = 0; t < shares.size(); ++t) {
    const int frequency = std::max(1, static_cast<int>(std::floor(shares[t] * kProbabilityOne + 0.5)));
    table.frequency[t] = static_cast<uint16_t>(frequency);
    sum += frequency;
    if (table.frequency[t] > table.frequency[largest]) largest = t;
  }
  table.frequency[largest] =
      static_cast<uint16_t>(table.frequency[largest] + static_cast<int>(kProbabilityOne) - sum);

  uint32_t slot = 0;
  for (size_t t = 0; t < shares.size(); ++t) {
    table.start[t] = static_cast<uint16_t>(slot);
    table.bits[t] = static_cast<float>(kProbabilityBits - std::log2(table.frequency[t]));
    for (uint32_t i = 0; i < table.frequency[t]; ++i, ++slot)
      table.slots[slot] = static_cast<uint32_t>(t) | (t + 1 == shares.size() ? 0x80U : 0U) |
                          static_cast<uint32_t>(table.frequency[t]) << 8 | i << 20;
  }
}

std::unique_ptr<const SpreadTables> makeTables() {
  auto tables = std::make_unique<SpreadTables>();
  for (size_t i = 0; i < tables->tables.size(); ++i) {
    // The rest of a number whose lowest bits are gone stands for an interval: its middle is half a step off.
    const bool isShifted = i >= static_cast<size_t>(kFirstShiftedSpread);
    const double decay = kHalfStepDecay[i];
    const auto share = [&](int32_t value) {
      const int below = 2 * value + (isShifted ? 0 : -1);
      return shareBelow(decay, below + 2) - shareBelow(decay, below);
    };
    std::vector<double> shares;
    double left = 1.0;
    while (shares.size() < 2 || (left > 0.5 / kProbabilityOne && shares.size() < 126)) {
      shares.push_back(share(unzigzag(static_cast<uint32_t>(shares.size()))));
      left -= shares.back();
    }
    shares.push_back(std::max(left, 0.0));
    fillTable(shares, tables->tables[i]);
  }
  for (size_t spread = 0; spread < tables->bySpread.size(); ++spread) {
    const size_t first = static_cast<size_t>(kFirstShiftedSpread);
    const TokenTable& table = tables->tables[spread < first ? spread : first + (spread - first) % 4];
    tables->bySpread[spread] = &table;
    tables->tokensOfSpread[spread] = static_cast<uint32_t>(table.tokens);
    tables->plainBitsOfSpread[spread] =
        static_cast<uint8_t>(SpreadTables::plainBits(static_cast<int>(spread)));
    tables->slotsOfSpread[spread] = static_cast<int32_t>(table.slots.data() - tables->tables[0].slots.data());
  }
  return tables;
}

}  // namespace

const SpreadTables& spreadTables() {
  static const std::unique_ptr<const SpreadTables> tables = makeTables();
  return *tables;
}

float SpreadTables::cost(int spread, int32_t value) const {
  const TokenTable& of = table(spread);
  const int plain = plainBits(spread);
  const uint32_t token = zigzag(value >> plain);
  const auto last = static_cast<uint32_t>(of.tokens - 1);
  float bits = of.bits[std::min(token, last)] + static_cast<float>(plain);
  if (token >= last) bits += static_cast<float>(2 * std::bit_width(token - last + 1) - 1);
  return bits;
}

// -------------------------------------------------------------------------------------------- writing

void SegmentWriter::number(int spread, int32_t value) {
  const TokenTable& table = spreadTables().table(spread);
  const int plainBits = SpreadTables::plainBits(spread);
  const uint32_t token = zigzag(value >> plainBits);
  const auto last = static_cast<uint32_t>(table.tokens - 1);
  const size_t t = std::min(token, last);
  symbols_.push_back({table.frequency[t], table.start[t]});
  if (token >= last) {
    const uint32_t more = token - last + 1;
    const int width = std::bit_width(more);
    plain(0, width - 1);
    plain(1, 1);
    plain(more - (1U << (width - 1)), width - 1);
  }
  if (plainBits > 0) plain(static_cast<uint32_t>(value) & ((1U << plainBits) - 1), plainBits);
}

void SegmentWriter::plain(uint32_t value, int bits) {
  bits_ |= static_cast<uint64_t>(value) << bitCount_;
  bitCount_ += bits;
  while (bitCount_ >= 8) {
    bytes_.push_back(static_cast<uint8_t>(bits_));
    bits_ >>= 8;
    bitCount_ -= 8;
  }
}

void SegmentWriter::plainNumber(int32_t value) {
  const uint32_t more = zigzag(value) + 1;
  const int width = std::bit_width(more);
  plain(0, width - 1);
  plain(1, 1);
  plain(more - (1U << (width - 1)), width - 1);
}

void SegmentWriter::finish(std::vector<uint8_t>& out) {
  // rANS writes backwards: the last symbol first.
  size_t bits = 0;
  for (const Symbol& symbol : symbols_) bits += kProbabilityBits + 1 - std::bit_width(symbol.frequency);
  const bool isWide = bits >= kManyBits;
  const size_t lanes = isWide ? kManyLanes : kFewLanes;
  std::array<uint32_t, kManyLanes> states;
  states.fill(kLowestState);
  std::vector<uint16_t> words;
  words.reserve(symbols_.size() / 2);
  for (size_t i = symbols_.size(); i-- > 0;) {
    const Symbol symbol = symbols_[i];
    uint32_t& state = states[i % lanes];
    if (state >= static_cast<uint32_t>(symbol.frequency) << (32 - kProbabilityBits)) {
      words.push_back(static_cast<uint16_t>(state));
      state >>= 16;
    }
    state = (state / symbol.frequency << kProbabilityBits) + state % symbol.frequency + symbol.start;
  }

  ByteWriter bytes;
  const bool isEmpty = symbols_.empty();
  bytes.varint(isEmpty ? 0 : 2 * (words.size() + 2 * lanes) + (isWide ? 1 : 0));
  for (size_t lane = 0; lane < lanes && !isEmpty; ++lane) bytes.uint32(states[lane]);
  for (size_t i = words.size(); i-- > 0;) bytes.uint16(words[i]);
  if (bitCount_ > 0) plain(0, 8 - bitCount_);
  bytes.varint(bytes_.size());
  const std::vector<uint8_t> head = bytes.take();
  out.insert(out.end(), head.begin(), head.end());
  out.insert(out.end(), bytes_.begin(), bytes_.end());
  symbols_.clear();
  bytes_.clear();
  bits_ = 0;
}

// -------------------------------------------------------------------------------------------- reading

Result<SegmentReader> SegmentReader::open(std::span<const uint8_t> bytes, size_t& used) {
  ByteReader in(bytes);
  SegmentReader reader;
  TERRANE_ASSIGN(const uint64_t head, in.varint(bytes.size()));
  const uint64_t words = head / 2;
  reader.lanes_ = (head & 1) != 0 ? kManyLanes : kFewLanes;
  if (head != 0 && words < 2 * reader.lanes_)
    return makeError("byte {}: a segment of {} words", in.offset(), words);
  reader.states_.fill(kLowestState);
  for (size_t lane = 0; lane < reader.lanes_ && words > 0; ++lane) {
    TERRANE_ASSIGN(reader.states_[lane], in.uint32());
  }
  const size_t wordBytes = words > 0 ? 2 * (static_cast<size_t>(words) - 2 * reader.lanes_) : 0;
  if (in.remaining() < wordBytes) return makeError("byte {}: the segment ends early", in.offset());
  reader.words_ = bytes.data() + in.offset();
  reader.wordsEnd_ = reader.words_ + wordBytes;
  ByteReader tail(bytes.subspan(in.offset() + wordBytes));
  TERRANE_ASSIGN(const uint64_t plainBytes, tail.varint(bytes.size()));
  if (tail.remaining() < plainBytes)
    return makeError("byte {}: the plain bits end early", in.offset() + wordBytes);
  reader.plain_ = reader.wordsEnd_ + tail.offset();
  reader.plainEnd_ = reader.plain_ + plainBytes;
  used = static_cast<size_t>(reader.plainEnd_ - bytes.data());
  return reader;
}

void SegmentReader::refill(uint32_t& state) {
  if (state >= kLowestState) return;
  if (wordsEnd_ - words_ < 2) {
    overrun_ = true;
    state = kLowestState;
    return;
  }
  state = state << 16 | static_cast<uint32_t>(words_[0] | words_[1] << 8);
  words_ += 2;
}

namespace {

/// A row of numbers while it is decoded by groups.
struct Groups {
  const uint8_t* spreads;
  int count;
  int32_t* values;
  std::array<uint32_t, kManyLanes>& states;
  const uint8_t*& words;
  const uint8_t* end;
  uint64_t special = 0;  ///< which eights of numbers hold some that a token does not say all of

  static constexpr int kStep = static_cast<int>(kManyLanes);
  bool hasMore(int i) const { return i + kStep <= count && end - words >= 2 * kStep; }
};

/// Decodes groups of as many numbers as there are lanes, as long as there are whole groups and surely enough
/// words; gives how many numbers that made.
int decodeGroupsAnywhere(Groups& groups) {
  const SpreadTables& tables = spreadTables();
  int i = 0;
  for (; groups.hasMore(i); i += Groups::kStep) {
    for (size_t lane = 0; lane < kManyLanes; ++lane) {
      const size_t at = static_cast<size_t>(i) + lane;
      const uint8_t spread = groups.spreads[at];
      uint32_t& state = groups.states[lane];
      const uint32_t entry = tables.bySpread[spread]->slots[state % kProbabilityOne];
      state = (entry >> 8 & (kProbabilityOne - 1)) * (state >> kProbabilityBits) + (entry >> 20);
      const bool isLow = state < kLowestState;
      const auto word = static_cast<uint32_t>(groups.words[0] | groups.words[1] << 8);
      state = isLow ? state << 16 | word : state;
      groups.words += isLow ? 2 : 0;
      groups.values[at] = unzigzag(entry & 0x7f);
      if ((entry & 0x80) != 0 || spread >= kFirstShiftedSpread) groups.special |= uint64_t{1} << (at / 8);
    }
  }
  return i;
}

#if defined(__x86_64__)
/// Which word each lane takes, by which lanes take one: the first lane the first, and so on.
using LanePermutations = std::array<std::array<uint8_t, 8>, 256>;
const LanePermutations& lanePermutations() {
  static const LanePermutations permutations = [] {
    LanePermutations made{};
    for (size_t mask = 0; mask < made.size(); ++mask) {
      uint8_t next = 0;
      for (size_t lane = 0; lane < 8; ++lane) {
        if ((mask >> lane & 1) != 0) made[mask][lane] = next++;
      }
    }
    return made;
  }();
  return permutations;
}

#define TERRANE_AVX2 __attribute__((target("avx2,popcnt")))

/// Eight lanes' step with AVX2.
TERRANE_AVX2 inline void decodeEight(const SpreadTables& tables, const LanePermutations& permutations,
                                     Groups& groups, int i, __m256i& state) {
  const __m256i slotMask = _mm256_set1_epi32(kProbabilityOne - 1);
  const __m256i zero = _mm256_setzero_si256();
  const auto* base = reinterpret_cast<const int*>(tables.tables[0].slots.data());
  const __m256i spread =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(groups.spreads + i)));
  const __m256i table = _mm256_i32gather_epi32(tables.slotsOfSpread.data(), spread, 4);
  const __m256i slot = _mm256_add_epi32(table, _mm256_and_si256(state, slotMask));
  const __m256i entry = _mm256_i32gather_epi32(base, slot, 4);
  const __m256i frequency = _mm256_and_si256(_mm256_srli_epi32(entry, 8), slotMask);
  state = _mm256_add_epi32(_mm256_mullo_epi32(frequency, _mm256_srli_epi32(state, kProbabilityBits)),
                           _mm256_srli_epi32(entry, 20));

  // Lanes whose state is low take the next words, in order.
  const __m256i isLow = _mm256_cmpeq_epi32(_mm256_srli_epi32(state, 16), zero);
  const auto mask = static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(isLow)));
  const __m256i next = _mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(groups.words)));
  const __m256i order =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(permutations[mask].data())));
  const __m256i refilled =
      _mm256_or_si256(_mm256_slli_epi32(state, 16), _mm256_permutevar8x32_epi32(next, order));
  state = _mm256_blendv_epi8(state, refilled, isLow);
  groups.words += 2 * std::popcount(mask);

  const __m256i token = _mm256_and_si256(entry, _mm256_set1_epi32(0x7f));
  const __m256i isOdd = _mm256_sub_epi32(zero, _mm256_and_si256(token, _mm256_set1_epi32(1)));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(groups.values + i),
                      _mm256_xor_si256(_mm256_srli_epi32(token, 1), isOdd));
  const __m256i isWide = _mm256_cmpgt_epi32(spread, _mm256_set1_epi32(kFirstShiftedSpread - 1));
  const __m256i isSpecial = _mm256_or_si256(_mm256_and_si256(entry, _mm256_set1_epi32(0x80)), isWide);
  groups.special |= static_cast<uint64_t>(_mm256_testz_si256(isSpecial, isSpecial) == 0 ? 1 : 0) << (i / 8);
}

/// The same as decodeGroupsAnywhere(), two eights at a time.
TERRANE_AVX2 int decodeGroupsAvx2(Groups& groups) {
  static_assert(kManyLanes == 16);
  const SpreadTables& tables = spreadTables();
  const LanePermutations& permutations = lanePermutations();
  auto* states = reinterpret_cast<__m256i*>(groups.states.data());
  __m256i first = _mm256_loadu_si256(states);
  __m256i second = _mm256_loadu_si256(states + 1);
  int i = 0;
  for (; groups.hasMore(i); i += Groups::kStep) {
    decodeEight(tables, permutations, groups, i, first);
    decodeEight(tables, permutations, groups, i + 8, second);
  }
  _mm256_storeu_si256(states, first);
  _mm256_storeu_si256(states + 1, second);
  return i;
}
#endif

using DecodeGroups = decltype(&decodeGroupsAnywhere);
DecodeGroups chooseDecodeGroups() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("popcnt") != 0) return decodeGroupsAvx2;
#endif
  return decodeGroupsAnywhere;
}

}  // namespace

uint32_t SegmentReader::slot(const TokenTable& table) {
  uint32_t& state = states_[lane_];
  next();
  const uint32_t entry = table.slots[state % kProbabilityOne];
  state = (entry >> 8 & (kProbabilityOne - 1)) * (state >> kProbabilityBits) + (entry >> 20);
  refill(state);
  return entry & 0x7f;
}

int32_t SegmentReader::larger(const TokenTable& table) {
  int width = 1;
  while (plain(1) == 0) {
    if (++width > 31) {
      overrun_ = true;
      return 0;
    }
  }
  const uint32_t more = plain(width - 1) | 1U << (width - 1);
  return unzigzag(more - 1 + static_cast<uint32_t>(table.tokens - 1));
}

int32_t SegmentReader::number(int spread) {
  const TokenTable& table = spreadTables().table(spread);
  const uint32_t token = slot(table);
  const int plainBits = SpreadTables::plainBits(spread);
  int32_t value = unzigzag(token);
  if (token == static_cast<uint32_t>(table.tokens - 1)) value = larger(table);
  if (plainBits == 0) return value;
  return static_cast<int32_t>(static_cast<uint32_t>(value) << plainBits | plain(plainBits));
}

void SegmentReader::refillPlain() {
  // As many bytes as fit, or as there are.
  if (plainEnd_ - plain_ >= 8) {
    uint64_t next = 0;
    for (int byte = 0; byte < 8; ++byte) next |= static_cast<uint64_t>(plain_[byte]) << (8 * byte);
    const int bytes = (64 - bitCount_) / 8;
    if (bytes < 8) next &= (uint64_t{1} << (8 * bytes)) - 1;
    bits_ |= bytes > 0 ? next << bitCount_ : 0;
    plain_ += bytes;
    bitCount_ += 8 * bytes;
    return;
  }
  while (bitCount_ <= 56 && plain_ < plainEnd_) {
    bits_ |= static_cast<uint64_t>(*plain_++) << bitCount_;
    bitCount_ += 8;
  }
}

uint32_t SegmentReader::plain(int bits) {
  if (bitCount_ < bits) {
    refillPlain();
    // Beyond the end all bits are zero, and it is noted.
    if (bitCount_ < bits) {
      overrun_ = true;
      bitCount_ = bits;
    }
  }
  const auto value = static_cast<uint32_t>(bits_ & ((uint64_t{1} << bits) - 1));
  bits_ >>= bits;
  bitCount_ -= bits;
  return value;
}

int32_t SegmentReader::plainNumber() {
  int width = 1;
  while (plain(1) == 0) {
    if (++width > 31) {
      overrun_ = true;
      return 0;
    }
  }
  return unzigzag((plain(width - 1) | 1U << (width - 1)) - 1);
}

void SegmentReader::numbers(const uint8_t* spreads, int count, int32_t* values) {
  static const DecodeGroups decodeGroups = chooseDecodeGroups();
  TERRANE_CHECK(count <= 512, "{} numbers at once", count);
  int i = 0;
  if (lanes_ == kManyLanes) {
    std::array<uint32_t, kManyLanes> states;
    for (size_t lane = 0; lane < kManyLanes; ++lane) states[lane] = states_[(lane_ + lane) % kManyLanes];
    Groups groups{spreads, count, values, states, words_, wordsEnd_};
    i = decodeGroups(groups);
    for (size_t lane = 0; lane < kManyLanes; ++lane) states_[(lane_ + lane) % kManyLanes] = states[lane];
    // note: plain bits are a stream of their own, so what needs some can wait until here.
    finishEights(groups.special, spreads, values);
  }
  for (; i < count; ++i) values[i] = number(spreads[i]);
}

void SegmentReader::finishNumbers(const uint8_t* spreads, int count, int32_t* values) {
  const SpreadTables& tables = spreadTables();
  for (int i = 0; i < count; ++i) {
    const uint8_t spread = spreads[i];
    if (zigzag(values[i]) + 1 == tables.tokensOfSpread[spread]) values[i] = larger(tables.table(spread));
    const int plainBits = tables.plainBitsOfSpread[spread];
    values[i] = static_cast<int32_t>(static_cast<uint32_t>(values[i]) << plainBits | plain(plainBits));
  }
}

void SegmentReader::finishEights(uint64_t eights, const uint8_t* spreads, int32_t* values) {
  const SpreadTables& tables = spreadTables();
  for (; eights != 0; eights &= eights - 1) {
    const int first = 8 * std::countr_zero(eights);
    // Where the rest of the bits is long enough, whatever there is to read: a few at a time.
    uint64_t bits = bits_;
    int bitCount = bitCount_;
    const uint8_t* plain = plain_;
    int i = first;
    for (; i < first + 8 && plainEnd_ - plain >= 8; ++i) {
      const uint8_t spread = spreads[i];
      const uint32_t token = zigzag(values[i]);
      if (token + 1 == tables.tokensOfSpread[spread]) break;
      const int plainBits = tables.plainBitsOfSpread[spread];
      if (bitCount < plainBits) {
        uint64_t next = 0;
        for (int byte = 0; byte < 8; ++byte) next |= static_cast<uint64_t>(plain[byte]) << (8 * byte);
        const int bytes = (63 - bitCount) / 8;
        bits |= (next & ((uint64_t{1} << (8 * bytes)) - 1)) << bitCount;
        plain += bytes;
        bitCount += 8 * bytes;
      }
      const auto lowest = static_cast<uint32_t>(bits & ((uint64_t{1} << plainBits) - 1));
      bits >>= plainBits;
      bitCount -= plainBits;
      values[i] = static_cast<int32_t>(static_cast<uint32_t>(values[i]) << plainBits | lowest);
    }
    bits_ = bits;
    bitCount_ = bitCount;
    plain_ = plain;
    finishNumbers(spreads + i, first + 8 - i, values + i);
  }
}

bool SegmentReader::finish() const {
  return !overrun_ && words_ == wordsEnd_ && plain_ == plainEnd_ && bitCount_ < 8 && bits_ == 0 &&
         std::all_of(states_.begin(), states_.end(), [](uint32_t state) { return state == kLowestState; });
}

}  // namespace terrane
