#pragma once

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>

#include "terrane/codec/mesh_level.h"
#include "terrane/codec/tile.h"
#include "terrane/lod/octagon.h"
#include "terrane/lod/screen_metric.h"
#include "terrane/lod/select_patches.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// What stays the same during one selection: its arguments, which must outlive it, and what follows from
/// them. All parts of a selection read it. To make one, list the arguments in braces.
struct SelectionContext {
  const PatchSelection& selection;
  const Frame& frame;
  const ElevationScale& scale;
  const Camera& camera;
  const ResidentTiles& resident;

  bool isMeshes = selection.surface == SurfaceKind::Meshes;
  MeshScale meshScale = MeshScale::of(frame, scale);
  PatchGrid grid = isMeshes ? meshScale.grid : selection.grid;
  int finestLevel = frame.finestLevel;  ///< tile level of the data
  /// The finest tile level that may be drawn, whose samples are the lattice's unit.
  int drawnLevel =
      finestLevel + (selection.metric == SplitMetric::DistanceOnly ? selection.levelsBelowData : 0);

  Lattice lattice{drawnLevel};
  /// The deepest bintree level that may be drawn.
  int deepestLevel = isMeshes ? meshScale.deepestLevel() : grid.deepestLevel(drawnLevel);
  NestedOctagons octagons{lattice, deepestLevel};
  glm::dvec2 cellMeters{frame.spacingXMeters() / std::ldexp(1.0, drawnLevel - finestLevel),
                        frame.spacingYMeters() / std::ldexp(1.0, drawnLevel - finestLevel)};

  ScreenMetric metric{camera, cellMeters, selection.tolerancePixels, selection.nearMeters};
  double pixelsPerTangent = camera.pixelsPerTangent();
  double pictureDiagonal = std::hypot(camera.width, camera.height);
  double pictureArea = static_cast<double>(camera.width) * camera.height;
  /// As far as all ground is for SplitMetric::ErrorOnly.
  double worldDistance = std::max(1.0, lattice.side() * cellMeters.x);

  bool morphs = selection.morph && selection.metric == SplitMetric::Full;

  int lastLayer() const { return scale.layerCount - 1; }
  bool isWhole(const Tile& tile) const { return tile.samples.layerCount == scale.layerCount; }
  /// Of samples, metres; the larger of x and y.
  double tileSpacing(int tileLevel) const {
    return std::max(cellMeters.x, cellMeters.y) * std::ldexp(1.0, lattice.depth() - tileLevel);
  }
};

}  // namespace terrane
