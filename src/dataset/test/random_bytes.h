#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace terrane {

inline std::vector<uint8_t> randomBytes(size_t size, std::mt19937& random) {
  std::vector<uint8_t> bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  return bytes;
}

}  // namespace terrane
