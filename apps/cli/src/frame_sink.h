#pragma once

#include <memory>
#include <string>

#include "terrane/base/result.h"
#include "terrane/engine/terrain.h"

namespace terrane::cli {

/// Writes one picture as a PNG file.
Status writePicture(const std::string& path, const Picture& picture);

/// Where the frames of a flight go.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual Status add(const Picture& picture) = 0;
  /// Completes the output; without it nothing usable is promised.
  virtual Status finish() = 0;
};

/// `output` ends with .mp4: a video, through the ffmpeg program. It holds one printf integer such as %05d:
/// numbered PNG files from 0. Errors: anything else, existing files without `overwrite`, ffmpeg missing.
Result<std::unique_ptr<FrameSink>> openFrameSink(const std::string& output, int width, int height,
                                                 double framesPerSecond, bool overwrite);

}  // namespace terrane::cli
