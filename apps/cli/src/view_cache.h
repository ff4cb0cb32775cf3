#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"

/// Where `terrane view` keeps what it has built: FOLDER/KEY/NAME.terrane, one for each set of inputs and
/// options. All of it may be deleted at any time.
namespace terrane::cli {

/// "$XDG_CACHE_HOME/terrane", else "~/.cache/terrane". Error: neither is known.
Result<std::string> viewCacheFolder();

/// A place in the cache, in use as long as this lives: nobody forgets it.
class CachePlace {
 public:
  /// Makes the folder of a key (hexadecimal digits) where there is none. Errors: the file system's.
  static Result<CachePlace> use(const std::string& cacheFolder, const std::string& key);
  ~CachePlace();
  CachePlace(CachePlace&& other) noexcept : folder_(std::move(other.folder_)), used_(other.used_) {
    other.used_ = -1;
  }
  CachePlace(const CachePlace&) = delete;
  CachePlace& operator=(const CachePlace&) = delete;

  const std::string& folder() const { return folder_; }

 private:
  CachePlace(std::string folder, int used) : folder_(std::move(folder)), used_(used) {}

  std::string folder_;
  int used_;  ///< an open file, locked and touched: when the place was used last
};

/// Removes what nobody has used for `days`, and nobody uses now. Gives the folders that are gone; what cannot
/// be removed stays. Touches nothing that is not a place of the cache.
std::vector<std::string> forgetUnused(const std::string& cacheFolder, double days);

}  // namespace terrane::cli
