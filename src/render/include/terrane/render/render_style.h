#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "terrane/tiling/camera.h"

namespace terrane {

/// What the ground's colour tells.
enum class ColorMode : int32_t {
  Shaded = 0,   ///< imagery where there is some, else a height ramp, in the sun
  Height = 1,   ///< height alone, on a ramp of even steps
  Slope = 2,    ///< steepness in degrees: 0 pale to 60 dark
  Normals = 3,  ///< the surface normal: red east, green north, blue up
  Tiles = 4,    ///< a colour of its own for each tile that heights are read from
  Error = 5,    ///< each patch's error on screen: blue none, yellow tau, red twice tau and more
};

/// Lines drawn over the ground.
enum class OutlineMode : int32_t {
  None = 0,
  Wireframe = 1,  ///< every triangle
  Patches = 2,    ///< the three sides of every K-patch
};

/// A colour at a position of a ramp.
struct ColorStop {
  float position = 0.0F;        ///< 0 to 1, rising
  std::array<float, 3> srgb{};  ///< as in a picture's pixels, 0 to 1
};

/// The colours of the shaded mode, from the lowest to the highest height.
struct Palette {
  static constexpr int kMostStops = 12;
  std::array<ColorStop, kMostStops> stops{};
  int count = 0;

  static Palette land();     ///< meadows, forests, rock and snow
  static Palette lowland();  ///< meadows to brown hills: no snow on the top of a low hill
  /// land() or lowland(), to suit the highest ground there is, in metres.
  static Palette forGround(double highMeters);
  static Palette grey();  ///< the Moon and other bare worlds
  static Palette
  even();  ///< the ramp of ColorMode::Height: even steps of lightness, safe for the colour-blind
};

/// Another camera whose field of view is drawn into the scene, as lines.
struct FrustumOverlay {
  Camera camera;
  double lengthMeters = 0.0;  ///< how far the lines reach from its eye
};

/// How a picture looks. A plain value; the defaults make a picture worth showing.
struct RenderStyle {
  ColorMode mode = ColorMode::Shaded;
  OutlineMode outline = OutlineMode::None;
  double exaggeration = 1.0;         ///< of heights, positive. Cameras live in the exaggerated world.
  double sunAzimuthDegrees = 315.0;  ///< from north, clockwise; maps are lit from the north-west
  double sunAltitudeDegrees = 38.0;  ///< above the horizon, in (0, 90]
  bool haze = true;                  ///< not over slope, normals and errors
  double hazeDistanceMeters =
      0.0;                     ///< where haze hides two thirds of the ground; 0: to suit the world's size
  double lowMeters = 0.0;      ///< the height of the ramp's first colour, metres, not exaggerated
  double highMeters = 3000.0;  ///< the height of its last colour
  std::optional<double> waterLevelMeters;  ///< ground at or below it is drawn as water (shaded mode)
  /// Only ground so near to that level is; lower ground is dry. Nothing: all below is water.
  std::optional<double> waterWithinMeters;
  Palette palette = Palette::land();
  double imageryRelief = 0.45;     ///< how much of light and shade lies over pictures: 0 none, 1 all
  double imageryBrightness = 1.0;  ///< a factor on pictures
  double tauPixels = 1.0;          ///< the unit of ColorMode::Error
  int samples = 4;                 ///< a pixel, at least 1; rounded up to what the GPU can do
  std::optional<FrustumOverlay> frustum;
};

}  // namespace terrane
