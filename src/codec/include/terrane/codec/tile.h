#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "terrane/tiling/node_layout.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Where a sample's height comes from.
enum class SampleState : uint8_t {
  Void = 0,          ///< no ground here; the height only fills the gap and is never shown
  Interpolated = 1,  ///< ground, with the mean of its hypotenuse's ends as its height
  Coded = 2,         ///< ground, with a height of its own on the dataset's step
};

/// Which of a tile's cells are ground. A cell of the finest data level is ground when its four corners are;
/// a cell of a coarser tile when at least half of the finest cells under it are.
struct Coverage {
  enum class Kind : uint8_t { None = 0, Full = 1, Partial = 2 };
  Kind kind = Kind::None;
  /// Only for Partial: one bit a cell, row by row from the north-west, least significant bit first.
  std::vector<uint8_t> bits;

  bool covered(int col, int row) const {
    if (kind != Kind::Partial) return kind == Kind::Full;
    const int cell = row * kTileCells + col;
    return (bits[static_cast<size_t>(cell >> 3)] >> (cell & 7) & 1) != 0;
  }
  static constexpr size_t kBytes = kTileCellCount / 8;
};

/// A tile's samples, row by row from the north-west corner: index = y * kTileSamples + x.
struct TileSamples {
  std::vector<float> heights;       ///< kTileSampleCount, metres, finite
  std::vector<SampleState> states;  ///< kTileSampleCount
  Coverage coverage;
  /// How many of the dataset's layers of significance are here (ElevationScale::layerCount), from the first.
  int layerCount = 1;
  /// In which layer each sample is, meaningful where it is Coded; empty where only the first is here, or all
  /// are of it. A sample that a layer codes has its height for good; where a layer does not, it is the mean
  /// of its hypotenuse's ends, as these are there (samplesOfLayer()).
  std::vector<uint8_t> layers;

  /// The layer of a Coded sample.
  int layerAt(size_t index) const { return layers.empty() ? 0 : int{layers[index]}; }
};

/// The error and height range of each of a tile's nodes (tiling/node_layout.h), as codes.
///
/// `error`: a bound of |surface - source| over the node's two triangles and everything below them, strictly
/// saturated: a node's code is at least one above each child's, over tile borders too. `low` and `high`: no
/// sample of the source on or under the node's diamond *and its descendants' diamonds* lies outside; nested
/// likewise. low > high (65535, 0): nothing but void.
///
/// `largeError`: the error codes of patches with K = 33, 65, 129 (largeNodeIndex()), each K strictly
/// saturated by itself.
struct TileNodes {
  std::vector<uint8_t> error;
  std::vector<uint8_t> largeError;
  std::vector<uint16_t> low;
  std::vector<uint16_t> high;
};

/// What a tile knows of one of its four quadrants' child tiles.
enum class ChildState : uint8_t {
  Void = 0,          ///< no ground there: nothing stored, interpolate() stands for it
  Interpolated = 1,  ///< nothing significant below: nothing stored, interpolate() is exact
  Present = 2,       ///< stored
};
struct ChildSummary {
  ChildState state = ChildState::Void;
  uint8_t error = 0;     ///< largest error code of the child's own nodes; 0 unless present
  uint16_t low = 65535;  ///< height range code over the child's nodes
  uint16_t high = 0;
};

/// One decoded tile of the elevation pyramid.
struct Tile {
  TileSamples samples;
  TileNodes nodes;
  std::array<ChildSummary, 4> children;
};

/// The numbers, one set for a whole dataset, by which codes become metres.
struct ElevationScale {
  double heightStep = 1.0;    ///< metres; a coded height is heightOffset + q * heightStep, rounded to float
  double heightOffset = 0.0;  ///< metres
  double errorUnit = 1.0;     ///< metres; error code 0 is 0 m, code c > 0 is errorUnit * 2^((c - 1) / 8)
  double rangeBase = 0.0;     ///< metres; range code c is rangeBase + c * rangeUnit
  double rangeUnit = 1.0;     ///< metres
  double sampleError = 0.0;   ///< metres; how far samples may be off the source, part of every node's codes
  /// Layers of significance: samples come in so many, those that are far off what coarser ones make of them
  /// first. 1: all at once.
  int layerCount = 1;
  static constexpr int kMostLayers = 4;
  /// metres; by how much the surface that the layers up to this one make may be off the source, falling; of
  /// the last one sampleError counts.
  std::array<double, kMostLayers> layerErrors{};
  /// How much finer ground leaves the plane between samples, typically, in their spacings. Says nothing of
  /// codes: meshes are made for it. This one, an alpine one, where a dataset does not tell.
  double roughness = 0.4;

  /// metres; how far, at most, samples are from where all layers have them while those up to `layer` are
  /// here.
  double layerOffset(int layer) const {
    return layer + 1 < layerCount ? layerErrors[static_cast<size_t>(layer)] + sampleError : 0.0;
  }
  /// The height of q; the same float on every machine.
  float heightFromInteger(int64_t q) const {
    return static_cast<float>(heightOffset + static_cast<double>(q) * heightStep);
  }
  /// The nearest q (halves away from zero).
  int64_t integerFromHeight(double heightMeters) const;
  double errorFromCode(uint8_t code) const;
  /// The smallest code that claims at least `errorMeters`; 255 where that is not enough.
  uint8_t codeFromError(double errorMeters) const;
  double heightFromRangeCode(uint16_t code) const { return rangeBase + code * rangeUnit; }
  /// The largest code at or below, and the smallest at or above a height; clamped to [0, 65535].
  uint16_t lowCode(double heightMeters) const;
  uint16_t highCode(double heightMeters) const;
};

}  // namespace terrane
