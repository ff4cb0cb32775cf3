#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>

#include "terrane/base/result.h"

namespace terrane {

/// Where blocks lie: in a folder, in files that stay (a build goes on from them) or in files without a name,
/// which vanish with the program, however that ends.
struct Scratch {
  std::string folder;
  bool stays = false;
};

/// Many blocks of one size, numbered from 0, in some files; those never written take no room. The system's
/// cache keeps in memory what fits, and that does not count as ours. Different blocks may be read and written
/// from different threads.
class BlockStore {
 public:
  /// Files are made, or opened if they stayed there, when a block is first asked for. `name`: what theirs
  /// begin with.
  BlockStore(size_t blockBytes, Scratch scratch, std::string name);
  ~BlockStore();
  BlockStore(const BlockStore&) = delete;
  BlockStore& operator=(const BlockStore&) = delete;

  /// Errors: the disk is full, or the folder cannot be written.
  Status write(uint64_t block, std::span<const std::byte> bytes);
  /// A block's bytes from `offset` on. The block must have been written before.
  Status read(uint64_t block, std::span<std::byte> bytes, size_t offset = 0) const;

  /// As above, for arrays of plain values.
  template <class T>
  Status writeValues(uint64_t block, std::span<const T> values) {
    return write(block, std::as_bytes(values));
  }
  template <class T>
  Status readValues(uint64_t block, std::span<T> values) const {
    return read(block, std::as_writable_bytes(values));
  }
  /// As above, for one plain value.
  template <class T>
  Status writeValue(uint64_t block, const T& value) {
    return write(block, std::as_bytes(std::span(&value, 1)));
  }
  template <class T>
  Status readValue(uint64_t block, T& value) const {
    return read(block, std::as_writable_bytes(std::span(&value, 1)));
  }

 private:
  /// Neighbouring blocks lie in different files. note: a system writes to a file for one thread at a time.
  static constexpr uint64_t kFiles = 8;

  /// The file that holds a block, and where in it.
  struct Place {
    int descriptor = -1;
    uint64_t offset = 0;
  };
  Result<Place> placeOf(uint64_t block) const;
  Result<int> openFile(size_t file) const;

  size_t blockBytes_;
  Scratch scratch_;
  std::string name_;
  mutable std::mutex opening_;
  mutable std::array<std::atomic<int>, kFiles> descriptors_;
};

}  // namespace terrane
