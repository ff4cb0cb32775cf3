#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/dataset/manifest.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

class Dataset;

/// What the user said of the inputs. Strings are empty, options absent, where nothing was said.
struct SourceOptions {
  std::vector<std::string> inputs;       ///< files, folders, globs, or @list files; later ones lie on top
  std::string crs;                       ///< --crs: the dataset's, anything PROJ understands
  std::string sourceCrs;                 ///< --source-crs: of inputs without one or with a wrong one
  std::optional<double> noData;          ///< --nodata: overrides what the files say
  bool lossless = false;                 ///< --lossless
  std::optional<double> maxErrorMeters;  ///< --max-error
  std::optional<double> spacing;         ///< --spacing: of the finest samples, units of the dataset's CRS
  std::string resampling = "cubic";      ///< --resampling: of resamplingNames(), where inputs are warped
};

/// The ways to make a sample from an input's, as GDAL names them: the nearest one, or by a kernel, which is
/// as wide as the new samples are apart where those are farther apart than the input's.
std::span<const char* const> resamplingNames();

/// Everything decided before the first sample is read: the dataset's lattice, what becomes of each input,
/// and the height step.
struct SourcePlan {
  std::string crsWkt;
  std::string crsName;
  Frame frame;
  int64_t extentCols = 0;  ///< samples of the finest level, from the origin
  int64_t extentRows = 0;
  double heightStep = 1.0;
  double heightOffset = 0.0;
  double maxErrorMeters = 0.0;  ///< 0: lossless
  bool interpolates = false;    ///< samples are left to interpolation where that keeps within the error
  std::string verticalDatum;
  std::vector<InputRecord> inputs;
};

/// Reads samples of one source for one thread.
class SourceReader {
 public:
  virtual ~SourceReader() = default;
  /// The samples that inputs *native to id.level* have in a tile: `heights` in metres (NaN: none), row by
  /// row from the north-west, and `ranks`, 1 + the position in SourcePlan::inputs of the one on top (0:
  /// none). Returns whether there is any sample.
  virtual Result<bool> readTile(TileId id, std::span<float> heights, std::span<uint16_t> ranks) = 0;
};

/// The dataset that a build adds to. It stays as it is until the new one takes its place.
struct AppendBase {
  std::shared_ptr<const Dataset> dataset;
  std::string manifestSha256;  ///< of its manifest.json
};

/// The inputs of a build, laid on one lattice (mosaic, warp, units, nodata done).
class Source {
 public:
  virtual ~Source() = default;
  virtual const SourcePlan& plan() const = 0;
  /// Levels that some input is native to, ascending; the last is plan().frame.finestLevel.
  virtual std::vector<int> nativeLevels() const = 0;
  /// May an input native to id.level have samples in the tile? Cheap, from rectangles; may say yes too often.
  virtual bool mayTouch(TileId id) const = 0;
  /// A reader for one thread; readers work side by side.
  virtual Result<std::unique_ptr<SourceReader>> openReader() const = 0;
  /// The dataset under the rasters, null where there are only rasters. Its inputs come first in the plan.
  virtual const AppendBase* base() const { return nullptr; }
};

/// Opens, checks and plans the inputs. Errors name the file and the remedy.
Result<std::unique_ptr<Source>> openSource(const SourceOptions& options, Progress& progress);

/// Opens the dataset `directory` and lays the inputs over it: a source like that of the rasters which it was
/// built from, followed by these; it reads the dataset once, to check it. options.crs, lossless and
/// maxErrorMeters must not be given. Errors: the dataset's, the inputs', and where the result could not be
/// the same as that of a full build: a dataset with an error bound, of inputs of several levels, or with
/// imagery; an input that does not fall on its samples, is no integers on its height step, or leaves its
/// world.
Result<std::unique_ptr<Source>> openAppendedSource(const SourceOptions& options, const std::string& directory,
                                                   Progress& progress);

}  // namespace terrane
