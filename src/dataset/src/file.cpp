#include "file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace terrane {
namespace {

const char* remedyFor(int error) {
  switch (error) {
    case ENOENT:
      return "; check the path";
    case EACCES:
    case EPERM:
    case EROFS:
      return "; check its permissions, or choose another place";
    case EEXIST:
      return "; remove it, or choose another name";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "; free some space, or choose another disk";
    default:
      return "";
  }
}

Error systemError(const std::string& path, const char* what, int error) {
  return makeError("{}: {}: {}{}", path, what, std::strerror(error), remedyFor(error));
}

}  // namespace

Result<File> File::openForReading(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return systemError(path, "cannot open", errno);
  return File(descriptor, path);
}

Result<File> File::create(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return systemError(path, "cannot create", errno);
  return File(descriptor, path);
}

Result<File> File::openOrCreate(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return systemError(path, "cannot create", errno);
  return File(descriptor, path);
}

File::~File() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

File::File(File&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)) {}

File& File::operator=(File&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  return *this;
}

Result<uint64_t> File::size() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) return systemError(path_, "cannot tell the size", errno);
  if (!S_ISREG(status.st_mode)) return makeError("{}: is not a file", path_);
  return static_cast<uint64_t>(status.st_size);
}

Status File::read(uint64_t offset, std::span<uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return systemError(path_, "cannot read", errno);
    if (count == 0)
      return makeError("{}: ends at byte {}, {} more were expected", path_, offset, bytes.size());
    offset += static_cast<uint64_t>(count);
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
  return {};
}

Status File::write(uint64_t offset, std::span<const uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return systemError(path_, "cannot write", errno);
    offset += static_cast<uint64_t>(count);
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
  return {};
}

Status File::resize(uint64_t bytes) {
  if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0)
    return systemError(path_, "cannot write", errno);
  return {};
}

Status File::syncAndClose() {
  if (::fsync(descriptor_) != 0) return systemError(path_, "cannot write", errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) return systemError(path_, "cannot write", errno);
  return {};
}

Result<std::string> readTextFile(const std::string& path) {
  TERRANE_ASSIGN(const File file, File::openForReading(path));
  TERRANE_ASSIGN(const uint64_t size, file.size());
  std::string text(static_cast<size_t>(size), '\0');
  TERRANE_TRY(file.read(0, {reinterpret_cast<uint8_t*>(text.data()), text.size()}));
  return text;
}

}  // namespace terrane
