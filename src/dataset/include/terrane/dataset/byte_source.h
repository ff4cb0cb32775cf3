#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// Some bytes of one of a dataset's files.
struct FileRange {
  std::string file;  ///< "elevation.pmtiles"
  uint64_t offset = 0;
  uint64_t bytes = 0;
};

/// Where a dataset's files are: a directory, or a server that is asked for ranges. Calls return when the
/// bytes are there; const calls may come from any thread. Errors name the file and say what to do.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// The directory or address, for messages.
  virtual const std::string& where() const = 0;
  /// Of one of its files.
  virtual std::string where(const std::string& file) const = 0;

  /// All of a small file.
  virtual Result<std::string> readWhole(const std::string& file) = 0;
  /// Ranges of this file will be read. It has so many bytes, or is another one: an error, now or when it is
  /// first read.
  virtual Status open(const std::string& file, uint64_t bytes) = 0;
  /// The bytes of each range of open files, in their order. Ranges that lie near each other are cheap.
  virtual Result<std::vector<std::vector<uint8_t>>> read(std::span<const FileRange> ranges) const = 0;
};

/// The files of a directory; those that are open stay what they were when something else is put in their
/// place.
std::unique_ptr<ByteSource> openDirectoryBytes(const std::string& directory);

}  // namespace terrane
