#pragma once

#include "pyramid.h"
#include "terrane/base/progress.h"
#include "workers.h"

namespace terrane {

/// Measures what every stored node's patches get wrong, and the heights under them, into pyramid.nodes.
///
/// A patch's surface is linear over its triangles, so at the finest samples it is what repeated means of
/// hypotenuse ends make of the patch's own samples. Of these surfaces there is one for the whole world at
/// each bintree level; a tile with nothing stored below one of its quadrants compares its samples with all of
/// them. Exact up to the rounding of floats, which is added, so that the result bounds the truth from above.
/// Cost: for each such tile about one pass over its samples for each bintree level above it.
Status measureNodes(Pyramid& pyramid, const Workers& workers, Progress& progress);

/// Turns measures into codes, from the finest level up: strictly saturated errors (a code is at least one
/// above those of the node's children, over tile borders too) and nested ranges. `maxErrorMeters` is what the
/// heights themselves may be off by. Errors: a code beyond 255, which a fitting errorUnit excludes.
Status saturateNodes(Pyramid& pyramid, const ElevationScale& scale, double maxErrorMeters,
                     const Workers& workers);

/// The same for larger patches (K = 33, 65, 129), each saturated over its own levels; errors only, since
/// ranges do not depend on K. A larger patch is the same surface as the patches for K = 17 that it is made
/// of, so its error is the largest of theirs.
Status saturateLargeNodes(Pyramid& pyramid, const ElevationScale& scale, double maxErrorMeters,
                          const Workers& workers);

/// The codes of the node at a point of level's lattice, in whichever stored tile holds it; the point must be
/// the centre of a node of `nodeLevel`.
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
