#include "synth_ground.h"

#include <algorithm>
#include <cmath>

#include "synth_noise.h"
#include "synth_window.h"

namespace terrane::synth {
namespace {

/// Weights of the cubic B-spline for the four nodes around a point.
inline void splineWeights(float t, float w[4]) {
  const float u = 1.0f - t;
  w[0] = u * u * u * (1.0f / 6.0f);
  w[1] = (4.0f - 6.0f * t * t + 3.0f * t * t * t) * (1.0f / 6.0f);
  w[2] = (4.0f - 6.0f * u * u + 3.0f * u * u * u) * (1.0f / 6.0f);
  w[3] = t * t * t * (1.0f / 6.0f);
}

float splineHeight(const World& world, float nodeX, float nodeY) {
  const float floorX = std::floor(nodeX);
  const float floorY = std::floor(nodeY);
  const int col = static_cast<int>(floorX);
  const int row = static_cast<int>(floorY);
  float wx[4];
  float wy[4];
  splineWeights(nodeX - floorX, wx);
  splineWeights(nodeY - floorY, wy);
  const int c[4] = {wrapCell(col - 1), wrapCell(col), wrapCell(col + 1), wrapCell(col + 2)};
  float sum = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const float* line = world.spline.data() + static_cast<size_t>(wrapCell(row - 1 + k)) * kWorldCells;
    sum += wy[k] * (wx[0] * line[c[0]] + wx[1] * line[c[1]] + wx[2] * line[c[2]] + wx[3] * line[c[3]]);
  }
  return sum;
}

float bilinear(const std::vector<float>& map, float nodeX, float nodeY) {
  const float floorX = std::floor(nodeX);
  const float floorY = std::floor(nodeY);
  const int col = static_cast<int>(floorX);
  const int row = static_cast<int>(floorY);
  const float fx = nodeX - floorX;
  return lerp(lerp(map[nodeIndex(col, row)], map[nodeIndex(col + 1, row)], fx),
              lerp(map[nodeIndex(col, row + 1)], map[nodeIndex(col + 1, row + 1)], fx), nodeY - floorY);
}

/// A straight piece of a river bed, in nodes of the world near the block at work.
struct RiverPiece {
  float x, y, z;      ///< upper end; z is the bed, metres
  float dx, dy, dz;   ///< to the lower end
  float inverse;      ///< 1 / squared length
  float floorMeters;  ///< half the width of the flat floor
  float reach;        ///< metres from the bed to where the river stops shaping the ground
  float waterMeters;  ///< half the width of the water
};

constexpr float kSpringArea = 0.25f;  ///< km2 that make a stream
constexpr int kCurvePieces = 3;
constexpr float kMaxReach = 260.0f;

/// The pieces of all streams with a node within [col0, col1] x [row0, row1]: through each node one curve
/// from every donor stream, from middle to middle of the links, so that streams bend and join smoothly.
void collectRivers(const World& world, float spacingMeters, int col0, int row0, int col1, int row1,
                   std::vector<RiverPiece>& pieces) {
  pieces.clear();
  for (int row = row0; row <= row1; ++row) {
    for (int col = col0; col <= col1; ++col) {
      const size_t node = nodeIndex(col, row);
      const float area = world.area[node] * 1.0e-6f;
      if (area < kSpringArea || world.receiver[node] == kNoReceiver || world.inLake[node]) continue;
      const int direction = world.receiver[node];
      const int downCol = col + kNeighbourCol[direction];
      const int downRow = row + kNeighbourRow[direction];
      const size_t down = nodeIndex(downCol, downRow);
      const float root = std::sqrt(area);
      const float cut = std::min(0.6f + 0.5f * std::sqrt(root), 4.0f);
      const auto bed = [cut](float height) { return height - cut; };
      RiverPiece piece{};
      piece.floorMeters = std::max(std::min(3.0f + 5.0f * root, 130.0f), 0.7f * spacingMeters);
      piece.reach = std::min(piece.floorMeters + 75.0f + 10.0f * root, kMaxReach);
      piece.waterMeters = std::min(1.3f * root, 70.0f);
      const float x1 = static_cast<float>(col) + world.courseCol[node];
      const float y1 = static_cast<float>(row) + world.courseRow[node];
      const float x2 = 0.5f * (x1 + static_cast<float>(downCol) + world.courseCol[down]);
      const float y2 = 0.5f * (y1 + static_cast<float>(downRow) + world.courseRow[down]);
      const float z1 = bed(world.height[node]);
      const float z2 = bed(0.5f * (world.height[node] + world.height[down]));
      const auto addCurve = [&](float x0, float y0, float z0) {
        float x = x0;
        float y = y0;
        float z = z0;
        for (int k = 1; k <= kCurvePieces; ++k) {
          const float t = static_cast<float>(k) / kCurvePieces;
          const float a = (1.0f - t) * (1.0f - t);
          const float b = 2.0f * t * (1.0f - t);
          const float c = t * t;
          piece.x = x;
          piece.y = y;
          piece.z = z;
          x = a * x0 + b * x1 + c * x2;
          y = a * y0 + b * y1 + c * y2;
          z = a * z0 + b * z1 + c * z2;
          piece.dx = x - piece.x;
          piece.dy = y - piece.y;
          piece.dz = z - piece.z;
          piece.inverse = 1.0f / (piece.dx * piece.dx + piece.dy * piece.dy + 1.0e-9f);
          pieces.push_back(piece);
        }
      };
      bool spring = true;
      for (int d = 0; d < 8; ++d) {
        const int upCol = col - kNeighbourCol[d];
        const int upRow = row - kNeighbourRow[d];
        const size_t up = nodeIndex(upCol, upRow);
        if (world.receiver[up] != d || world.area[up] * 1.0e-6f < kSpringArea) continue;
        spring = false;
        addCurve(0.5f * (x1 + static_cast<float>(upCol) + world.courseCol[up]),
                 0.5f * (y1 + static_cast<float>(upRow) + world.courseRow[up]),
                 bed(0.5f * (world.height[node] + world.height[up])));
      }
      if (spring) addCurve(x1, y1, z1);
    }
  }
}

/// sin(2 pi turns), to about 0.001; the same bits everywhere.
inline float sineOfTurns(float turns) {
  const float t = turns - ((turns + 12582912.0f) - 12582912.0f);
  const float y = 8.0f * t * (1.0f - 2.0f * std::fabs(t));
  return y * (0.775f + 0.225f * std::fabs(y));
}

/// One octave of gullies: waves whose crests run down the slope. Around random pivots, one a cell, stand
/// plane waves across the local slope; their blend is scaled to full strength, so that gullies run on from
/// pivot to pivot, split and join.
class Gullies {
 public:
  void add(const Window& window, double wavelength, float strength, uint32_t seed,
           const std::vector<float>& share, std::vector<float>& height, std::vector<float>& slopeX,
           std::vector<float>& slopeY) {
    const size_t count = window.count();
    for (auto* field : {&sideX_, &sideY_, &cosine_, &sine_, &steep_}) field->resize(count);
    std::fill(cosine_.begin(), cosine_.end(), 0.0f);
    std::fill(sine_.begin(), sine_.end(), 0.0f);
    const float frequency = static_cast<float>(1.0 / wavelength);
    for (size_t i = 0; i < count; ++i) {
      const float steep = std::sqrt(slopeX[i] * slopeX[i] + slopeY[i] * slopeY[i]);
      const float scale = frequency / (steep + 1.0e-5f);
      steep_[i] = steep;
      sideX_[i] = -slopeY[i] * scale;
      sideY_[i] = slopeX[i] * scale;
    }
    const double cell = wavelength * 1.1;
    const float radius = static_cast<float>(cell * 1.2);
    const int32_t cellCol0 =
        static_cast<int32_t>(std::floor((window.x.front() - static_cast<double>(radius)) / cell));
    const int32_t cellCol1 =
        static_cast<int32_t>(std::floor((window.x.back() + static_cast<double>(radius)) / cell));
    const int32_t cellRow0 =
        static_cast<int32_t>(std::floor((window.y.front() - static_cast<double>(radius)) / cell));
    const int32_t cellRow1 =
        static_cast<int32_t>(std::floor((window.y.back() + static_cast<double>(radius)) / cell));
    for (int32_t cellRow = cellRow0; cellRow <= cellRow1; ++cellRow) {
      for (int32_t cellCol = cellCol0; cellCol <= cellCol1; ++cellCol) {
        const uint32_t chance = hashCell(cellCol, cellRow, seed);
        addPivot(window, (static_cast<double>(cellCol) + static_cast<double>(unitLow(chance))) * cell,
                 (static_cast<double>(cellRow) + static_cast<double>(unitHigh(chance))) * cell, radius);
      }
    }
    const float amplitude = strength * static_cast<float>(wavelength);
    const float lateral = -amplitude * 6.2831853f;
    for (size_t i = 0; i < count; ++i) {
      const float c = cosine_[i];
      const float s = sine_[i];
      const float unit = 1.0f / std::sqrt(c * c + s * s + 0.02f);
      const float power = std::min(steep_[i], 0.8f) * share[i];
      height[i] += amplitude * power * (c * unit - 0.25f);
      const float along = lateral * power * s * unit;
      slopeX[i] += along * sideX_[i];
      slopeY[i] += along * sideY_[i];
    }
  }

