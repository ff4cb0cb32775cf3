#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::synth {

/// The coarse shape of one seed's world: a torus of kWorldCells squared nodes, kCellMeters apart, whose
/// heights come from uplift and river erosion, so that every land node drains to a lake or the sea.
/// Node (col, row) lies at x = col * kCellMeters east, y = row * kCellMeters south, wrapped around.
inline constexpr int kWorldCells = 2048;
inline constexpr float kCellMeters = 80.0f;
inline constexpr uint8_t kNoReceiver = 8;

/// The eight neighbours in the order of receiver codes.
inline constexpr int kNeighbourCol[8] = {1, 1, 0, -1, -1, -1, 0, 1};
inline constexpr int kNeighbourRow[8] = {0, 1, 1, 1, 0, -1, -1, -1};

struct World {
  uint32_t seed = 0;
  std::vector<float> height;      ///< metres; the sea's floor is negative
  std::vector<float> spline;      ///< cubic B-spline coefficients of `height`
  std::vector<float> area;        ///< square metres that drain through the node
  std::vector<float> flatness;    ///< 0 in mountains to 1 in plains, smooth
  std::vector<uint8_t> receiver;  ///< neighbour that the node drains to, or kNoReceiver
  std::vector<float> courseCol;   ///< nodes from the node to the river through it
  std::vector<float> courseRow;
  std::vector<float> lakeLevel;  ///< water level at the nodes of a lake and its shore; kNoLake elsewhere
  std::vector<uint8_t> inLake;   ///< the node is under a lake's water
  int centreCol = 0;             ///< node at the middle of every window: a varied place
  int centreRow = 0;
};

inline constexpr float kNoLake = -1.0e9f;

inline int wrapCell(int i) {
  return i & (kWorldCells - 1);
}
inline size_t nodeIndex(int col, int row) {
  return static_cast<size_t>(wrapCell(row)) * kWorldCells + static_cast<size_t>(wrapCell(col));
}

/// The node that a node with a receiver drains to.
inline size_t downstream(const World& world, size_t node) {
  const int direction = world.receiver[node];
  return nodeIndex(static_cast<int>(node % kWorldCells) + kNeighbourCol[direction],
                   static_cast<int>(node / kWorldCells) + kNeighbourRow[direction]);
}

/// Grows the world of a seed: about 3 s of one core, the same bits on every machine.
World growWorld(uint64_t seed);

/// As growWorld, but gives the last seed's world again while someone still holds it. From any thread.
std::shared_ptr<const World> shareWorld(uint64_t seed);

}  // namespace terrane::synth
