#pragma once

#include <cmath>
#include <string_view>

namespace terrane {

/// The body that a CRS lies on. The earth's is WGS 84's where nothing else is said.
struct Ellipsoid {
  double semiMajorMeters = 6378137.0;
  double flattening = 1.0 / 298.257223563;  ///< 0 for a sphere

  /// Of the three half axes: 6371008.8 m for the earth.
  double meanRadiusMeters() const { return semiMajorMeters * (1.0 - flattening / 3.0); }
  /// All ellipsoids that somebody laid around the earth are as large as each other to a part in a hundred,
  /// and no other body's are.
  bool isEarth() const { return std::abs(semiMajorMeters / 6378137.0 - 1.0) < 0.01; }
};

/// What a CRS's WKT (1 or 2) says of its ellipsoid; the earth's where it says nothing that makes sense. Reads
/// text alone: no table of CRSs is needed, and any text is safe.
Ellipsoid ellipsoidOf(std::string_view crsWkt);

}  // namespace terrane
