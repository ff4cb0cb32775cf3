#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "entity.h"
#include "terrane/base/result.h"

namespace terrane::serve {

/// The viewer's files, in memory: a fixed table, so that no request's path becomes one of a file.
class ViewerFiles {
 public:
  ViewerFiles() = default;
  /// Reads a folder as `./dev build web` leaves it, index.html at its top. Errors: there is none; more than
  /// 500 files or 64 MB, which no viewer has.
  static Result<ViewerFiles> read(const std::string& folder);

  bool isEmpty() const { return files_.empty(); }
  /// Answers GET or HEAD for one of them, by its path below the folder ("assets/index-1a2b.js"; "" is the
  /// page); nothing where there is none of that name.
  std::optional<HttpResponse> answer(const HttpRequest& request, std::string_view path) const;

 private:
  std::map<std::string, TextEntity, std::less<>> files_;
};

}  // namespace terrane::serve
