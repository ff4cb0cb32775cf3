#pragma once

#include <cstdint>

#include "known_tiles.h"
#include "patch_ground.h"
#include "selection_context.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A diamond's error is larger than its children's by at least this factor: one step of error codes (strict
/// saturation).
inline constexpr double kSaturation = 1.0905077326652577;

/// A diamond's codes, from the tiles of its triangles; on a tile border these are two, and both count.
struct NodeCode {
  uint8_t error = 0;  ///< 0 with SurfaceKind::Meshes: patches know theirs
  uint16_t low = 65535;
  uint16_t high = 0;

  /// Is some of what lies on and below it not void?
  bool isGround() const { return low <= high; }
  /// By one of its triangles.
  void widen(const SelectionContext& context, const Diamond& d, const PatchGround& ground);
};

/// The error code of a diamond in one of its tiles, which is resident.
uint8_t errorCode(const SelectionContext& context, const Diamond& d, const KnownTile& tile);

}  // namespace terrane
