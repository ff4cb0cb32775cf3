#include "frame_block.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "patch_instances.h"
#include "srgb.h"

namespace terrane {

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

void setPalette(FrameBlock& block, const Palette& palette, double low, double high) {
  const double span = high > low ? high - low : 1.0;
  block.ramp.x = static_cast<float>(1.0 / span);
  block.ramp.y = static_cast<float>(-low / span);
  block.style.w = palette.count;
  for (int i = 0; i < palette.count; ++i) {
    const ColorStop& stop = palette.stops[static_cast<size_t>(i)];
    block.stops[static_cast<size_t>(i)] = {linearFromSrgb(stop.srgb[0]), linearFromSrgb(stop.srgb[1]),
                                           linearFromSrgb(stop.srgb[2]), stop.position};
  }
}

/// Slope in degrees: flat ground is pale, walls are dark.
Palette slopePalette() {
  Palette out;
  out.count = 6;
  out.stops[0] = {0.00F, {0.97F, 0.97F, 0.93F}};
  out.stops[1] = {0.17F, {0.98F, 0.90F, 0.60F}};
  out.stops[2] = {0.33F, {0.98F, 0.68F, 0.36F}};
  out.stops[3] = {0.50F, {0.88F, 0.38F, 0.28F}};
  out.stops[4] = {0.67F, {0.58F, 0.17F, 0.36F}};
  out.stops[5] = {1.00F, {0.20F, 0.07F, 0.30F}};
  return out;
}

/// Error over tau, 0 to 2: blue, white below tau, yellow at it, red beyond.
Palette errorPalette() {
  Palette out;
  out.count = 5;
  out.stops[0] = {0.00F, {0.16F, 0.33F, 0.62F}};
  out.stops[1] = {0.25F, {0.55F, 0.76F, 0.86F}};
  out.stops[2] = {0.42F, {0.95F, 0.96F, 0.88F}};
  out.stops[3] = {0.50F, {0.99F, 0.83F, 0.30F}};
  out.stops[4] = {1.00F, {0.75F, 0.06F, 0.12F}};
  return out;
}

void setRamp(FrameBlock& block, const RenderStyle& style) {
  switch (style.mode) {
    case ColorMode::Slope:
      return setPalette(block, slopePalette(), 0.0, 60.0);
    case ColorMode::Error:
      return setPalette(block, errorPalette(), 0.0, 2.0);
    case ColorMode::Height:
      return setPalette(block, Palette::even(), style.lowMeters, style.highMeters);
    default:
      return setPalette(block, style.palette, style.lowMeters, style.highMeters);
  }
}

glm::vec4 axis(glm::dvec3 direction, double w) {
  return {glm::vec3(direction), static_cast<float>(w)};
}

}  // namespace

DepthRange chooseDepthRange(const gpu::Context& context, const Frame& frame, const Camera& camera) {
  DepthRange out;
  out.reversed = !context.workarounds().noClipControl;
  if (out.reversed) return out;
  // Everything lies nearer than the farthest corner of the world, heights included.
  const double sideX = static_cast<double>(frame.worldCells()) * frame.spacingXMeters();
  const double sideY = static_cast<double>(frame.worldCells()) * frame.spacingYMeters();
  const double x = std::max(std::abs(camera.eyeLocal.x), std::abs(camera.eyeLocal.x - sideX));
  const double y = std::max(std::abs(camera.eyeLocal.y), std::abs(camera.eyeLocal.y + sideY));
  constexpr double kHighestGround = 2e4;
  out.farMeters = std::sqrt(x * x + y * y) + std::abs(camera.eyeLocal.z) + kHighestGround;
  out.nearMeters = std::max(out.nearMeters, out.farMeters * 1e-5);
  return out;
}

