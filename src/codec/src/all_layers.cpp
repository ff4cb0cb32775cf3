#include "terrane/codec/all_layers.h"

#include <utility>

#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

Result<Tile> decodeAllLayers(std::span<const std::vector<uint8_t>> payloads, const TileSamples* parent,
                             int quadrant, const ElevationScale& scale, Tile recycled) {
  TERRANE_CHECK(static_cast<int>(payloads.size()) == scale.layerCount, "{} payloads of {} layers",
                payloads.size(), scale.layerCount);
  TERRANE_ASSIGN(Tile tile, decodeTile(payloads[0], parent, quadrant, scale, std::move(recycled)));
  for (size_t layer = 1; layer < payloads.size(); ++layer) {
    auto refined = refineTile(payloads[layer], tile.samples, parent, quadrant, scale);
    if (!refined.ok()) return makeError("layer {}: {}", layer, refined.error().message);
    tile.samples = std::move(refined).value();
  }
  return tile;
}

}  // namespace terrane