 private:
  void addPivot(const Window& window, double pivotX, double pivotY, float radius) {
    const double reach = static_cast<double>(radius);
    const auto range = [](const std::vector<double>& axis, double from, double to) {
      const auto begin = std::lower_bound(axis.begin(), axis.end(), from);
      return std::pair{static_cast<int>(begin - axis.begin()),
                       static_cast<int>(std::upper_bound(begin, axis.end(), to) - axis.begin())};
    };
    const auto [col0, col1] = range(window.x, pivotX - reach, pivotX + reach);
    const auto [row0, row1] = range(window.y, pivotY - reach, pivotY + reach);
    if (col0 >= col1 || row0 >= row1) return;
    const int width = col1 - col0;
    dx_.resize(static_cast<size_t>(width));
    for (int k = 0; k < width; ++k)
      dx_[static_cast<size_t>(k)] = static_cast<float>(window.x[static_cast<size_t>(col0 + k)] - pivotX);
    const float inverse = 1.0f / (radius * radius);
    for (int row = row0; row < row1; ++row) {
      const float dy = static_cast<float>(window.y[static_cast<size_t>(row)] - pivotY);
      const float dy2 = 1.0f - dy * dy * inverse;
      const size_t start = window.at(col0, row);
      const float* __restrict dx = dx_.data();
      const float* __restrict sideX = sideX_.data() + start;
      const float* __restrict sideY = sideY_.data() + start;
      float* __restrict cosine = cosine_.data() + start;
      float* __restrict sine = sine_.data() + start;
      for (int k = 0; k < width; ++k) {
        const float left = dy2 - dx[k] * dx[k] * inverse;
        const float inside = left > 0.0f ? left : 0.0f;
        const float weight = inside * inside * inside;
        const float turns = dx[k] * sideX[k] + dy * sideY[k];
        cosine[k] += weight * sineOfTurns(turns + 0.25f);
        sine[k] += weight * sineOfTurns(turns);
      }
    }
  }

