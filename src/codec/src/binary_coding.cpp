#include "binary_coding.h"

#include <cstdlib>

#include "byte_streams.h"

namespace terrane {
namespace {

/// 65536 / (1 + e^(-i / 4)). Given as numbers so that no machine's exp() matters.
constexpr std::array<uint16_t, 33> kLogistic = {32768, 36843, 40793, 44511, 47911, 50941, 53581, 55834, 57724,
                                                59287, 60565, 61598, 62428, 63090, 63615, 64030, 64357, 64614,
                                                64816, 64974, 65097, 65194, 65269, 65328, 65374, 65410, 65438,
                                                65459, 65476, 65489, 65500, 65508, 65514};

constexpr uint16_t logistic(int evidence) {
  const int size = evidence < 0 ? -evidence : evidence;
  const auto i = static_cast<size_t>(size / 64);
  const int more = kLogistic[i] + (kLogistic[i + 1] - kLogistic[i]) * (size % 64) / 64;
  return static_cast<uint16_t>(evidence < 0 ? 65536 - more : more);
}

}  // namespace

const EvidenceTables& evidenceTables() {
  static const EvidenceTables tables = [] {
    EvidenceTables made;
    for (int evidence = -kMostEvidence; evidence <= kMostEvidence; ++evidence)
      made.chance[static_cast<size_t>(evidence + kMostEvidence)] = {
          logistic(evidence), static_cast<uint16_t>(boundedChance(logistic(evidence)))};
    // The smallest evidence that says as much.
    int evidence = -kMostEvidence;
    for (size_t i = 0; i < made.evidence.size(); ++i) {
      while (evidence < kMostEvidence && logistic(evidence) < 16 * static_cast<int>(i) + 8) ++evidence;
      made.evidence[i] = static_cast<int16_t>(evidence);
    }
    return made;
  }();
  return tables;
}

void BinaryWriter::shiftLow() {
  // What may still be carried into waits: one byte, and all that would become 0 after it.
  if (low_ < 0xff000000U || low_ > 0xffffffffU) {
    const auto carry = static_cast<uint8_t>(low_ >> 32);
    for (; heldCount_ > 0; --heldCount_) {
      bytes_.push_back(static_cast<uint8_t>(held_ + carry));
      held_ = 0xff;
    }
    held_ = static_cast<uint8_t>(low_ >> 24);
  }
  ++heldCount_;
  low_ = (low_ & 0x00ffffffU) << 8;
}

void BinaryWriter::finish(std::vector<uint8_t>& out) {
  // Of all that is left to choose from the number with the most zeros at its end, which are not written.
  for (int zeros = 32; zeros >= 0; --zeros) {
    const uint64_t last = low_ + range_ - 1;
    const uint64_t rounded = last >> zeros << zeros;
    if (rounded < low_) continue;
    low_ = rounded;
    break;
  }
  for (int i = 0; i < 5; ++i) shiftLow();
  while (!bytes_.empty() && bytes_.back() == 0) bytes_.pop_back();
  // note: the first byte is what a carry would go to, of a number below 1.
  ByteWriter head;
  head.varint(bytes_.empty() ? 0 : bytes_.size() - 1);
  const std::vector<uint8_t> length = head.take();
  out.insert(out.end(), length.begin(), length.end());
  if (!bytes_.empty()) out.insert(out.end(), bytes_.begin() + 1, bytes_.end());
  *this = BinaryWriter();
}

Result<BinaryReader> BinaryReader::open(std::span<const uint8_t> bytes, size_t& used) {
  ByteReader in(bytes);
  TERRANE_ASSIGN(const uint64_t size, in.varint(bytes.size()));
  if (in.remaining() < size) return makeError("byte {}: the answers end early", in.offset());
  BinaryReader reader;
  reader.bytes_ = bytes.data() + in.offset();
  reader.size_ = static_cast<size_t>(size);
  used = in.offset() + reader.size_;
  if (size > 0 && bytes[used - 1] == 0) return makeError("byte {}: the answers end with a 0", used - 1);
  reader.refill();
  return reader;
}

}  // namespace terrane
