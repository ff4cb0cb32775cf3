#include "build_output.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace terrane {

namespace fs = std::filesystem;

namespace {

/// The path without slashes at its end, which would name what is inside.
std::string trimmed(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

void removeQuietly(const std::string& path) {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

/// A rename is on disk when the folder that holds the name is.
void syncFolder(const std::string& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

std::string folderOf(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace

Status checkTarget(const std::string& rawTarget, bool overwrite) {
  const std::string target = trimmed(rawTarget);
  if (target.empty()) return makeError("no output was named; pass -o NAME.terrane");
  std::error_code code;
  const std::string folder = folderOf(target);
  if (!fs::is_directory(folder, code))
    return makeError("{}: the folder {} does not exist; make it first", target, folder);
  const fs::file_status status = fs::symlink_status(target, code);
  if (!fs::exists(status)) return {};
  if (!overwrite)
    return makeError("{}: exists already; pass --overwrite to replace it, or choose another name", target);
  if (!fs::is_directory(status) || !fs::exists(target + "/manifest.json", code)) {
    return makeError("{}: is no dataset (no manifest.json in it), so it is not replaced; choose another name",
                     target);
  }
  return {};
}

Result<PendingDirectory> PendingDirectory::create(const std::string& rawTarget, bool overwrite) {
  TERRANE_TRY(checkTarget(rawTarget, overwrite));
  const std::string target = trimmed(rawTarget);
  const std::string path = target + ".partial-" + std::to_string(getpid());
  std::error_code code;
  if (!fs::create_directory(path, code)) {
    const std::string reason = code ? code.message() : "it exists already";
    return makeError("{}: cannot be made: {}; choose a folder that can be written", path, reason);
  }
  return PendingDirectory(target, path);
}

PendingDirectory::PendingDirectory(std::string target, std::string path)
    : target_(std::move(target)), path_(std::move(path)) {}

PendingDirectory::PendingDirectory(PendingDirectory&& other) noexcept
    : target_(std::move(other.target_)), path_(std::exchange(other.path_, {})) {}

PendingDirectory::~PendingDirectory() {
  if (!path_.empty()) removeQuietly(path_);
}

Status PendingDirectory::writeFile(const std::string& name, const std::string& text) const {
  const std::string path = file(name);
  const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  size_t done = 0;
  bool fine = descriptor >= 0;
  while (fine && done < text.size()) {
    const ssize_t count = write(descriptor, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    fine = count > 0;
    if (fine) done += static_cast<size_t>(count);
  }
  fine = fine && fsync(descriptor) == 0;
  const int reason = errno;
  if (descriptor >= 0) close(descriptor);
  if (!fine)
    return makeError("{}: cannot be written: {}; make room, or choose another folder", path,
                     std::strerror(reason));
  return {};
}

Status PendingDirectory::commit() {
  syncFolder(path_);
  const auto failed = [&] {
    return makeError("{}: cannot be put in place: {}", target_, std::strerror(errno));
  };
  std::error_code code;
  const bool replaces = fs::exists(fs::symlink_status(target_, code));
  if (!replaces) {
    if (rename(path_.c_str(), target_.c_str()) != 0) return failed();
    path_.clear();
  } else if (renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    // Where the file system cannot swap two names: step by step, back again if the second step fails.
    const std::string old = target_ + ".old-" + std::to_string(getpid());
    if (rename(target_.c_str(), old.c_str()) != 0) return failed();
    if (rename(path_.c_str(), target_.c_str()) != 0) {
      const Status status = failed();
      static_cast<void>(rename(old.c_str(), target_.c_str()));
      return status;
    }
    path_ = old;
  }
  syncFolder(folderOf(target_));
  // After a swap our name holds what stood there before.
  if (!path_.empty()) removeQuietly(path_);
  path_.clear();
  return {};
}

}  // namespace terrane
