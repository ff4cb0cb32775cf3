#include "synth_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "synth_lakes.h"
#include "synth_noise.h"

namespace terrane::synth {
namespace {

/// Heights and what shapes them on a torus of n x n nodes; the world is grown on ever finer ones.
struct Grid {
  int n = 0;
  float cellMeters = 0.0f;
  std::vector<float> height;
  std::vector<float> continent;  ///< above 0: land
  std::vector<float> uplift;     ///< metres a unit of time
  std::vector<float> erodibility;
  std::vector<float> softness;  ///< erodibility without the chance of each node
  std::vector<uint8_t> receiver;
  std::vector<float> area;
  std::vector<float> offsetCol, offsetRow;  ///< where in its cell a node lies: a lattice would show
  std::vector<int32_t> order;               ///< nodes, every one before the node that it drains to

  size_t count() const { return static_cast<size_t>(n) * static_cast<size_t>(n); }
  size_t neighbour(size_t node, int direction) const {
    const int mask = n - 1;
    const int col = (static_cast<int>(node) & mask) + kNeighbourCol[direction];
    const int row = static_cast<int>(node) / n + kNeighbourRow[direction];
    return static_cast<size_t>(row & mask) * static_cast<size_t>(n) + static_cast<size_t>(col & mask);
  }
  float distance(size_t node, size_t other, int direction) const {
    const float dx = static_cast<float>(kNeighbourCol[direction]) + offsetCol[other] - offsetCol[node];
    const float dy = static_cast<float>(kNeighbourRow[direction]) + offsetRow[other] - offsetRow[node];
    return cellMeters * std::sqrt(dx * dx + dy * dy);
  }
};

constexpr int kMapCells = 512;         ///< the maps of land and uplift are smooth: made once at this size
constexpr float kDrownMeters = 55.0f;  ///< rivers are cut to this depth, then the sea rises into them
constexpr float kErosion = 1.0f / 290.0f;
constexpr float kTalus = 0.70f;
constexpr float kOffset = 0.84f;  ///< of a cell, the range of a node's offset

struct Maps {
  std::vector<float> continent, uplift, erodibility;
};

/// Where land is, how fast it rises and how hard its rock is.
Maps drawMaps(uint32_t seed) {
  Maps maps;
  const size_t count = static_cast<size_t>(kMapCells) * kMapCells;
  maps.continent.resize(count);
  maps.uplift.resize(count);
  maps.erodibility.resize(count);
  for (int row = 0; row < kMapCells; ++row) {
    for (int col = 0; col < kMapCells; ++col) {
      const double u0 = static_cast<double>(col) / kMapCells;
      const double v0 = static_cast<double>(row) / kMapCells;
      // Bend the plane, so that no feature shows the noise's own lattice.
      const double u = u0 + 0.05 * static_cast<double>(periodicFbm(u0, v0, 3, 4, seed + 11));
      const double v = v0 + 0.05 * static_cast<double>(periodicFbm(u0, v0, 3, 4, seed + 12));
      const float continent = 0.52f + periodicFbm(u, v, 2, 7, seed + 1);
      // Ranges follow the zero lines of a slow noise; a second noise opens passes and basins in them.
      const float line = periodicFbm(u, v, 2, 5, seed + 2);
      const float range =
          1.0f - smoothStep(0.0f, 0.55f, std::fabs(line + 0.22f * periodicFbm(u, v, 9, 3, seed + 6)));
      const float massif = smoothStep(-0.25f, 0.45f, periodicFbm(u, v, 5, 4, seed + 3));
      const float hills = smoothStep(-0.1f, 0.7f, periodicFbm(u, v, 7, 4, seed + 4));
      const float inland = smoothStep(0.0f, 0.16f, continent);
      const float rise = 0.018f + 0.12f * hills * hills + range * range * (0.16f + 0.84f * massif);
      const size_t i = static_cast<size_t>(row) * kMapCells + static_cast<size_t>(col);
      maps.continent[i] = continent;
      maps.uplift[i] = rise * (0.12f + 0.88f * inland);
      const float rock = periodicFbm(u, v, 14, 4, seed + 5);
      maps.erodibility[i] = kErosion * (1.0f + 0.75f * rock / (0.6f + std::fabs(rock)));
    }
  }
  return maps;
}

float sampleMap(const std::vector<float>& map, int n, int col, int row) {
  const float scale = static_cast<float>(kMapCells) / static_cast<float>(n);
  const float x = static_cast<float>(col) * scale;
  const float y = static_cast<float>(row) * scale;
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const auto at = [&map](int c, int r) {
    constexpr int mask = kMapCells - 1;
    return map[static_cast<size_t>(r & mask) * kMapCells + static_cast<size_t>(c & mask)];
  };
  return lerp(lerp(at(x0, y0), at(x0 + 1, y0), fx), lerp(at(x0, y0 + 1), at(x0 + 1, y0 + 1), fx), fy);
}

void applyMaps(const Maps& maps, Grid& grid, uint32_t seed) {
  grid.offsetCol.resize(grid.count());
  grid.offsetRow.resize(grid.count());
  grid.continent.resize(grid.count());
  grid.uplift.resize(grid.count());
  grid.erodibility.resize(grid.count());
  grid.softness.resize(grid.count());
  for (int row = 0; row < grid.n; ++row) {
    for (int col = 0; col < grid.n; ++col) {
      const size_t i = static_cast<size_t>(row) * static_cast<size_t>(grid.n) + static_cast<size_t>(col);
      const uint32_t chance = hashCell(col, row, seed + 77u * static_cast<uint32_t>(grid.n));
      grid.offsetCol[i] = kOffset * (unitLow(chance) - 0.5f);
      grid.offsetRow[i] = kOffset * (unitHigh(chance) - 0.5f);
      grid.continent[i] = sampleMap(maps.continent, grid.n, col, row);
      grid.uplift[i] = sampleMap(maps.uplift, grid.n, col, row);
      grid.softness[i] = sampleMap(maps.erodibility, grid.n, col, row);
      grid.erodibility[i] = grid.softness[i] * (0.35f + 1.3f * unitLow(chance * 0x9E3779B1u));
    }
  }
}

float seaFloor(float continent) {
  return -kDrownMeters + 900.0f * continent;
}

/// Raises every land node just enough that it can drain: a flood from the sea inwards, lowest first.
void fillPits(Grid& grid) {
  constexpr float kBucketMeters = 0.25f;
  constexpr float kFloor = -3000.0f;
  constexpr float kStep = 0.002f;
  constexpr int kBuckets = 40000;
  std::vector<int32_t> bucketHead(kBuckets, -1);
  std::vector<int32_t> next(grid.count(), -1);
  std::vector<uint8_t> seen(grid.count(), 0);
  const auto bucketOf = [](float height) {
    return std::clamp(static_cast<int>((height - kFloor) / kBucketMeters), 0, kBuckets - 1);
  };
  const auto push = [&](size_t node) {
    const int bucket = bucketOf(grid.height[node]);
    next[node] = bucketHead[static_cast<size_t>(bucket)];
    bucketHead[static_cast<size_t>(bucket)] = static_cast<int32_t>(node);
    seen[node] = 1;
  };
  for (size_t i = 0; i < grid.count(); ++i) {
    if (grid.continent[i] <= 0.0f) push(i);
  }
  for (int bucket = 0; bucket < kBuckets; ++bucket) {
    while (bucketHead[static_cast<size_t>(bucket)] >= 0) {
      const size_t node = static_cast<size_t>(bucketHead[static_cast<size_t>(bucket)]);
      bucketHead[static_cast<size_t>(bucket)] = next[node];
      for (int direction = 0; direction < 8; ++direction) {
        const size_t other = grid.neighbour(node, direction);
        if (seen[other]) continue;
        // note: uneven steps, or rivers would cross flats along the grid.
        const uint32_t chance = hashCell(static_cast<int32_t>(other), grid.n, 3u);
        grid.height[other] =
            std::max(grid.height[other], grid.height[node] + kStep * (0.2f + 4.0f * unitLow(chance)));
        push(other);
      }
    }
  }
}

/// The steepest way down of every node in a row, kNoReceiver where there is none.
void findReceivers(const Grid& grid, int row, std::vector<float>& steepest, std::vector<int32_t>& receiver) {
  const size_t n = static_cast<size_t>(grid.n);
  const size_t start = static_cast<size_t>(row) * n;
  steepest.assign(n, 0.0f);
  receiver.assign(n, kNoReceiver);
  for (int direction = 0; direction < 8; ++direction) {
    const auto look = [&](size_t col) {
      const size_t node = start + col;
      const size_t other = grid.neighbour(node, direction);
      const float slope = (grid.height[node] - grid.height[other]) / grid.distance(node, other, direction);
      if (slope <= steepest[col]) return;
      steepest[col] = slope;
      receiver[col] = direction;
    };
    // Columns 1 to n - 2 do not wrap around: the compiler takes several at once, and distances are what
    // costs.
    const size_t there = grid.neighbour(start + 1, direction);
    const float* height = &grid.height[start + 1];
    const float* offsetCol = &grid.offsetCol[start + 1];
    const float* offsetRow = &grid.offsetRow[start + 1];
    const float* otherHeight = &grid.height[there];
    const float* otherCol = &grid.offsetCol[there];
    const float* otherRow = &grid.offsetRow[there];
    const float stepCol = static_cast<float>(kNeighbourCol[direction]);
    const float stepRow = static_cast<float>(kNeighbourRow[direction]);
    float* best = &steepest[1];
    int32_t* way = &receiver[1];
    for (size_t k = 0; k + 2 < n; ++k) {
      const float dx = stepCol + otherCol[k] - offsetCol[k];
      const float dy = stepRow + otherRow[k] - offsetRow[k];
      const float slope = (height[k] - otherHeight[k]) / (grid.cellMeters * std::sqrt(dx * dx + dy * dy));
      const int32_t steeper = -static_cast<int32_t>(slope > best[k]);  // all bits, or none
      way[k] = (direction & steeper) | (way[k] & ~steeper);
      best[k] = std::max(slope, best[k]);
    }
    look(0);
    look(n - 1);
  }
}

/// Sends every land node down its steepest slope and orders the nodes from the ridges to the sea.
void routeFlow(Grid& grid) {
  const size_t count = grid.count();
  grid.receiver.assign(count, kNoReceiver);
  std::vector<uint8_t> donors(count, 0);
  std::vector<float> steepest;
  std::vector<int32_t> receiver;
  for (int row = 0; row < grid.n; ++row) {
    findReceivers(grid, row, steepest, receiver);
    for (int col = 0; col < grid.n; ++col) {
      const size_t i = static_cast<size_t>(row) * static_cast<size_t>(grid.n) + static_cast<size_t>(col);
      const int32_t direction = receiver[static_cast<size_t>(col)];
      if (grid.continent[i] <= 0.0f || direction == kNoReceiver) continue;
      grid.receiver[i] = static_cast<uint8_t>(direction);
      ++donors[grid.neighbour(i, direction)];
    }
  }
  // Walk down from every spring as far as all of a node's donors are done.
  grid.order.clear();
  grid.order.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    if (donors[i] != 0) continue;
    size_t node = i;
    for (;;) {
      grid.order.push_back(static_cast<int32_t>(node));
      donors[node] = 255;
      if (grid.receiver[node] == kNoReceiver) break;
      const size_t down = grid.neighbour(node, grid.receiver[node]);
      if (--donors[down] != 0) break;
      node = down;
    }
  }
  const float cellArea = grid.cellMeters * grid.cellMeters;
  grid.area.assign(count, cellArea);
  for (const int32_t node : grid.order) {
    const size_t i = static_cast<size_t>(node);
    if (grid.receiver[i] == kNoReceiver) continue;
    grid.area[grid.neighbour(i, grid.receiver[i])] += grid.area[i];
  }
}

/// One implicit step of uplift and stream-power erosion (Braun and Willett 2013, m = 1/2, n = 1), from the
/// sea upwards; slopes beyond the talus slide down.
void erode(Grid& grid, float time) {
  for (size_t k = grid.order.size(); k-- > 0;) {
    const size_t i = static_cast<size_t>(grid.order[k]);
    if (grid.receiver[i] == kNoReceiver) continue;
    const size_t down = grid.neighbour(i, grid.receiver[i]);
    const float distance = grid.distance(i, down, grid.receiver[i]);
    const float power = grid.erodibility[i] * time * std::sqrt(grid.area[i]) / distance;
    const float raised = grid.height[i] + time * grid.uplift[i];
    const float eroded = (raised + power * grid.height[down]) / (1.0f + power);
    grid.height[i] = eroded;
    const float talus = kTalus * std::min(1.1f, 0.62f + 0.38f * kErosion / grid.softness[i]);
    if (eroded <= grid.height[down] + talus * 0.5f * distance) continue;
    // Too steep: slide until no neighbour lies too far below.
    for (int direction = 0; direction < 8; ++direction) {
      const size_t other = grid.neighbour(i, direction);
      const float limit = grid.height[other] + talus * grid.distance(i, other, direction);
      grid.height[i] = std::min(grid.height[i], std::max(limit, grid.height[down] + 0.05f));
    }
  }
}

/// Lets soil creep: small catchments become round, rivers keep their beds.
void creep(Grid& grid, float share) {
  std::vector<float> before = grid.height;
  const float springArea = 110000.0f;
  for (size_t i = 0; i < grid.count(); ++i) {
    if (grid.continent[i] <= 0.0f) continue;
    float sum = 0.0f;
    for (int direction = 0; direction < 8; ++direction) {
      sum += before[grid.neighbour(i, direction)] * ((direction & 1) ? 0.0833333f : 0.1666667f);
    }
    grid.height[i] += share * springArea / (springArea + grid.area[i]) * (sum - before[i]);
  }
}

/// Doubles the grid, with a little roughness for new springs to choose by.
void refine(Grid& grid, const Maps& maps, uint32_t seed) {
  Grid fine;
  fine.n = grid.n * 2;
  fine.cellMeters = grid.cellMeters * 0.5f;
  applyMaps(maps, fine, seed);
  fine.height.resize(fine.count());
  const int mask = grid.n - 1;
  const auto at = [&](int c, int r) {
    return grid
        .height[static_cast<size_t>(r & mask) * static_cast<size_t>(grid.n) + static_cast<size_t>(c & mask)];
  };
  for (int row = 0; row < fine.n; ++row) {
    for (int col = 0; col < fine.n; ++col) {
      const size_t i = static_cast<size_t>(row) * static_cast<size_t>(fine.n) + static_cast<size_t>(col);
      if (fine.continent[i] <= 0.0f) {
        fine.height[i] = seaFloor(fine.continent[i]);
        continue;
      }
      const int c = col / 2;
      const int r = row / 2;
      const int c1 = c + (col & 1);
      const int r1 = r + (row & 1);
      const float mean = 0.25f * (at(c, r) + at(c1, r) + at(c, r1) + at(c1, r1));
      const float rough = unitLow(hashCell(col, row, seed + static_cast<uint32_t>(fine.n))) - 0.5f;
      fine.height[i] = mean + rough * 0.06f * fine.cellMeters;
    }
  }
  grid = std::move(fine);
}

/// Smooths a torus map `passes` times over about `radius` nodes (running means along rows and columns).
void blur(std::vector<float>& map, int radius, int passes) {
  constexpr int n = kWorldCells;
  const float share = 1.0f / static_cast<float>(2 * radius + 1);
  std::vector<float> line(static_cast<size_t>(n));
  const auto blurLine = [&](size_t start, size_t stride) {
    double sum = 0.0;
    const auto at = [&](int i) { return map[start + static_cast<size_t>(wrapCell(i)) * stride]; };
    for (int i = -radius; i <= radius; ++i) sum += static_cast<double>(at(i));
    for (int i = 0; i < n; ++i) {
      line[static_cast<size_t>(i)] = static_cast<float>(sum) * share;
      sum += static_cast<double>(at(i + radius + 1)) - static_cast<double>(at(i - radius));
    }
    for (int i = 0; i < n; ++i) map[start + static_cast<size_t>(i) * stride] = line[static_cast<size_t>(i)];
  };
  for (int pass = 0; pass < passes; ++pass) {
    for (int i = 0; i < n; ++i) blurLine(static_cast<size_t>(i) * n, 1);
    for (int i = 0; i < n; ++i) blurLine(static_cast<size_t>(i), n);
  }
}

/// Fills valley floors with sediment: heights a little above the river that they drain to are pressed
/// towards it, so that big rivers get flat floors and small ones stay V-shaped.
void layValleyFloors(World& world, const std::vector<int32_t>& order) {
  const size_t count = world.height.size();
  std::vector<float> depth(count);
  for (size_t i = 0; i < count; ++i) {
    const float area = world.area[i] * 1.0e-6f;
    depth[i] = area > 3.0f ? std::min(34.0f, 5.0f * std::sqrt(std::sqrt(area))) : 0.0f;
  }
  // From the sea upwards: the river that each node hangs on, before heights change.
  std::vector<float> river(count), floorDepth(count);
  for (size_t k = order.size(); k-- > 0;) {
    const size_t i = static_cast<size_t>(order[k]);
    if (depth[i] > 0.0f || world.receiver[i] == kNoReceiver) {
      river[i] = world.height[i];
      floorDepth[i] = depth[i];
    } else {
      const size_t down = downstream(world, i);
      river[i] = river[down];
      floorDepth[i] = floorDepth[down];
    }
  }
  blur(floorDepth, 6, 2);
  for (size_t i = 0; i < count; ++i) {
    floorDepth[i] *= 1.0f - 0.9f * world.flatness[i];
    if (world.receiver[i] == kNoReceiver || floorDepth[i] < 0.01f) continue;
    const float above = world.height[i] - river[i];
    const float c = floorDepth[i];
    // Slope 0.12 at the river, 1 far above it.
    const float x = above / c;
    world.height[i] = river[i] + c * (x - 0.88f * x / (1.0f + 0.35f * x * x) * (1.0f / (1.0f + 0.15f * x)));
  }
  // Depths differ a little from node to node: keep every node above the one that it drains to.
  for (size_t k = order.size(); k-- > 0;) {
    const size_t i = static_cast<size_t>(order[k]);
    if (world.receiver[i] == kNoReceiver) continue;
    world.height[i] = std::max(world.height[i], world.height[downstream(world, i)] + 0.001f);
  }
}

/// Draws rivers rounder than the grid's eight directions: every river node moves towards the middle of its
/// largest donor and its receiver, a few times over.
void smoothCourses(World& world, const std::vector<int32_t>& order) {
  constexpr float kRiverArea = 1.0e5f;
  const size_t count = world.height.size();
  world.courseCol.assign(count, 0.0f);
  world.courseRow.assign(count, 0.0f);
  std::vector<int32_t> donor(count, -1);
  std::vector<size_t> rivers;
  for (const int32_t node : order) {
    const size_t i = static_cast<size_t>(node);
    if (world.receiver[i] == kNoReceiver || world.area[i] < kRiverArea) continue;
    rivers.push_back(i);
    int32_t& main = donor[downstream(world, i)];
    if (main < 0 || world.area[i] > world.area[static_cast<size_t>(main)]) main = node;
  }
  for (int pass = 0; pass < 3; ++pass) {
    for (const size_t i : rivers) {
      if (donor[i] < 0) continue;
      const size_t up = static_cast<size_t>(donor[i]);
      const size_t down = downstream(world, i);
      const int toDown = world.receiver[i];
      const int toUp = world.receiver[up];
      const float col = 0.5f * (static_cast<float>(kNeighbourCol[toDown] - kNeighbourCol[toUp]) +
                                world.courseCol[down] + world.courseCol[up]);
      const float row = 0.5f * (static_cast<float>(kNeighbourRow[toDown] - kNeighbourRow[toUp]) +
                                world.courseRow[down] + world.courseRow[up]);
      world.courseCol[i] = std::clamp(0.5f * (world.courseCol[i] + col), -0.6f, 0.6f);
      world.courseRow[i] = std::clamp(0.5f * (world.courseRow[i] + row), -0.6f, 0.6f);
    }
  }
}

/// Coefficients of the cubic B-spline through (very nearly) the heights: two steps of correction.
void fitSpline(World& world) {
  constexpr int n = kWorldCells;
  std::vector<float> rows(world.height.size());
  world.spline = world.height;
  for (int step = 0; step < 2; ++step) {
    for (int row = 0; row < n; ++row) {
      for (int col = 0; col < n; ++col) {
        rows[nodeIndex(col, row)] =
            (world.spline[nodeIndex(col - 1, row)] + 4.0f * world.spline[nodeIndex(col, row)] +
             world.spline[nodeIndex(col + 1, row)]) *
            (1.0f / 6.0f);
      }
    }
    for (int row = 0; row < n; ++row) {
      for (int col = 0; col < n; ++col) {
        const size_t i = nodeIndex(col, row);
        const float smooth =
            (rows[nodeIndex(col, row - 1)] + 4.0f * rows[i] + rows[nodeIndex(col, row + 1)]) * (1.0f / 6.0f);
        world.spline[i] += world.height[i] - smooth;
      }
    }
  }
}

/// The middle of all windows: mountains beside it, and coast, lake and plain within 20 km.
void chooseCentre(World& world) {
  constexpr int kBlock = 64;
  constexpr int kBlocks = kWorldCells / kBlock;
  struct Share {
    float land = 0, lake = 0, high = 0, low = 0;
  };
  std::vector<Share> shares(static_cast<size_t>(kBlocks * kBlocks));
  const float each = 1.0f / (kBlock * kBlock);
  for (int row = 0; row < kWorldCells; ++row) {
    for (int col = 0; col < kWorldCells; ++col) {
      const size_t i = nodeIndex(col, row);
      Share& share = shares[static_cast<size_t>((row / kBlock) * kBlocks + col / kBlock)];
      const float height = world.height[i];
      if (height > 0.0f) share.land += each;
      if (world.inLake[i]) share.lake += each;
      if (height > 900.0f) share.high += each;
      if (height > 0.0f && height < 150.0f) share.low += each;
    }
  }
  const auto window = [&](int col, int row, int half) {
    Share sum;
    for (int r = row - half; r < row + half; ++r) {
      for (int c = col - half; c < col + half; ++c) {
        const Share& share = shares[static_cast<size_t>((r & (kBlocks - 1)) * kBlocks + (c & (kBlocks - 1)))];
        sum.land += share.land;
        sum.lake += share.lake;
        sum.high += share.high;
        sum.low += share.low;
      }
    }
    const float scale = 1.0f / static_cast<float>(4 * half * half);
    return Share{sum.land * scale, sum.lake * scale, sum.high * scale, sum.low * scale};
  };
  float best = -1.0e9f;
  for (int row = 0; row < kBlocks; ++row) {
    for (int col = 0; col < kBlocks; ++col) {
      const Share wide = window(col, row, 4);
      const Share near = window(col, row, 1);
      const float score = std::min(wide.high, 0.35f) * 3.0f + std::min(wide.low, 0.2f) * 2.0f +
                          std::min(wide.lake, 0.03f) * 15.0f - std::fabs(wide.land - 0.8f) * 2.5f +
                          std::min(near.land, 0.95f) + std::min(near.lake, 0.04f) * 8.0f +
                          std::min(near.high, 0.4f) * 1.5f;
      if (score > best) {
        best = score;
        world.centreCol = col * kBlock;
        world.centreRow = row * kBlock;
      }
    }
  }
}

}  // namespace

