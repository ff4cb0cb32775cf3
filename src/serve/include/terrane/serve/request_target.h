#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrane/base/result.h"

namespace terrane::serve {

/// The target of a request, taken apart: "/d/alps/elevation?points=1,2" is the path {d, alps, elevation} and
/// one parameter. Segments and values are decoded once.
struct RequestTarget {
  std::vector<std::string> path;
  bool trailingSlash = false;  ///< "/d/alps/"; "/" has an empty path
  std::vector<std::pair<std::string, std::string>> query;

  /// The value of a parameter, or null; the first where it stands more than once (which readTarget refuses).
  const std::string* find(std::string_view name) const;
};

/// Takes a target apart. Errors, in words: no path at all, a bad percent escape, a control character, an
/// encoded slash or "." and ".." segments (nothing here has such a name), an empty segment, a parameter
/// twice, more than 16 of either. An absolute "http://host/path" is taken as its path.
Result<RequestTarget> readTarget(std::string_view target);

}  // namespace terrane::serve
