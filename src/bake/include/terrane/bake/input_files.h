#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// What the disk says of a file that a build would read.
struct InputFile {
  std::string path;      ///< absolute; of what is no file on this disk the name as it was given
  uint64_t bytes = 0;    ///< 0 for what is no file
  int64_t modified = 0;  ///< when it was last written, nanoseconds of the file system's clock; likewise
};

/// The files behind inputs as SourceOptions::inputs and ImageryLayerOptions::inputs name them (also "A+B+C"),
/// in their order, and behind each one those beside it that have its name with another ending (.prj, .tfw,
/// .hdr), by name: where nothing of this has changed, the inputs are what they were. Opens no raster. Errors:
/// nothing there.
Result<std::vector<InputFile>> inputFiles(const std::vector<std::string>& inputs);

}  // namespace terrane
