#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace terrane {

/// A perspective camera in local coordinates (metres, x east, y north, z up): where it is, how it is turned,
/// how wide it sees, and the picture's size in pixels. A plain value.
struct Camera {
  glm::dvec3 eyeLocal{0.0};
  glm::dvec3 right{1.0, 0.0, 0.0};          ///< unit, towards the picture's right
  glm::dvec3 up{0.0, 0.0, 1.0};             ///< unit, towards the picture's top
  glm::dvec3 forward{0.0, 1.0, 0.0};        ///< unit, into the picture
  double fovyRadians = 0.7853981633974483;  ///< vertical field of view, in (0, pi)
  int width = 1280;
  int height = 720;

  double aspect() const { return static_cast<double>(width) / height; }
  /// Half the picture's height and width at view depth 1.
  double tanHalfY() const;
  double tanHalfX() const { return tanHalfY() * aspect(); }
  /// Pixels that one metre covers at view depth one metre in the middle of the picture.
  double pixelsPerTangent() const { return height / (2.0 * tanHalfY()); }

  /// View coordinates of a local point: x right, y up, z *depth along forward* (positive in front).
  glm::dvec3 viewFromLocal(glm::dvec3 pointLocal) const;
  /// Pixel coordinates (x right, y **down**, (0, 0) the top left corner of the picture, pixel centres at
  /// .5) of a local point in front of the camera; meaningless where the depth is not positive.
  glm::dvec2 pixelFromLocal(glm::dvec3 pointLocal) const;
  /// Direction (not normalised, depth 1) of the ray through pixel coordinates, in local coordinates.
  glm::dvec3 rayThroughPixel(glm::dvec2 pixel) const;
};

/// The camera at `eyeLocal` that looks at `targetLocal` with the horizon level (looking straight up or down,
/// north is the picture's top). `width`, `height` in pixels, `fovyRadians` vertical.
Camera lookAt(glm::dvec3 eyeLocal, glm::dvec3 targetLocal, double fovyRadians, int width, int height);

}  // namespace terrane
