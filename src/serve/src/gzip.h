#pragma once

#include <string>
#include <string_view>

namespace terrane::serve {

/// `bytes` as a gzip file; the same bytes give the same file.
std::string gzip(std::string_view bytes);

}  // namespace terrane::serve
