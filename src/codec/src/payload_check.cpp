#include "payload_check.h"

#include <zlib.h>

#include "terrane/base/check.h"

namespace terrane {
namespace {

/// The low 16 bits of the CRC-32 that gzip has.
uint16_t checkOf(std::span<const uint8_t> payload) {
  const auto checked = payload.subspan(kCheckedFrom);
  return static_cast<uint16_t>(crc32_z(crc32_z(0, nullptr, 0), checked.data(), checked.size()));
}

}  // namespace

void sealPayload(std::span<uint8_t> payload) {
  TERRANE_CHECK(payload.size() >= kCheckedFrom, "{} bytes", payload.size());
  const uint16_t check = checkOf(payload);
  payload[kCheckOffset] = static_cast<uint8_t>(check);
  payload[kCheckOffset + 1] = static_cast<uint8_t>(check >> 8);
}

Status checkPayload(std::span<const uint8_t> payload) {
  if (payload.size() < kCheckedFrom)
    return makeError("byte {}: the payload ends before its check", payload.size());
  const unsigned stored = payload[kCheckOffset] | static_cast<unsigned>(payload[kCheckOffset + 1]) << 8;
  if (const unsigned found = checkOf(payload); found != stored)
    return makeError("byte {}: damaged: the check is {:#06x}, that of these {} bytes {:#06x}", kCheckOffset,
                     stored, payload.size() - kCheckedFrom, found);
  return {};
}

}  // namespace terrane
