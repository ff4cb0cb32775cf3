#pragma once

#include <cstdint>
#include <span>

#include "terrane/base/packing.h"
#include "terrane/base/result.h"

namespace terrane {

/// Runs an order of any kind that came as bytes (stream/work.h), and packs the answer: all that a worker with
/// a memory of its own does. `kept`: where tiles stay that several orders read; null: nowhere. Error: there
/// is no such kind, or the bytes are no order of it.
Status runOrder(uint32_t kind, std::span<const uint8_t> order, Packer& answer, KeptObjects* kept = nullptr);

}  // namespace terrane
