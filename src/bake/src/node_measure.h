#pragma once

#include "jobs.h"
#include "node_stores.h"
#include "pyramid.h"
#include "terrane/base/progress.h"

namespace terrane {

/// Height of ground, lowest and highest; low > high: there is none.
struct GroundRange {
  float low = 0.0F;
  float high = 0.0F;
};

/// Measures what every stored node's patches get wrong, and the heights under them, into stores.measured.
/// Gives the range of all ground.
///
/// A patch's surface is linear over its triangles, so at the finest samples it is what repeated means of
/// hypotenuse ends make of the patch's own samples. Of these surfaces there is one for the whole world at
/// each bintree level; a tile with nothing stored below one of its quadrants compares its samples with all of
/// them. Exact up to the rounding of floats, which is added, so that the result bounds the truth from above.
/// Cost: for each such tile about one pass over its samples for each bintree level above it.
Result<GroundRange> measureNodes(Pyramid& pyramid, NodeStores& stores, Jobs& jobs, Progress& progress);

/// Turns measures into codes, from the finest level up: strictly saturated errors (a code is at least one
/// above those of the node's children, over tile borders too) and nested ranges; and the same for larger
/// patches (K = 33, 65, 129), each saturated over its own levels, errors only. `maxErrorMeters` is what the
/// heights themselves may be off by. Errors: a code beyond 255, which a fitting errorUnit excludes.
Status saturateNodes(Pyramid& pyramid, NodeStores& stores, const ElevationScale& scale, double maxErrorMeters,
                     Jobs& jobs);

/// How rough the ground is (ElevationScale::roughness): over the smallest nodes of the tiles that finer ones
/// refine, the median of what samples leave, in their spacings; its mean over levels. After saturateNodes();
/// the usual one where there is but one level. `finestSpacingMeters`: the larger of x and y.
double roughnessOf(const Pyramid& pyramid, const ElevationScale& scale, double finestSpacingMeters);

/// The share of the root's samples with ground that stand at 0 (Manifest::zeroShare). `bound`: how far a
/// height may be off. Error: the samples cannot be read.
Result<double> zeroShareOf(const Pyramid& pyramid, double bound);

/// For checks: what was measured, gathered and coded, into pyramid.nodes.
Status takeNodes(Pyramid& pyramid, const NodeStores& stores);

/// The codes of the node at a point of level's lattice, in whichever stored tile holds it, from
/// pyramid.nodes; the point must be the centre of a node of `nodeLevel`.
struct NodeCodes {
  int error = -1;  ///< -1: no stored tile holds it
  uint16_t low = 65535;
  uint16_t high = 0;
};
NodeCodes nodeCodesAt(const Pyramid& pyramid, int level, int nodeLevel, LatticePoint center);

/// What a tile tells about the child tile of a quadrant that is not stored.
ChildSummary summariseMissingChild(const TileSamples& samples, const TileNodes& nodes, bool isRoot,
                                   int quadrant);

}  // namespace terrane