  std::vector<float> sideX_, sideY_, cosine_, sine_, steep_, dx_;
};

/// Makes the last metres above the water gentle, so that coasts have beaches.
inline float beach(float height) {
  const float distance = std::fabs(height);
  if (distance >= 7.0f) return height;
  const float t = distance * (1.0f / 7.0f);
  return height * (0.3f + 0.7f * t * t * (3.0f - 2.0f * t));
}

}  // namespace

Ground::Ground(const World& world, double spacingMeters)
    : world_(world),
      spacing_(spacingMeters),
      centreX_(static_cast<double>(world.centreCol) * static_cast<double>(kCellMeters)),
      centreY_(static_cast<double>(world.centreRow) * static_cast<double>(kCellMeters)) {}

void Ground::evaluate(int64_t col0, int64_t row0, int cols, int rows, GroundTile& tile) const {
  constexpr int kBorder = 1;  // for the slopes
  Window window;
  window.cols = cols + 2 * kBorder;
  window.rows = rows + 2 * kBorder;
  for (int col = 0; col < window.cols; ++col)
    window.x.push_back(static_cast<double>(col0 + col - kBorder) * spacing_);
  for (int row = 0; row < window.rows; ++row)
    window.y.push_back(static_cast<double>(row0 + row - kBorder) * spacing_);
  const size_t count = window.count();

  // Bend the plane, so that neither the coarse grid nor its eight directions show.
  std::vector<float> bendX(count, 0.0f), bendY(count, 0.0f);
  const struct {
    double wavelength;
    float strength;
  } kBends[] = {{5200.0, 600.0f}, {1900.0, 270.0f}, {640.0, 75.0f}, {230.0, 22.0f}};
  uint32_t salt = world_.seed + 1000;
  for (const auto& bend : kBends) {
    addNoise(window, bend.wavelength, bend.strength, salt++, bendX);
    addNoise(window, bend.wavelength, bend.strength, salt++, bendY);
  }
  std::vector<float> nodeX(count), nodeY(count), height(count), flatness(count), calm(count, 1.0f);
  std::vector<float> riverWater(count, 1.0e9f);
  // note: nodes are counted from the world's centre, where floats are fine.
  const int blockSamples = std::clamp(static_cast<int>(160.0 / spacing_), 1, 16);
  const double perNode = 1.0 / static_cast<double>(kCellMeters);
  for (int row = 0; row < window.rows; ++row) {
    const double y = (window.y[static_cast<size_t>(row)] + centreY_) * perNode;
    for (int col = 0; col < window.cols; ++col) {
      const size_t i = window.at(col, row);
      const double x = (window.x[static_cast<size_t>(col)] + centreX_) * perNode;
      nodeX[i] = static_cast<float>(x + static_cast<double>(bendX[i]) * perNode);
      nodeY[i] = static_cast<float>(y + static_cast<double>(bendY[i]) * perNode);
      height[i] = splineHeight(world_, nodeX[i], nodeY[i]);
      flatness[i] = bilinear(world_.flatness, nodeX[i], nodeY[i]);
    }
  }

  // The slopes that gullies will follow: those of the valleys, not of the banks carved into them.
  std::vector<float> slopeX(count, 0.0f), slopeY(count, 0.0f), share(count);
  const float perMeter = static_cast<float>(0.5 / spacing_);
  for (int row = 1; row + 1 < window.rows; ++row) {
    for (int col = 1; col + 1 < window.cols; ++col) {
      const size_t i = window.at(col, row);
      slopeX[i] = (height[i + 1] - height[i - 1]) * perMeter;
      slopeY[i] = (height[window.at(col, row + 1)] - height[window.at(col, row - 1)]) * perMeter;
    }
  }

  // Carve the rivers' beds, block by block with the few pieces that come near.
  std::vector<RiverPiece> pieces;
  if (spacing_ < 200.0) {
    for (int blockRow = 0; blockRow < window.rows; blockRow += blockSamples) {
      for (int blockCol = 0; blockCol < window.cols; blockCol += blockSamples) {
        const int endRow = std::min(blockRow + blockSamples, window.rows);
        const int endCol = std::min(blockCol + blockSamples, window.cols);
        float minX = 1.0e9f, maxX = -1.0e9f, minY = 1.0e9f, maxY = -1.0e9f;
        for (int row = blockRow; row < endRow; ++row) {
          for (int col = blockCol; col < endCol; ++col) {
            const size_t i = window.at(col, row);
            minX = std::min(minX, nodeX[i]);
            maxX = std::max(maxX, nodeX[i]);
            minY = std::min(minY, nodeY[i]);
            maxY = std::max(maxY, nodeY[i]);
          }
        }
        constexpr float kMargin = kMaxReach / kCellMeters + 1.0f;
        collectRivers(world_, static_cast<float>(spacing_), static_cast<int>(std::floor(minX - kMargin)),
                      static_cast<int>(std::floor(minY - kMargin)),
                      static_cast<int>(std::ceil(maxX + kMargin)),
                      static_cast<int>(std::ceil(maxY + kMargin)), pieces);
        std::erase_if(pieces, [&](const RiverPiece& piece) {
          const float reach = piece.reach * (1.0f / kCellMeters);
          return std::max(piece.x, piece.x + piece.dx) + reach < minX ||
                 std::min(piece.x, piece.x + piece.dx) - reach > maxX ||
                 std::max(piece.y, piece.y + piece.dy) + reach < minY ||
                 std::min(piece.y, piece.y + piece.dy) - reach > maxY;
        });
        if (pieces.empty()) continue;
        for (int row = blockRow; row < endRow; ++row) {
          for (int col = blockCol; col < endCol; ++col) {
            const size_t i = window.at(col, row);
            const float base = height[i];
            float carved = base;
            for (const RiverPiece& piece : pieces) {
              const float px = nodeX[i] - piece.x;
              const float py = nodeY[i] - piece.y;
              const float t = clamp01((px * piece.dx + py * piece.dy) * piece.inverse);
              const float ex = px - t * piece.dx;
              const float ey = py - t * piece.dy;
              const float squared = (ex * ex + ey * ey) * (kCellMeters * kCellMeters);
              if (squared >= piece.reach * piece.reach) continue;
              const float distance = std::sqrt(squared);
              const float outside = std::max(0.0f, distance - piece.floorMeters);
              const float target = piece.z + t * piece.dz + 0.015f * distance + 0.30f * outside;
              const float fade = 1.0f - smoothStep(0.35f * piece.reach, piece.reach, distance);
              carved = std::min(carved, base - fade * std::max(0.0f, base - target));
              calm[i] = std::min(calm[i], outside / (piece.reach - piece.floorMeters));
              if (piece.waterMeters > 2.5f)
                riverWater[i] = std::min(riverWater[i], distance - piece.waterMeters);
            }
            height[i] = carved;
          }
        }
      }
    }
  }

  // Gullies follow the slope, finer ones the slope that coarser ones left.
  for (size_t i = 0; i < count; ++i)
    share[i] = smoothStep(0.0f, 0.6f, calm[i]) * smoothStep(-4.0f, 12.0f, height[i]);
  const struct {
    double wavelength;
    float strength;
  } kGullies[] = {{330.0, 0.105f}, {150.0, 0.09f}, {68.0, 0.07f}, {31.0, 0.045f},
                  {14.0, 0.04f},   {6.5, 0.03f},   {3.0, 0.02f}};
  Gullies gullies;
  for (const auto& octave : kGullies) {
    ++salt;
    if (octave.wavelength < 2.8 * spacing_) break;
    gullies.add(window, octave.wavelength, octave.strength, salt, share, height, slopeX, slopeY);
  }

  // Hand out the inner rectangle, with the water laid over it.
  tile.cols = cols;
  tile.rows = rows;
  const size_t tileCount = static_cast<size_t>(cols) * static_cast<size_t>(rows);
  tile.height.resize(tileCount);
  tile.water.resize(tileCount);
  tile.depth.resize(tileCount);
  tile.flatness.resize(tileCount);
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const size_t i = window.at(col + kBorder, row + kBorder);
      const size_t to = static_cast<size_t>(row) * static_cast<size_t>(cols) + static_cast<size_t>(col);
      const float ground = beach(height[i]);
      const float lake = world_.lakeLevel[nodeIndex(static_cast<int>(std::floor(nodeX[i] + 0.5f)),
                                                    static_cast<int>(std::floor(nodeY[i] + 0.5f)))];
      float surface = ground;
      Water water = riverWater[i] < 0.0f ? Water::kRiver : Water::kNone;
      if (lake != kNoLake && ground <= lake) {
        surface = lake;
        water = Water::kLake;
      }
      if (surface <= 0.0f) {
        surface = 0.0f;
        water = Water::kSea;
      }
      tile.height[to] = std::floor(surface * 256.0f + 0.5f) * (1.0f / 256.0f);
      tile.water[to] = water;
      tile.depth[to] = surface - ground;
      tile.flatness[to] = flatness[i];
    }
  }
}

}  // namespace terrane::synth
