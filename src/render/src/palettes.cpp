#include <initializer_list>

#include "terrane/render/render_style.h"

namespace terrane {

namespace {

/// A palette from positions and colours written as 0xRRGGBB.
struct Stop {
  float position;
  uint32_t rgb;
};
Palette makePalette(std::initializer_list<Stop> stops) {
  Palette out;
  for (const Stop& stop : stops) {
    const auto channel = [&](int shift) { return static_cast<float>(stop.rgb >> shift & 255U) / 255.0F; };
    out.stops[static_cast<size_t>(out.count++)] = {stop.position, {channel(16), channel(8), channel(0)}};
  }
  return out;
}

}  // namespace

Palette Palette::land() {
  return makePalette({{0.00F, 0x4f7a4a},
                      {0.10F, 0x668c50},
                      {0.22F, 0x8b9f5c},
                      {0.35F, 0xb3ac70},
                      {0.48F, 0xbd9f6c},
                      {0.60F, 0xa28461},
                      {0.72F, 0x8b7a6e},
                      {0.83F, 0xa39d97},
                      {0.92F, 0xdcdcda},
                      {1.00F, 0xfafbfd}});
}

Palette Palette::lowland() {
  return makePalette({{0.00F, 0x4f7a4a},
                      {0.15F, 0x668c50},
                      {0.32F, 0x8b9f5c},
                      {0.50F, 0xb3ac70},
                      {0.68F, 0xbd9f6c},
                      {0.85F, 0xa28461},
                      {1.00F, 0x86694f}});
}

Palette Palette::forGround(double highMeters) {
  constexpr double kBareSummitsMeters = 1700.0;
  return highMeters < kBareSummitsMeters ? lowland() : land();
}

Palette Palette::grey() {
  return makePalette(
      {{0.00F, 0x5a5753}, {0.30F, 0x7b7772}, {0.60F, 0x9d9993}, {0.85F, 0xbdb9b3}, {1.00F, 0xd8d5d0}});
}

Palette Palette::even() {
  // The colours of viridis (CC0).
  return makePalette({{0.000F, 0x440154},
                      {0.125F, 0x472d7b},
                      {0.250F, 0x3b528b},
                      {0.375F, 0x2c728e},
                      {0.500F, 0x21918c},
                      {0.625F, 0x28ae80},
                      {0.750F, 0x5ec962},
                      {0.875F, 0xaddc30},
                      {1.000F, 0xfde725}});
}

}  // namespace terrane
