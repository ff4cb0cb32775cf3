#include "terrane/engine/line_of_sight.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

/// How far the ground may stand above the line and still be called level with it: rounding, no more.
constexpr double kToleranceMeters = 1e-6;

}  // namespace

double sightRadiusMeters(double refraction, const Ellipsoid& ellipsoid) {
  return ellipsoid.meanRadiusMeters() / (1.0 - refraction);
}

SightResult lookAlong(std::span<const SurfacePiece> pieces, const SightLine& line) {
  SightResult result;
  // Between two ends a round body rises above their chord by bulge * t * (1 - t).
  const double bulge =
      line.radiusMeters > 0.0 ? line.lengthMeters * line.lengthMeters / (2.0 * line.radiusMeters) : 0.0;
  for (const SurfacePiece& piece : pieces) {
    if (!piece.isGround) continue;
    const double span = piece.end - piece.begin;
    const auto surfaceAt = [&](double t) {
      const double s = span > 0.0 ? (t - piece.begin) / span : 0.0;
      return piece.beginHeight + s * (piece.endHeight - piece.beginHeight);
    };
    const auto above = [&](double t) {
      return surfaceAt(t) + bulge * t * (1.0 - t) - (line.fromHeight + t * (line.toHeight - line.fromHeight));
    };

    // The highest place: an end, or the top of the parabola.
    double highest = piece.begin, most = above(piece.begin);
    if (const double end = above(piece.end); end > most) highest = piece.end, most = end;
    if (bulge > 0.0 && span > 0.0) {
      const double slope =
          (piece.endHeight - piece.beginHeight) / span - (line.toHeight - line.fromHeight) + bulge;
      const double top = slope / (2.0 * bulge);
      if (top > piece.begin && top < piece.end && above(top) > most) highest = top, most = above(top);
    }
    if (!result.clearanceMeters || -most < *result.clearanceMeters) result.clearanceMeters = -most;

    // Where it first comes above the line, on the way up to the highest place.
    if (most > kToleranceMeters && result.visible) {
      result.visible = false;
      double low = piece.begin, high = highest;
      if (above(low) <= 0.0) {
        for (int i = 0; i < 60; ++i) {
          const double middle = 0.5 * (low + high);
          (above(middle) <= 0.0 ? low : high) = middle;
        }
      }
      result.blockedAt = above(piece.begin) > 0.0 ? piece.begin : high;
      result.blockedHeight = surfaceAt(*result.blockedAt);
    }
  }
  return result;
}

}  // namespace terrane
