#pragma once

#include <string>

#include "terrane/base/result.h"

namespace terrane {

/// A directory in the making: filled beside the place where it shall stand, renamed into it by commit(),
/// removed with all its contents if that never happens.
class PendingDirectory {
 public:
  /// Errors: the target exists (and is no dataset, or may not be overwritten); its folder cannot be written.
  static Result<PendingDirectory> create(const std::string& target, bool overwrite);
  ~PendingDirectory();
  PendingDirectory(PendingDirectory&& other) noexcept;
  PendingDirectory& operator=(PendingDirectory&&) = delete;

  const std::string& path() const { return path_; }
  std::string file(const std::string& name) const { return path_ + "/" + name; }
  /// Makes a file of these bytes, on disk when this returns.
  Status writeFile(const std::string& name, const std::string& text) const;
  /// Puts the directory in its place; what stood there is removed after.
  Status commit();

 private:
  PendingDirectory(std::string target, std::string path);
  std::string target_;
  std::string path_;  ///< empty: nothing to remove any more
};

/// May `target` be made, or replaced?
Status checkTarget(const std::string& target, bool overwrite);

}  // namespace terrane