FrameBlock makeFrameBlock(const Frame& frame, const Camera& camera, const RenderStyle& style,
                          const DepthRange& depth, int shrink) {
  FrameBlock block{};
  block.viewRight = axis(camera.right, 1.0 / camera.tanHalfX());
  block.viewUp = axis(camera.up, 1.0 / camera.tanHalfY());
  block.viewForward = axis(camera.forward, 0.0);
  if (depth.reversed) {
    block.depth = {0.0F, static_cast<float>(depth.nearMeters), 0.0F, 0.0F};
  } else {
    const double span = depth.farMeters - depth.nearMeters;
    block.depth = {static_cast<float>((depth.farMeters + depth.nearMeters) / span),
                   static_cast<float>(-2.0 * depth.farMeters * depth.nearMeters / span), 1.0F, 0.0F};
  }
  block.gradient = {static_cast<float>(1.0 / frame.spacingXMeters()),
                    static_cast<float>(1.0 / frame.spacingYMeters()), static_cast<float>(style.exaggeration),
                    0.0F};

  const double azimuth = style.sunAzimuthDegrees * kDegree;
  const double altitude = style.sunAltitudeDegrees * kDegree;
  block.sunDirection = axis(
      {std::sin(azimuth) * std::cos(altitude), std::cos(azimuth) * std::cos(altitude), std::sin(altitude)},
      0.0);

  // Haze lies in the valleys: it halves from one third of the relief to the next.
  // Colours that are to be read as numbers stay clear of it.
  const bool readAsNumbers =
      style.mode == ColorMode::Slope || style.mode == ColorMode::Normals || style.mode == ColorMode::Error;
  if (style.haze && !readAsNumbers) {
    const double side =
        static_cast<double>(frame.worldCells()) * std::max(frame.spacingXMeters(), frame.spacingYMeters());
    const double distance = style.hazeDistanceMeters > 0.0 ? style.hazeDistanceMeters : 3.0 * side;
    const double base = style.lowMeters * style.exaggeration;
    const double relief = std::max((style.highMeters - style.lowMeters) * style.exaggeration, 1.0);
    const double falloff = 0.6931 / std::max(relief / 1.5, 0.02 * distance);
    block.haze = {static_cast<float>(1.0 / distance), static_cast<float>(falloff),
                  static_cast<float>(std::max(camera.eyeLocal.z - base, -relief)), 0.0F};
  }
  setRamp(block, style);
  if (style.waterLevelMeters) {
    block.ramp.z = static_cast<float>(*style.waterLevelMeters);
    block.ramp.w = static_cast<float>(style.waterWithinMeters.value_or(1e9));
  }
  block.imageryLight = {static_cast<float>(style.imageryRelief), static_cast<float>(style.imageryBrightness),
                        0.0F, 0.0F};
  block.style.x = static_cast<int32_t>(style.mode);
  block.style.y = static_cast<int32_t>(style.outline);
  const float lineWidth = style.outline == OutlineMode::Wireframe ? 0.9F : 1.3F;
  block.pixel = {lineWidth * static_cast<float>(shrink),
                 static_cast<float>(1.0 / std::max(style.tauPixels, 1e-6)),
                 static_cast<float>(camera.width * shrink), static_cast<float>(camera.height * shrink)};
  return block;
}

void placeLattice(FrameBlock& block, const Frame& frame, const Camera& camera, double exaggeration,
                  int latticeDepth, LatticePoint anchor, int cellsPerPatchSide) {
  const glm::dvec2 spacing = latticeSpacing(frame, latticeDepth);
  const glm::dvec2 anchorLocal{anchor.x * spacing.x, -anchor.y * spacing.y};
  block.place = {static_cast<float>(spacing.x), static_cast<float>(spacing.y),
                 static_cast<float>(camera.eyeLocal.x - anchorLocal.x),
                 static_cast<float>(camera.eyeLocal.y - anchorLocal.y)};
  // The anchor's height is the float nearest to the eye's, so that differences of heights near it are exact.
  const auto anchorHeight = static_cast<float>(camera.eyeLocal.z / exaggeration);
  block.height = {
      anchorHeight, static_cast<float>(exaggeration),
      static_cast<float>(camera.eyeLocal.z - static_cast<double>(anchorHeight) *
                                                 static_cast<double>(static_cast<float>(exaggeration))),
      0.0F};
  block.style.z = cellsPerPatchSide;
}

}  // namespace terrane
