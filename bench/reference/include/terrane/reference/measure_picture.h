#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "terrane/reference/reference_surface.h"
#include "terrane/tiling/camera.h"

/// How far a picture is from the truth: from the place under each pixel (row by row from the top left corner,
/// local metres, NaN for sky) and the camera that drew it, single-sampled. Everything here works on all
/// cores, a call at a time.
namespace terrane {

/// The error on screen of the ground that a picture shows: for each pixel the distance, as the camera
/// projects them, between the drawn point and the full-resolution surface's point on the same vertical.
struct ErrorMeasure {
  int64_t pixels = 0;  ///< that show ground where the reference has ground too
  double maxPixels = 0.0;
  double sumOfSquares = 0.0;
  int64_t aboveTau = 0;      ///< pixels with more than tau
  double excessPixels = 0.0;  ///< the sum of what pixels have above tau
  glm::ivec2 maxAt{0};       ///< the pixel with the largest error
  glm::dvec3 maxPoint{0.0};  ///< what is drawn there

  double rms() const;
  /// The error that 99.9 % of the pixels stay below, to a hundredth of a pixel.
  double percentile999() const;
  double fractionAboveTau() const;
  /// Adds another picture's pixels.
  void add(const ErrorMeasure& other);

  static constexpr int kBinsPerPixel = 100;
  std::vector<int64_t> histogram;  ///< of errors in hundredths of a pixel; the last holds all that are larger
};
ErrorMeasure measureError(const ReferenceSurface& surface, const Camera& camera,
                          std::span<const glm::dvec3> places, double tauPixels);

struct CrackMeasure {
  int64_t skyPixels = 0;
  int64_t cracks = 0;             ///< see measureCracks(), measureCracksWhileLoading()
  int64_t seeThrough = 0;         ///< pixels that show ground from behind ground
  int64_t checked = 0;            ///< pixels that must show ground
  std::vector<glm::ivec2> where;  ///< the first few
  void add(const CrackMeasure& other);
};

/// Cracks: pixels that show sky although the reference shows ground there and at every pixel within
/// ceil(tau) + 1 pixels (an outline may move by tau), and that ground has no hole there, however small (whose
/// outline may be drawn as coarse as a pixel). See-through: pixels whose ground is hidden in the
/// reference, and farther away than what the reference shows within 2 ceil(tau) + 1 pixels (the near and the
/// far ground may each move by tau). Rays past the picture's border count as its pixels do.
CrackMeasure measureCracks(const ReferenceSurface& surface, const Camera& camera,
                           std::span<const glm::dvec3> places, double tauPixels);

/// Pixels that show sky although any continuous surface, however coarse, would be hit (see
/// ReferenceSurface::Cover). Only says something for cameras above the highest ground.
CrackMeasure measureCracksWhileLoading(const ReferenceSurface::Cover& cover, const Camera& camera,
                                       std::span<const glm::dvec3> places);

}  // namespace terrane
