#include "block_store.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>

namespace terrane {

struct BlockStore::File {
  std::mutex mutex;
  int descriptor = -1;
};

BlockStore::BlockStore(size_t blockBytes, uint64_t memoryBytes, std::string folder)
    : blockBytes_(blockBytes),
      blocksInMemory_(memoryBytes / blockBytes),
      folder_(std::move(folder)),
      file_(new File) {
  if (blocksInMemory_ == 0) return;
  // Address space only; pages come when they are written.
  void* address = mmap(nullptr, blocksInMemory_ * blockBytes_, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (address == MAP_FAILED)
    blocksInMemory_ = 0;
  else
    memory_ = static_cast<std::byte*>(address);
}

BlockStore::~BlockStore() {
  if (memory_ != nullptr) munmap(memory_, blocksInMemory_ * blockBytes_);
  if (file_->descriptor >= 0) close(file_->descriptor);
  delete file_;
}

Result<int> BlockStore::openFile() {
  const std::lock_guard lock(file_->mutex);
  if (file_->descriptor >= 0) return file_->descriptor;
  std::string path = folder_ + "/scratch-XXXXXX";
  const int descriptor = mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0) return makeError("{}: cannot make a temporary file: {}", folder_, std::strerror(errno));
  unlink(path.c_str());
  file_->descriptor = descriptor;
  return descriptor;
}

Status BlockStore::write(uint64_t block, std::span<const std::byte> bytes) {
  TERRANE_CHECK(bytes.size() <= blockBytes_, "{} bytes into a block of {}", bytes.size(), blockBytes_);
  if (block < blocksInMemory_) {
    std::memcpy(memory_ + block * blockBytes_, bytes.data(), bytes.size());
    return {};
  }
  TERRANE_ASSIGN(const int descriptor, openFile());
  size_t done = 0;
  while (done < bytes.size()) {
    const auto at = static_cast<off_t>((block - blocksInMemory_) * blockBytes_ + done);
    const ssize_t count = pwrite(descriptor, bytes.data() + done, bytes.size() - done, at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return makeError("{}: cannot write temporary data: {}; make room there, or allow more with --memory",
                       folder_, std::strerror(count < 0 ? errno : ENOSPC));
    }
    done += static_cast<size_t>(count);
  }
  return {};
}

Status BlockStore::read(uint64_t block, std::span<std::byte> bytes, size_t offset) const {
  TERRANE_CHECK(offset + bytes.size() <= blockBytes_, "{} bytes at {} of a block of {}", bytes.size(), offset,
                blockBytes_);
  if (block < blocksInMemory_) {
    std::memcpy(bytes.data(), memory_ + block * blockBytes_ + offset, bytes.size());
    return {};
  }
  size_t done = 0;
  while (done < bytes.size()) {
    const auto at = static_cast<off_t>((block - blocksInMemory_) * blockBytes_ + offset + done);
    const ssize_t count = pread(file_->descriptor, bytes.data() + done, bytes.size() - done, at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return makeError("{}: cannot read temporary data back: {}", folder_,
                       count < 0 ? std::strerror(errno) : "it ends early");
    }
    done += static_cast<size_t>(count);
  }
  return {};
}

}  // namespace terrane
