#pragma once

#include <string>

#include "terrane/base/result.h"
#include "terrane/engine/terrain.h"
#include "terrane/engine/terrain_view.h"
#include "terrane/tiling/flight.h"

namespace terrane {

/// Reads a flight's file and lays it over a dataset (docs/flights.md). Asks the dataset for the ground under
/// the path at full resolution. Errors: the file, what is wrong in it, tiles that cannot be read.
Result<FittedFlight> readFlight(const std::string& path, const Terrain& terrain);

/// A flight from its text, laid over the ground that has come so far. `view` must be Ready. Ground that comes
/// later does not change it. Errors: what is wrong in the text; `where` begins them.
Result<FittedFlight> flightOver(const std::string& text, const std::string& where, const TerrainView& view);

}  // namespace terrane
