#pragma once

#include <optional>
#include <span>

#include "terrane/dataset/ellipsoid.h"
#include "terrane/engine/surface.h"

namespace terrane {

/// A straight line between two eyes, over the surface.
struct SightLine {
  double fromHeight = 0.0;    ///< metres, of the eye itself
  double toHeight = 0.0;      ///< metres, of the target
  double lengthMeters = 0.0;  ///< level, on the ground: what the projection shows may be longer
  double radiusMeters = 0.0;  ///< of the body as the line sees it; 0 for a flat one
};

/// A body's radius as a line of sight sees it, which air bends downwards: `refraction` is the usual
/// coefficient, 0.13 by day on the earth, 0 where there is no air, below 1. Of the ellipsoid the mean radius:
/// how its two differ does not matter here.
double sightRadiusMeters(double refraction, const Ellipsoid& ellipsoid);

/// What stands between.
struct SightResult {
  bool visible = true;
  /// The least height of the line above the surface, metres; negative where the surface stands above it.
  /// Nothing where all of the line is over void.
  std::optional<double> clearanceMeters;
  std::optional<double> blockedAt;  ///< share of the line where the surface first rises above it
  double blockedHeight = 0.0;       ///< of the surface there
};

/// Exact over the surface: within a piece the surface is linear and the earth's bulge a parabola, so where
/// the line comes nearest follows in closed form. Void hides nothing.
SightResult lookAlong(std::span<const SurfacePiece> pieces, const SightLine& line);

}  // namespace terrane
