#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "terrane/base/result.h"

namespace terrane {

/// An open file. Reads name their place and may come from any thread; writes go to a place or to the end.
/// Errors name the file and what the system said.
class File {
 public:
  static Result<File> openForReading(const std::string& path);
  /// Creates a file that must not exist.
  static Result<File> create(const std::string& path);
  /// Opens a file for reading and writing, which is made where there is none.
  static Result<File> openOrCreate(const std::string& path);
  ~File();
  File(File&& other) noexcept;
  File& operator=(File&& other) noexcept;

  const std::string& path() const { return path_; }
  Result<uint64_t> size() const;
  /// Fills `bytes` from `offset`; a file that ends before is an error.
  Status read(uint64_t offset, std::span<uint8_t> bytes) const;
  Status write(uint64_t offset, std::span<const uint8_t> bytes);
  /// Cuts the file off after `bytes`, or fills it up with zeros.
  Status resize(uint64_t bytes);
  /// Everything written is on the disk, and the file is closed.
  Status syncAndClose();

 private:
  File(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}

  int descriptor_ = -1;
  std::string path_;
};

/// A small file's bytes.
Result<std::string> readTextFile(const std::string& path);

}  // namespace terrane
