#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "temporary_directory.h"
#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {

/// A dataset's elevation tiles, decoded straight from the files.
inline std::map<TileId, Tile> decodedTiles(const Dataset& dataset) {
  std::map<TileId, Tile> out;
  std::vector<TileId> ids = dataset.elevationTiles();
  std::sort(ids.begin(), ids.end());
  for (const TileId id : ids) {
    const auto payload = dataset.readElevation(id);
    TERRANE_CHECK(payload.ok() && payload->has_value(), "tile {}", toString(id));
    auto tile = decodeTile(**payload, id.isRoot() ? nullptr : &out.at(id.parent()).samples,
                           id.isRoot() ? 0 : id.quadrant(), dataset.manifest().scale);
    TERRANE_CHECK(tile.ok(), "tile {}: {}", toString(id), tile.error().message);
    out.emplace(id, std::move(*tile));
  }
  return out;
}

/// Puts the samples of all tiles into layers of significance, as good as by chance, each by its place alone.
inline void putIntoLayers(std::map<TileId, Tile>& tiles, int finestLevel, int layerCount) {
  for (auto& [id, tile] : tiles) {
    TileSamples& samples = tile.samples;
    samples.layerCount = layerCount;
    samples.layers.resize(kTileSampleCount);
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        const uint64_t col = static_cast<uint64_t>(id.col * kTileCells + x) << (finestLevel - id.level);
        const uint64_t row = static_cast<uint64_t>(id.row * kTileCells + y) << (finestLevel - id.level);
        const uint64_t mixed = (col << 32 | row) * 0x9e3779b97f4a7c15ULL >> 40;
        samples.layers[static_cast<size_t>(y * kTileSamples + x)] =
            col % 16 == 0 && row % 16 == 0 ? uint8_t{0}
                                           : static_cast<uint8_t>(mixed % static_cast<uint64_t>(layerCount));
      }
    }
  }
}

/// Writes a dataset without imagery anew, its elevation being `tiles` in layers of significance.
inline Status writeLayeredDataset(const Dataset& dataset, const std::map<TileId, Tile>& tiles, int layerCount,
                                  const std::string& directory) {
  std::filesystem::create_directories(directory);
  Manifest manifest = dataset.manifest();
  manifest.archives.clear();
  manifest.scale.layerCount = layerCount;
  for (int layer = 0; layer < layerCount; ++layer)
    manifest.scale.layerErrors[static_cast<size_t>(layer)] =
        layer + 1 == layerCount ? manifest.scale.sampleError : 16.0 / (1 << (2 * layer));
  for (int layer = 0; layer < layerCount; ++layer) {
    const std::string name = elevationArchiveName(layer), path = directory + "/" + name;
    TERRANE_ASSIGN(PmtilesWriter writer, PmtilesWriter::create(path));
    for (const TileId id : dataset.elevationTiles()) {
      const TileSamples* parent = id.isRoot() ? nullptr : &tiles.at(id.parent()).samples;
      const int quadrant = id.isRoot() ? 0 : id.quadrant();
      const std::vector<uint8_t> payload =
          layer == 0 ? encodeTile(tiles.at(id), parent, quadrant, manifest.scale)
                     : encodeRefinement(tiles.at(id).samples, parent, quadrant, layer, manifest.scale);
      TERRANE_TRY(writer.add(id, payload));
    }
    TERRANE_TRY(writer.finish("{}"));
    TERRANE_ASSIGN(const std::string hash, sha256OfFile(path));
    manifest.archives.push_back({name, std::filesystem::file_size(path), hash});
  }
  writeWholeFile(directory + "/manifest.json", manifestToJson(manifest));
  return {};
}

}  // namespace terrane
