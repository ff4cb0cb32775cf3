#include "block_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace terrane {

BlockStore::BlockStore(size_t blockBytes, Scratch scratch, std::string name)
    : blockBytes_(blockBytes), scratch_(std::move(scratch)), name_(std::move(name)) {
  for (std::atomic<int>& descriptor : descriptors_) descriptor.store(-1);
}

BlockStore::~BlockStore() {
  for (const std::atomic<int>& descriptor : descriptors_) {
    if (descriptor >= 0) close(descriptor);
  }
}

Result<BlockStore::Place> BlockStore::placeOf(uint64_t block) const {
  Place place;
  TERRANE_ASSIGN(place.descriptor, openFile(block % kFiles));
  place.offset = block / kFiles * blockBytes_;
  return place;
}

Result<int> BlockStore::openFile(size_t file) const {
  const int open = descriptors_[file].load(std::memory_order_acquire);
  if (open >= 0) return open;
  const std::lock_guard lock(opening_);
  if (descriptors_[file] >= 0) return descriptors_[file].load();
  std::string path =
      fmt::format("{}/{}-{}{}", scratch_.folder, name_, file, scratch_.stays ? ".blocks" : "-XXXXXX");
  const int descriptor = scratch_.stays ? ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)
                                        : mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0)
    return makeError("{}: cannot make a temporary file: {}", scratch_.folder, std::strerror(errno));
  if (!scratch_.stays) unlink(path.c_str());
  descriptors_[file].store(descriptor, std::memory_order_release);
  return descriptor;
}

Status BlockStore::write(uint64_t block, std::span<const std::byte> bytes) {
  TERRANE_CHECK(bytes.size() <= blockBytes_, "{} bytes into a block of {}", bytes.size(), blockBytes_);
  TERRANE_ASSIGN(const Place place, placeOf(block));
  size_t done = 0;
  while (done < bytes.size()) {
    const auto at = static_cast<off_t>(place.offset + done);
    const ssize_t count = pwrite(place.descriptor, bytes.data() + done, bytes.size() - done, at);
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
  TERRANE_ASSIGN(const Place place, placeOf(block));
  size_t done = 0;
  while (done < bytes.size()) {
    const auto at = static_cast<off_t>(place.offset + offset + done);
    const ssize_t count = pread(place.descriptor, bytes.data() + done, bytes.size() - done, at);
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
