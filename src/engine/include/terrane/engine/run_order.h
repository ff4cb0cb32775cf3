#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// Runs an order of any kind that came as bytes (stream/work.h), and gives the answer as bytes: all that a
/// worker with a memory of its own does. Error: there is no such kind, or the bytes are no order of it.
Result<std::vector<uint8_t>> runOrder(uint32_t kind, std::span<const uint8_t> order);

}  // namespace terrane
