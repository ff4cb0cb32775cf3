#pragma once

#include <string>

#include "temporary_directory.h"

namespace terrane {

/// The directory of a small dataset, hills on levels 0 to 3: made in `folder`, or, in WebAssembly, where
/// nothing is built, by the native make_stream_dataset beforehand.
std::string madeDataset(const TemporaryDirectory& folder);

}  // namespace terrane
