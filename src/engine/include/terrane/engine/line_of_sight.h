#pragma once

#include <optional>
#include <span>

#include "terrane/engine/surface.h"

namespace terrane {

/// A straight line between two eyes, over the surface.
struct SightLine {
  double fromHeight = 0.0;    ///< metres, of the eye itself
  double toHeight = 0.0;      ///< metres, of the target
  double lengthMeters = 0.0;  ///< over the ground's plane
  double radiusMeters = 0.0;  ///< of the earth as the line sees it; 0 for a flat one
};

/// The earth's radius as a line of sight sees it, which air bends downwards: `refraction` is the usual
/// coefficient, 0.13 by day, 0 or more and below 1. Of WGS 84 the mean radius: how the two of the ellipsoid
/// differ does not matter here.
double sightRadiusMeters(double refraction);

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
