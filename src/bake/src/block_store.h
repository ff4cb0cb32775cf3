#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "terrane/base/result.h"

namespace terrane {

/// Many blocks of one size, numbered from 0: in memory as far as a budget goes, the rest in a temporary file
/// that is nowhere to be seen (it vanishes with the program, however that ends). Different blocks may be
/// read and written from different threads.
class BlockStore {
 public:
  /// `folder` takes the temporary file, which is made when the first block beyond `memoryBytes` is written.
  BlockStore(size_t blockBytes, uint64_t memoryBytes, std::string folder);
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

 private:
  Result<int> openFile();

  size_t blockBytes_;
  uint64_t blocksInMemory_;
  std::byte* memory_ = nullptr;
  std::string folder_;
  struct File;
  File* file_;
};

}  // namespace terrane
