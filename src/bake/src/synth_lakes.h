#pragma once

#include <cstdint>

#include "synth_world.h"

namespace terrane::synth {

/// Digs lakes into valleys and basins: above a chosen outlet everything low enough goes under water, the
/// slopes above come down with it in their order, so nothing that drained stops draining. Sets `inLake` and
/// `lakeLevel`, lowers `height`.
void digLakes(World& world, uint32_t seed);

}  // namespace terrane::synth
