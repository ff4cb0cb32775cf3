#pragma once

#include <span>
#include <string>
#include <string_view>

#include "terrane/base/result.h"

namespace terrane {

/// SHA-256, hexadecimal, of bytes in memory and of a file (read once, in pieces).
std::string sha256(std::string_view bytes);
Result<std::string> sha256OfFile(const std::string& path);

}  // namespace terrane
