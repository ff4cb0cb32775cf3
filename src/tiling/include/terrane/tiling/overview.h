#pragma once

#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// A box of ground in local coordinates (x east, y north, z up, metres).
struct GroundBox {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
};

/// A camera that sees all of a piece of ground, close to filling the picture.
/// `azimuthDegrees`: from where it looks, clockwise from north (180: from the south, looking north).
/// `elevationDegrees`: how high it stands above the horizon, in (0, 90]; 90 looks straight down with north at
/// the top. The ground must have some extent.
Camera overviewCamera(const GroundBox& ground, double azimuthDegrees, double elevationDegrees,
                      double fovyRadians, int width, int height);

}  // namespace terrane
