#pragma once

#include <optional>
#include <string>
#include <vector>

#include "served_dataset.h"
#include "terrane/serve/http_message.h"

namespace terrane::serve {

/// Answers GET or HEAD below `/d/NAME/xyz/` (or `/d/NAME/HASH/xyz/`: `isVersioned`): `path` is what stands
/// behind it. TileJSON at once; a tile in some milliseconds of one core.
HttpResponse answerXyz(const HttpRequest& request, const ServedDataset& served,
                       const std::vector<std::string>& path, bool isVersioned);

/// The same below `/d/NAME/quantized-mesh/`.
HttpResponse answerTerrain(const HttpRequest& request, const ServedDataset& served,
                           const std::vector<std::string>& path, bool isVersioned);

}  // namespace terrane::serve
