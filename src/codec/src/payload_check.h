#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "terrane/base/result.h"

/// The check in every payload, elevation's and imagery's: what was damaged on its way, or on the disk, is
/// refused before any of it is believed (docs/decisions/0043-payloads-are-checked.md).
namespace terrane {

/// A payload's first byte is its version; then the check, then all that is checked.
inline constexpr size_t kCheckOffset = 1;
inline constexpr size_t kCheckedFrom = 3;

/// Writes the check of a payload that is finished but for it. Precondition: at least 3 bytes.
void sealPayload(std::span<uint8_t> payload);
/// Error: the bytes are not those that were sealed.
Status checkPayload(std::span<const uint8_t> payload);

}  // namespace terrane
