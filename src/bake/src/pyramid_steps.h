#pragma once

#include "jobs.h"
#include "pyramid.h"
#include "terrane/bake/source.h"
#include "terrane/base/progress.h"

/// The steps of a build that make the pyramid's samples; each stands in a file of its own.
namespace terrane {

inline constexpr auto kSamplesOfTile = static_cast<size_t>(kTileSampleCount);

/// Which input a sample's height comes from, kept while inputs of several native levels are put together:
/// ranks as SourceReader gives them, 0 none.
struct RankStores {
  explicit RankStores(const Scratch& scratch);
  BlockStore raw;     ///< of the sample that lies on top
  BlockStore native;  ///< of the inputs native to the tile's own level, on levels that have such inputs
  BlockStore coarse;  ///< of the inputs native to coarser levels, interpolated
};

/// What the finest tiles need by themselves (significance.h) under the bound of each layer of significance,
/// kept from when they are read until all of them are. What a larger bound needs, the smaller ones do as
/// well.
struct NeedStore {
  /// `bounds`: metres, falling; the last is the dataset's.
  NeedStore(std::vector<double> bounds, const Scratch& scratch);
  int layerCount() const { return static_cast<int>(boundsMeters.size()); }
  std::vector<double> boundsMeters;
  BlockStore bits;  ///< a layer's kSampleBitsBytes behind those of the one before
};

/// What reading the inputs told.
struct RawTotals {
  double meanHeight = 0.0;
  int64_t samples = 0;  ///< with data, of all native levels
};

/// Step 1, from the finest level up: which tiles there are (those with data, and empty ones around them), and
/// their raw heights on the dataset's step (NaN where there is no data). `ranks` may be null where all inputs
/// are native to one level. With `needs`, which only such inputs can have, samples of the finest level that
/// are not significant are interpolated; without, all are coded. Errors: the source's; a height that the step
/// cannot express; no room. Without any data there are 0 samples, and the pyramid is of no use.
Result<RawTotals> readRawTiles(const Source& source, const ElevationScale& scale, Pyramid& pyramid,
                               RankStores* ranks, NeedStore* needs, Jobs& jobs, Progress& progress);

/// The part of step 1 that follows once the finest level is read: its tiles' final heights, states and
/// layers. Each tile takes its neighbours' needs and its own samples; a second time changes nothing, not even
/// where the first one was killed while it wrote.
Status interpolateFinestTiles(Pyramid& pyramid, const NeedStore& needs, Jobs& jobs);
/// A sample between two others that is not their mean: surely not interpolated. Most tiles show one at once.
bool isRough(std::span<const float> heights);

/// Step 2, from the root down: every sample gets its height and state. A sample without data is Interpolated
/// where an input of a coarser level lies there, Void elsewhere; the world's corners without data have
/// the height of the nearest data in the root, or `cornerHeight` where the root has none.
Status fillTiles(const Source& source, Pyramid& pyramid, RankStores* ranks, float cornerHeight, Jobs& jobs,
                 Progress& progress);

/// Step 3, from the finest level up: which cells are ground. Gives their number, in cells of the finest
/// level. `scratch` takes counts that are of no use afterwards.
Result<double> coverTiles(Pyramid& pyramid, const Scratch& scratch, Jobs& jobs);

/// Step 4, from the finest level up: tiles that are, with all below them, what interpolation makes of their
/// parents are no longer `stored`, unless they touch one of their level that is not.
Status pruneTiles(Pyramid& pyramid, Jobs& jobs);

}  // namespace terrane
