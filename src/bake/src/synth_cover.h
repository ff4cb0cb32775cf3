#pragma once

#include <cstdint>
#include <vector>

#include "synth_ground.h"

namespace terrane::synth {

/// Colours of the land cover, without shading: snow, rock, meadow, forest, fields, sand and water.
/// `tile` holds samples [col0 - 1, col0 + cols + 1) x [row0 - 1, row0 + rows + 1); `red`, `green` and
/// `blue` get cols * rows values.
void colorGround(const Ground& ground, int64_t col0, int64_t row0, int cols, int rows, const GroundTile& tile,
                 std::vector<uint8_t>& red, std::vector<uint8_t>& green, std::vector<uint8_t>& blue);

}  // namespace terrane::synth
