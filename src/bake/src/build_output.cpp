#include "build_output.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "terrane/base/format_number.h"
#include "terrane/dataset/hash.h"

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

std::string workPathOf(const std::string& target) {
  return target + ".partial";
}

/// A small file's text; empty where it cannot be read.
std::string textOf(const std::string& path) {
  std::string text;
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return text;
  std::array<char, 65536> part;
  for (;;) {
    const ssize_t count = read(descriptor, part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    text.append(part.data(), static_cast<size_t>(count));
  }
  close(descriptor);
  return text;
}

/// Writes a file aside, then renames it: there is the old text or the new one, at any moment.
Status writeText(const std::string& path, const std::string& text) {
  const std::string aside = path + ".new";
  const int descriptor = open(aside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  size_t done = 0;
  bool fine = descriptor >= 0;
  while (fine && done < text.size()) {
    const ssize_t count = write(descriptor, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    fine = count > 0;
    if (fine) done += static_cast<size_t>(count);
  }
  fine = fine && fsync(descriptor) == 0;
  int reason = errno;
  if (descriptor >= 0) close(descriptor);
  if (fine && rename(aside.c_str(), path.c_str()) != 0) {
    fine = false;
    reason = errno;
  }
  if (!fine)
    return makeError("{}: cannot be written: {}; make room, or choose another folder", path,
                     std::strerror(reason));
  return {};
}

/// The plan file's first line: since when the machine runs. Work is handed to the system, which keeps it when
/// the program dies, but not forced to the disk.
std::string bootLine() {
  std::string id = textOf("/proc/sys/kernel/random/boot_id");
  if (id.empty()) id = "unknown\n";
  return "boot " + id;
}

/// What the plan file says beyond the plan once the dataset is about to be put in place.
std::string commitLine(const std::string& manifest) {
  return "committed " + sha256(manifest) + "\n";
}

/// Does the work folder say that the dataset at `target` came out of it?
bool saysCommitted(const std::string& target) {
  const std::string manifest = textOf(target + "/manifest.json");
  return !manifest.empty() && textOf(workPathOf(target) + "/plan").ends_with(commitLine(manifest));
}

/// Could this user put another dataset in the place of the one at `target`? note: asked before the work, not
/// after it.
bool mayReplace(const std::string& target) {
  const std::string folder = folderOf(target);
  if (access(target.c_str(), R_OK | W_OK | X_OK) != 0 || access(folder.c_str(), W_OK | X_OK) != 0)
    return false;
  struct stat ofFolder = {};
  struct stat ofTarget = {};
  if (stat(folder.c_str(), &ofFolder) != 0 || stat(target.c_str(), &ofTarget) != 0) return false;
  // In a folder like /tmp everybody may write, but rename only what is theirs.
  const uid_t me = geteuid();
  return (ofFolder.st_mode & S_ISVTX) == 0 || me == 0 || me == ofFolder.st_uid || me == ofTarget.st_uid;
}

/// `justMade`: a target that says it came out of the work folder is no obstacle.
Status checkTarget(const std::string& target, bool overwrite, bool justMade) {
  if (target.empty()) return makeError("no output was named; pass -o NAME.terrane");
  std::error_code code;
  const std::string folder = folderOf(target);
  if (!fs::is_directory(folder, code))
    return makeError("{}: the folder {} does not exist; make it first", target, folder);
  const fs::file_status status = fs::symlink_status(target, code);
  if (!fs::exists(status) || (justMade && saysCommitted(target))) return {};
  if (!overwrite)
    return makeError("{}: exists already; pass --overwrite to replace it, or choose another name", target);
  if (fs::is_symlink(status))
    return makeError("{}: is a symbolic link, which is not replaced; name what it points to ({})", target,
                     fs::read_symlink(target, code).string());
  if (!fs::is_directory(status) || !fs::exists(target + "/manifest.json", code)) {
    return makeError("{}: is no dataset (no manifest.json in it), so it is not replaced; choose another name",
                     target);
  }
  // What a dataset does not consist of is somebody's own.
  for (fs::directory_iterator at(target, code), end; !code && at != end; at.increment(code)) {
    const fs::path& path = at->path();
    const bool isOurs =
        at->is_regular_file(code) && (path.filename() == "manifest.json" || path.extension() == ".pmtiles");
    if (!isOurs)
      return makeError(
          "{}: does not belong to the dataset around it, which would be replaced as a whole; move it "
          "elsewhere",
          path.string());
  }
  if (!mayReplace(target))
    return makeError("{}: may not be replaced by this user; ask its owner, or choose another name", target);
  return {};
}

}  // namespace

std::string datasetNameOf(const std::string& target) {
  return fs::path(trimmed(target)).stem().string();
}

Status checkTarget(const std::string& target, bool overwrite) {
  return checkTarget(trimmed(target), overwrite, true);
}

std::string committedPlan(const std::string& rawTarget) {
  const std::string target = trimmed(rawTarget);
  if (!saysCommitted(target)) return {};
  const std::string text = textOf(workPathOf(target) + "/plan");
  const size_t plan = text.find('\n') + 1;
  const size_t end = commitLine(textOf(target + "/manifest.json")).size();
  return plan + end <= text.size() ? text.substr(plan, text.size() - end - plan) : std::string();
}

Status checkRoom(const WorkFolder& work, uint64_t bytes) {
  std::error_code code;
  const fs::space_info space = fs::space(work.path(), code);
  if (code) return {};  // whoever cannot tell has no say

  // What earlier runs have written needs no room any more. Scratch files have holes: blocks tell, not sizes.
  uint64_t there = 0;
  for (const auto& entry : fs::recursive_directory_iterator(work.path(), code)) {
    struct stat status {};
    if (lstat(entry.path().c_str(), &status) == 0 && S_ISREG(status.st_mode))
      there += static_cast<uint64_t>(status.st_blocks) * 512;
  }
  const uint64_t needed = bytes > there ? bytes - there : 0;
  if (space.available >= needed) return {};
  return makeError(
      "{}: the build needs about {} ({} bytes) there, for the result and while it works, and {} ({} bytes) "
      "are "
      "free; make room, or choose an output on another disk",
      folderOf(work.path()), formatBytes(needed), needed, formatBytes(space.available), space.available);
}

Result<WorkFolder> WorkFolder::open(const std::string& rawTarget, bool overwrite, const std::string& plan,
                                    Progress& progress) {
  const std::string target = trimmed(rawTarget);
  TERRANE_TRY(checkTarget(target, overwrite, true));
  const std::string path = workPathOf(target);
  const auto failed = [&] {
    return makeError("{}: cannot be made: {}; choose a folder that can be written", path,
                     std::strerror(errno));
  };

  // Ours alone. note: between opening and locking, another build may have finished and removed the folder.
  int lock = -1;
  bool made = false;
  for (;;) {
    made = mkdir(path.c_str(), 0777) == 0;
    if (!made && errno != EEXIST) return failed();
    lock = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock < 0 && errno == ENOENT) continue;
    if (lock < 0) return failed();
    // note: some network file systems know no locks; there the user has to see to it.
    if (flock(lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      close(lock);
      return makeError("{}: another build of the same output works there; wait for it, or stop it", path);
    }
    struct stat ours {};
    struct stat there {};
    if (fstat(lock, &ours) == 0 && stat(path.c_str(), &there) == 0 && ours.st_ino == there.st_ino) break;
    close(lock);
  }
  WorkFolder folder(target, path, lock);
  folder.disposable_ = made;

  const std::string before = textOf(path + "/plan");
  std::error_code code;
  if (before.empty() && !fs::is_empty(path, code) && !fs::exists(path + "/plan.new", code)) {
    return makeError("{}: is not what an interrupted build leaves; move it away, or choose another output",
                     path);
  }

  // What another plan left is of no use, nor what a machine that went down may have lost a part of.
  folder.plan_ = plan;
  const size_t boot = before.find('\n') + 1;
  const bool samePlan = before.compare(boot, plan.size(), plan) == 0;
  const bool done = samePlan && saysCommitted(target);
  if (!done) TERRANE_TRY(checkTarget(target, overwrite, false));
  const bool goesOn = samePlan && before.starts_with(bootLine());
  if (!goesOn && !done) {
    if (!before.empty()) {
      progress.warn(fmt::format("{}: was left by a build {}; this one starts afresh", path,
                                samePlan ? "before the machine was restarted, which may have lost some of it"
                                         : "from other inputs or with other options"));
    }
    folder.disposable_ = true;
    for (const auto& entry : fs::directory_iterator(path, code)) fs::remove_all(entry.path(), code);
  }
  if (!done) TERRANE_TRY(writeText(path + "/plan", bootLine() + plan));
  if (!fs::is_directory(path + "/dataset", code) && !fs::create_directory(path + "/dataset", code))
    return makeError("{}/dataset: cannot be made: {}", path, code.message());
  TERRANE_ASSIGN(JobLog log, JobLog::open(path + "/jobs"));
  folder.log_ = std::make_unique<JobLog>(std::move(log));
  folder.disposable_ = true;
  return folder;
}

WorkFolder::WorkFolder(std::string target, std::string path, int lock)
    : target_(std::move(target)), path_(std::move(path)), lock_(lock) {}

WorkFolder::WorkFolder(WorkFolder&& other) noexcept
    : target_(std::move(other.target_)),
      path_(std::exchange(other.path_, {})),
      lock_(std::exchange(other.lock_, -1)),
      disposable_(std::exchange(other.disposable_, false)),
      plan_(std::move(other.plan_)),
      log_(std::move(other.log_)) {}

WorkFolder::~WorkFolder() {
  if (disposable_ && !hasWork()) discard();
  if (lock_ >= 0) close(lock_);
}

bool WorkFolder::isCommitted() const {
  const std::string text = textOf(path_ + "/plan");
  return saysCommitted(target_) && text.compare(text.find('\n') + 1, plan_.size(), plan_) == 0;
}

Status WorkFolder::writeFile(const std::string& name, const std::string& text) const {
  return writeText(file(name), text);
}

Status WorkFolder::commit() {
  const std::string made = path_ + "/dataset";
  const std::string manifest = textOf(made + "/manifest.json");
  TERRANE_CHECK(!manifest.empty(), "{} has no manifest", made);
  TERRANE_TRY(writeText(path_ + "/plan", bootLine() + plan_ + commitLine(manifest)));
  syncFolder(made);
  const auto failed = [&] {
    return makeError("{}: cannot be put in place: {}", target_, std::strerror(errno));
  };
  std::error_code code;
  const bool replaces = fs::exists(fs::symlink_status(target_, code));
  if (!replaces) {
    if (rename(made.c_str(), target_.c_str()) != 0) return failed();
  } else if (renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    // Where the file system cannot swap two names: step by step, back again if the second step fails.
    const std::string old = path_ + "/old";
    if (rename(target_.c_str(), old.c_str()) != 0) return failed();
    if (rename(made.c_str(), target_.c_str()) != 0) {
      const Status status = failed();
      static_cast<void>(rename(old.c_str(), target_.c_str()));
      return status;
    }
  }
  syncFolder(folderOf(target_));
  syncFolder(path_);
  discard();
  return {};
}

void WorkFolder::discard() {
  if (path_.empty()) return;
  // The plan goes last: as long as something is left, it says what.
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(path_, ignored)) {
    if (entry.path().filename() != "plan") removeQuietly(entry.path().string());
  }
  removeQuietly(path_);
  path_.clear();
}

}  // namespace terrane
