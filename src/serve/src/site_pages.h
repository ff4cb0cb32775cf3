#pragma once

#include <memory>
#include <string>
#include <vector>

#include "served_dataset.h"

namespace terrane::serve {

/// "/datasets.json": name, hash, URLs, extent of every dataset.
std::string datasetsJson(const std::vector<std::unique_ptr<ServedDataset>>& datasets);
/// "/": the same for people, without scripts.
std::string indexPage(const std::vector<std::unique_ptr<ServedDataset>>& datasets);

}  // namespace terrane::serve
