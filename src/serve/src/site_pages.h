#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "served_dataset.h"

namespace terrane::serve {

/// A name as a segment of a URL.
std::string escapeSegment(std::string_view text);

/// "/datasets.json": name, hash, URLs, extent of every dataset.
std::string datasetsJson(const std::vector<std::unique_ptr<ServedDataset>>& datasets);
/// "/": the same for people, without scripts.
std::string indexPage(const std::vector<std::unique_ptr<ServedDataset>>& datasets);

}  // namespace terrane::serve
