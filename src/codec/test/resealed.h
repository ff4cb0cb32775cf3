#pragma once

#include <cstdint>
#include <vector>

#include "payload_check.h"

namespace terrane {

/// As if the encoder had written these bytes, so that what lies behind the check is tested too.
inline std::vector<uint8_t> resealed(std::vector<uint8_t> bytes) {
  if (bytes.size() >= kCheckedFrom) sealPayload(bytes);
  return bytes;
}

}  // namespace terrane
