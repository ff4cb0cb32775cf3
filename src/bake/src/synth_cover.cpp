#include "synth_cover.h"

#include <algorithm>
#include <cmath>

#include "synth_noise.h"
#include "synth_window.h"

namespace terrane::synth {
namespace {

struct Color {
  float r, g, b;
};

inline Color mix(Color a, Color b, float t) {
  return {lerp(a.r, b.r, t), lerp(a.g, b.g, t), lerp(a.b, b.b, t)};
}
inline Color scale(Color a, float s) {
  return {a.r * s, a.g * s, a.b * s};
}

constexpr Color kSnow{238, 241, 245};
constexpr Color kRock{128, 120, 110};
constexpr Color kDarkRock{98, 92, 86};
constexpr Color kScree{156, 149, 137};
constexpr Color kHeath{126, 119, 84};
constexpr Color kMeadow{126, 138, 82};
constexpr Color kForest{50, 70, 44};
constexpr Color kLeafForest{76, 96, 54};
constexpr Color kSand{208, 194, 156};
constexpr Color kShallow{92, 146, 150};
constexpr Color kSea{24, 58, 92};
constexpr Color kLakeShore{66, 104, 104};
constexpr Color kLake{22, 54, 74};
constexpr Color kRiver{66, 98, 104};
constexpr Color kFields[] = {{186, 168, 108}, {126, 144, 70},  {150, 162, 88}, {142, 116, 84},
                             {104, 130, 62},  {198, 184, 126}, {134, 150, 78}, {166, 142, 98}};

/// The colour of the field at a place: parcels of one size and direction around each village.
Color fieldColor(double x, double y, uint32_t seed, bool& hedge) {
  // The nearest village of the nine around.
  constexpr double kVillage = 1500.0;
  const double u = x / kVillage;
  const double v = y / kVillage;
  const int32_t cellCol = static_cast<int32_t>(std::floor(u));
  const int32_t cellRow = static_cast<int32_t>(std::floor(v));
  double best = 1.0e9;
  double villageX = 0.0;
  double villageY = 0.0;
  uint32_t village = 0;
  for (int32_t row = cellRow - 1; row <= cellRow + 1; ++row) {
    for (int32_t col = cellCol - 1; col <= cellCol + 1; ++col) {
      const uint32_t chance = hashCell(col, row, seed);
      const double px = col + static_cast<double>(unitLow(chance));
      const double py = row + static_cast<double>(unitHigh(chance));
      const double distance = (px - u) * (px - u) + (py - v) * (py - v);
      if (distance < best) {
        best = distance;
        villageX = px * kVillage;
        villageY = py * kVillage;
        village = hashCell(col, row, seed + 1);
      }
    }
  }
  // Its parcels are strips of a rotated grid, each cut where chance wants.
  const float angleX = unitLow(village) - 0.5f;
  const float angleY = unitHigh(village) - 0.5f;
  const float length = std::sqrt(angleX * angleX + angleY * angleY) + 1.0e-4f;
  const float dx = static_cast<float>(x - villageX);
  const float dy = static_cast<float>(y - villageY);
  const float along = (dx * angleX + dy * angleY) / length;
  const float across = (dy * angleX - dx * angleY) / length;
  const float width = 60.0f + 110.0f * unitLow(village * 0x9E3779B1u);
  const float strip = std::floor(across / width);
  const int32_t stripIndex = static_cast<int32_t>(strip);
  const uint32_t stripChance = hashCell(stripIndex, 5, village);
  const float cut = 150.0f + 260.0f * unitLow(stripChance);
  const float part = along / cut + unitHigh(stripChance);
  const float parcel = std::floor(part);
  const float edge = std::min(std::min(across - strip * width, (strip + 1.0f) * width - across),
                              cut * std::min(part - parcel, parcel + 1.0f - part));
  hedge = edge < 3.5f;
  const uint32_t chance = hashCell(stripIndex, static_cast<int32_t>(parcel), village);
  return scale(kFields[chance & 7u], 0.93f + 0.12f * unitHigh(chance));
}

inline uint8_t toByte(float v) {
  return static_cast<uint8_t>(std::clamp(v + 0.5f, 0.0f, 255.0f));
}

}  // namespace

void colorGround(const Ground& ground, int64_t col0, int64_t row0, int cols, int rows, const GroundTile& tile,
                 std::vector<uint8_t>& red, std::vector<uint8_t>& green, std::vector<uint8_t>& blue) {
  Window window;
  window.cols = cols;
  window.rows = rows;
  for (int col = 0; col < cols; ++col)
    window.x.push_back(static_cast<double>(col0 + col) * ground.spacingMeters());
  for (int row = 0; row < rows; ++row)
    window.y.push_back(static_cast<double>(row0 + row) * ground.spacingMeters());
  const size_t count = window.count();
  red.resize(count);
  green.resize(count);
  blue.resize(count);

  // Slow noise bends every border between covers, fine noise is the texture of woods and stones.
  const uint32_t seed = ground.seed() + 5000;
  std::vector<float> broad(count, 0.0f), patchy(count, 0.0f), fine(count, 0.0f);
  addNoise(window, 2300.0, 0.6f, seed + 1, broad);
  addNoise(window, 800.0, 0.4f, seed + 2, broad);
  addNoise(window, 420.0, 0.5f, seed + 3, patchy);
  addNoise(window, 170.0, 0.35f, seed + 4, patchy);
  addNoise(window, 70.0, 0.3f, seed + 5, patchy);
  addNoise(window, 23.0, 0.5f, seed + 6, fine);
  addNoise(window, 51.0, 0.5f, seed + 7, fine);

  const float perMeter = static_cast<float>(0.5 / ground.spacingMeters());
  const int stride = cols + 2;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const size_t i = window.at(col, row);
      const size_t k =
          static_cast<size_t>(row + 1) * static_cast<size_t>(stride) + static_cast<size_t>(col + 1);
      const float height = tile.height[k];
      const float depth = tile.depth[k];
      const float texture = 1.0f + 0.10f * fine[i];
      Color color{};
      switch (tile.water[k]) {
        case Water::kSea: {
          const float clear = 1.0f / (1.0f + depth * 0.10f);
          color = mix(kSea, kShallow, clear * clear * (0.85f + 0.15f * broad[i]));
          break;
        }
        case Water::kLake:
          color = mix(kLakeShore, kLake, smoothStep(0.0f, 18.0f, depth));
          break;
        case Water::kRiver:
          color = kRiver;
          break;
        case Water::kNone: {
          const float slopeX = (tile.height[k + 1] - tile.height[k - 1]) * perMeter;
          const size_t above = k - static_cast<size_t>(stride);
          const size_t below = k + static_cast<size_t>(stride);
          const float slopeY = (tile.height[below] - tile.height[above]) * perMeter;
          const float slope = std::sqrt(slopeX * slopeX + slopeY * slopeY);
          const float facingNorth = slopeY / (slope + 0.1f);
          const float hollow = (tile.height[k + 1] + tile.height[k - 1] + tile.height[above] +
                                tile.height[below] - 4.0f * height) *
                               perMeter;

          // From the valley up: meadow, wood, heath, rock, snow.
          const float woodLine = 860.0f + 140.0f * broad[i] - 90.0f * facingNorth;
          const float flat = tile.flatness[k];
          color =
              scale(mix(kMeadow, kHeath, smoothStep(350.0f, woodLine, height + 120.0f * patchy[i])), texture);
          const bool farmed = slope < 0.13f && height > 3.0f && height < 420.0f;
          const float farms =
              farmed ? smoothStep(-0.25f, 0.05f, broad[i] + 0.7f * (flat - 0.35f) - 3.0f * slope) : 0.0f;
          const float wooded =
              smoothStep(-0.12f, 0.10f,
                         patchy[i] + 0.35f * broad[i] + 1.3f * std::min(slope, 0.45f) - 0.30f * flat +
                             0.4f * hollow) *
              (1.0f - smoothStep(woodLine - 90.0f, woodLine + 90.0f, height + 90.0f * patchy[i])) *
              (1.0f - smoothStep(1.05f, 1.4f, slope));
          if (farms > 0.5f) {
            bool hedge = false;
            color = fieldColor(window.x[static_cast<size_t>(col)], window.y[static_cast<size_t>(row)],
                               seed + 20, hedge);
            color = hedge ? mix(color, kForest, 0.55f) : scale(color, 1.0f + 0.03f * fine[i]);
          }
          const Color wood =
              mix(kLeafForest, kForest, smoothStep(100.0f, 650.0f, height + 250.0f * broad[i]));
          const float woodHere = farms > 0.5f ? smoothStep(0.32f, 0.42f, patchy[i]) : wooded;
          color = mix(color, scale(wood, 1.0f + 0.22f * fine[i]), woodHere);
          const Color stone = mix(mix(kRock, kDarkRock, smoothStep(-0.3f, 0.5f, patchy[i])), kScree,
                                  smoothStep(0.0f, 0.5f, hollow));
          const float bare = smoothStep(
              0.78f, 1.10f, slope + 0.12f * patchy[i] + 0.0004f * std::max(-500.0f, height - 800.0f));
          color = mix(color, scale(stone, texture), bare);
          const float snowLine =
              1230.0f + 150.0f * broad[i] + 60.0f * patchy[i] - 190.0f * facingNorth - 350.0f * hollow;
          const float snow =
              smoothStep(-80.0f, 120.0f, height - snowLine - 520.0f * std::max(0.0f, slope - 0.55f));
          color = mix(color, kSnow, snow);
          // Sand and shingle along the sea, where the shore is gentle.
          const float sand = (1.0f - smoothStep(1.2f, 3.0f, height + 0.8f * patchy[i])) *
                             (1.0f - smoothStep(0.10f, 0.3f, slope));
          color = mix(color, scale(kSand, 1.0f + 0.05f * fine[i]), height < 4.0f ? sand : 0.0f);
          color = scale(color, 1.0f - std::clamp(0.10f * hollow, -0.06f, 0.08f));
          break;
        }
      }
      red[i] = toByte(color.r);
      green[i] = toByte(color.g);
      blue[i] = toByte(color.b);
    }
  }
}

}  // namespace terrane::synth
