#include "block_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace terrane {

BlockStore::BlockStore(size_t blockBytes, Scratch scratch, std::string name)
    : blockBytes_(blockBytes), scratch_(std::move(scratch)), name_(std::move(name)) {}

BlockStore::~BlockStore() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<int> BlockStore::openFile() const {
  const int open = descriptor_.load(std::memory_order_acquire);
  if (open >= 0) return open;
  const std::lock_guard lock(opening_);
  if (descriptor_ >= 0) return descriptor_.load();
  std::string path = scratch_.folder + "/" + name_ + (scratch_.stays ? ".blocks" : "-XXXXXX");
  const int descriptor = scratch_.stays ? ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)
                                        : mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0)
    return makeError("{}: cannot make a temporary file: {}", scratch_.folder, std::strerror(errno));
  if (!scratch_.stays) unlink(path.c_str());
  descriptor_.store(descriptor, std::memory_order_release);
  return descriptor;
}

Status BlockStore::write(uint64_t block, std::span<const std::byte> bytes) {
  TERRANE_CHECK(bytes.size() <= blockBytes_, "{} bytes into a block of {}", bytes.size(), blockBytes_);
  TERRANE_ASSIGN(const int descriptor, openFile());
  size_t done = 0;
  while (done < bytes.size()) {
    const auto at = static_cast<off_t>(block * blockBytes_ + done);
    const ssize_t count = pwrite(descriptor, bytes.data() + done, bytes.size() - done, at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return makeError("{}: cannot write temporary data: {}; make room there", scratch_.folder,
                       std::strerror(count < 0 ? errno : ENOSPC));
    }
    done += static_cast<size_t>(count);
  }
  return {};
}

Status BlockStore::read(uint64_t block, std::span<std::byte> bytes, size_t offset) const {
  TERRANE_CHECK(offset + bytes.size() <= blockBytes_, "{} bytes at {} of a block of {}", bytes.size(), offset,
                blockBytes_);
  TERRANE_ASSIGN(const int descriptor, openFile());
  size_t done = 0;
  while (done < bytes.size()) {
    const auto at = static_cast<off_t>(block * blockBytes_ + offset + done);
    const ssize_t count = pread(descriptor, bytes.data() + done, bytes.size() - done, at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return makeError("{}: cannot read temporary data back: {}", scratch_.folder,
                       count < 0 ? std::strerror(errno) : "it ends early");
    }
    done += static_cast<size_t>(count);
  }
  return {};
}

}  // namespace terrane