World growWorld(uint64_t seed) {
  World world;
  world.seed =
      hashCell(static_cast<int32_t>(seed & 0xFFFFFFFFu), static_cast<int32_t>(seed >> 32), 0x7E44A1u);
  const Maps maps = drawMaps(world.seed);

  // Start as a low rough country and let rivers find their ways, coarse first.
  Grid grid;
  grid.n = kWorldCells / 8;
  grid.cellMeters = kCellMeters * 8.0f;
  applyMaps(maps, grid, world.seed);
  grid.height.resize(grid.count());
  for (size_t i = 0; i < grid.count(); ++i) {
    const float rough = unitLow(hashCell(static_cast<int32_t>(i), 7, world.seed));
    grid.height[i] = grid.continent[i] <= 0.0f ? seaFloor(grid.continent[i])
                                               : -kDrownMeters + 60.0f * grid.continent[i] + 20.0f * rough;
  }
  struct Stage {
    int steps;
    float time;
  };
  constexpr std::array<Stage, 4> kStages{{{60, 120.0f}, {24, 80.0f}, {10, 60.0f}, {4, 50.0f}}};
  for (size_t stage = 0; stage < kStages.size(); ++stage) {
    if (stage > 0) refine(grid, maps, world.seed);
    fillPits(grid);
    for (int step = 0; step < kStages[stage].steps; ++step) {
      routeFlow(grid);
      erode(grid, kStages[stage].time);
      creep(grid, 0.4f);
    }
  }
  fillPits(grid);
  routeFlow(grid);

  world.height = std::move(grid.height);
  world.area = std::move(grid.area);
  world.receiver = std::move(grid.receiver);
  world.lakeLevel.assign(world.height.size(), kNoLake);
  world.inLake.assign(world.height.size(), 0);
  // Flat is where little rises for kilometres around.
  world.flatness.resize(world.height.size());
  for (size_t i = 0; i < world.height.size(); ++i) {
    world.flatness[i] = 1.0f - smoothStep(0.015f, 0.09f, grid.uplift[i]);
  }
  blur(world.flatness, 8, 2);
  layValleyFloors(world, grid.order);
  smoothCourses(world, grid.order);
  digLakes(world, world.seed);

  fitSpline(world);
  chooseCentre(world);
  return world;
}

std::shared_ptr<const World> shareWorld(uint64_t seed) {
  static std::mutex mutex;
  static std::weak_ptr<const World> last;
  static uint64_t lastSeed = 0;
  const std::lock_guard lock(mutex);
  std::shared_ptr<const World> world = lastSeed == seed ? last.lock() : nullptr;
  if (!world) {
    world = std::make_shared<const World>(growWorld(seed));
    last = world;
    lastSeed = seed;
  }
  return world;
}

}  // namespace terrane::synth
