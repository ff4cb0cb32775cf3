#pragma once

#include <fmt/format.h>

#include <string>

namespace terrane {

/// Prints `condition`, the place and `message`, then aborts: a broken contract inside the program.
[[noreturn]] void failCheck(const char* condition, const char* file, int line, const std::string& message);

}  // namespace terrane

/// A contract of the program itself, never of its input. Stays on in every build; the message prints the
/// operands: `TERRANE_CHECK(level <= kMaxLevel, "level {}", level);`
#define TERRANE_CHECK(condition, ...)                                                      \
  do {                                                                                     \
    if (!(condition)) [[unlikely]]                                                         \
      ::terrane::failCheck(#condition, __FILE__, __LINE__, ::fmt::format("" __VA_ARGS__)); \
  } while (false)
