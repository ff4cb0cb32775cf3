#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "terrane/stream/transport.h"

namespace terrane {

/// Reads what a request asks for from a directory. Files have plain names and lie in it.
std::variant<std::vector<uint8_t>, FetchFailure> readFileRange(const std::string& directory,
                                                               const FetchRequest& request);

}  // namespace terrane
