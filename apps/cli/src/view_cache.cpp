#include "view_cache.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <system_error>

namespace terrane::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUsed = "used";
constexpr size_t kKeyDigits = 16;

bool isPlace(const fs::path& folder) {
  const std::string name = folder.filename().string();
  std::error_code trouble;
  return name.size() == kKeyDigits &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isxdigit(c) != 0; }) &&
         fs::symlink_status(folder, trouble).type() == fs::file_type::directory &&
         fs::is_regular_file(folder / kUsed, trouble);
}

}  // namespace

Result<std::string> viewCacheFolder() {
  // note: the specification takes a path that is not absolute for none.
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && cache[0] == '/') return std::string(cache) + "/terrane";
  const char* home = std::getenv("HOME");
  if (home != nullptr && home[0] == '/') return std::string(home) + "/.cache/terrane";
  return makeError("there is no folder for what is built; set HOME or XDG_CACHE_HOME, or call terrane build");
}

Result<CachePlace> CachePlace::use(const std::string& cacheFolder, const std::string& key) {
  const std::string folder = cacheFolder + "/" + key.substr(0, kKeyDigits);
  std::error_code trouble;
  fs::create_directories(folder, trouble);
  const std::string file = folder + "/" + kUsed;
  const int used = trouble ? -1 : ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (used < 0) {
    return makeError(
        "{}: cannot be written ({}); set XDG_CACHE_HOME to a folder that can, or call terrane build", folder,
        trouble ? trouble.message() : std::strerror(errno));
  }
  ::flock(used, LOCK_SH);
  ::futimens(used, nullptr);
  return CachePlace(folder, used);
}

CachePlace::~CachePlace() {
  if (used_ >= 0) ::close(used_);
}

std::vector<std::string> forgetUnused(const std::string& cacheFolder, double days) {
  std::vector<std::string> gone;
  std::error_code trouble;
  for (const fs::directory_entry& entry : fs::directory_iterator(cacheFolder, trouble)) {
    if (!isPlace(entry.path())) continue;
    const int used = ::open((entry.path() / kUsed).c_str(), O_RDONLY | O_CLOEXEC);
    if (used < 0) continue;
    struct stat told {};
    const bool isOld =
        ::fstat(used, &told) == 0 && std::difftime(std::time(nullptr), told.st_mtime) > days * 86400.0;
    if (isOld && ::flock(used, LOCK_EX | LOCK_NB) == 0) {
      std::error_code kept;
      fs::remove_all(entry.path(), kept);
      if (!kept) gone.push_back(entry.path().string());
    }
    ::close(used);
  }
  return gone;
}

}  // namespace terrane::cli
