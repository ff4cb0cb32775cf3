#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/result.h"

/// How a payload's parts become bytes: little-endian numbers, varints and sections (squeezed by zstd where
/// that makes them smaller). docs/format/elevation-v4.md specifies them.
namespace terrane {

class ByteWriter {
 public:
  void byte(uint8_t value) { bytes_.push_back(value); }
  void uint16(uint16_t value);
  void uint32(uint32_t value);
  /// Seven bits a byte, the lowest first, the top bit where more follow.
  void varint(uint64_t value);
  /// varint 2 * stored length + squeezed, then the stored bytes.
  void section(std::span<const uint8_t> raw);
  std::vector<uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<uint8_t> bytes_;
};

/// Reads what ByteWriter wrote, never beyond the bytes it was given. Errors say the byte.
class ByteReader {
 public:
  explicit ByteReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  size_t offset() const { return offset_; }
  size_t remaining() const { return bytes_.size() - offset_; }
  Result<uint8_t> byte();
  Result<uint16_t> uint16();
  Result<uint32_t> uint32();
  /// At most `limit`; overlong forms are errors.
  Result<uint64_t> varint(uint64_t limit);
  /// A section that must have raw.size() bytes when unpacked.
  Status section(std::span<uint8_t> raw);
  /// Passes over bytes that somebody else has read.
  Status skip(size_t count);

 private:
  Status need(size_t count) const;

  std::span<const uint8_t> bytes_;
  size_t offset_ = 0;
};

/// Signed numbers near zero as small unsigned ones: 0, -1, 1, -2...
constexpr uint32_t zigzag(int32_t value) {
  return (static_cast<uint32_t>(value) << 1) ^ (value < 0 ? 0xffffffffU : 0U);
}
constexpr int32_t unzigzag(uint32_t value) {
  return static_cast<int32_t>((value >> 1) ^ (0U - (value & 1U)));
}

}  // namespace terrane
