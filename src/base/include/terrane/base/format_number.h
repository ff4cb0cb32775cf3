#pragma once

#include <cstdint>
#include <string>

namespace terrane {

/// "1.5 GB", "312 kB", "17 bytes": decimal units, three figures.
std::string formatBytes(uint64_t bytes);

/// "850 ms", "12 s", "3 min 20 s", "2 h 5 min".
std::string formatDuration(double seconds);

/// "12,345,678".
std::string formatCount(int64_t count);

}  // namespace terrane
