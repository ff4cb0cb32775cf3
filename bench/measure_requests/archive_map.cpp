#include "archive_map.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "terrane/dataset/pmtiles_index.h"

namespace terrane {
namespace {

std::vector<uint8_t> bytesOfFile(std::ifstream& file, uint64_t offset, uint64_t bytes) {
  std::vector<uint8_t> out(bytes);
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(bytes));
  return out;
}

}  // namespace

Result<ArchiveMap> ArchiveMap::of(const Dataset& dataset) {
  ArchiveMap out;
  out.manifestBytes_ = std::filesystem::file_size(dataset.directory() + "/manifest.json");
  for (int i = 0; i < dataset.manifest().scale.layerCount; ++i)
    TERRANE_TRY(
        out.add(dataset, elevationArchiveName(i), TileKey::elevation({}, i).layer, dataset.elevationTiles()));
  const auto& layers = dataset.manifest().imagery;
  for (size_t i = 0; i < layers.size(); ++i)
    TERRANE_TRY(out.add(dataset, layers[i].archive, static_cast<int32_t>(i), dataset.imageryTiles(i)));
  return out;
}

Status ArchiveMap::add(const Dataset& dataset, const std::string& name, int32_t layer,
                       const std::vector<TileId>& ids) {
  const std::string path = dataset.directory() + "/" + name;
  const uint64_t size = std::filesystem::file_size(path);
  std::ifstream file(path, std::ios::binary);
  TERRANE_ASSIGN(PmtilesIndex index,
                 PmtilesIndex::open(bytesOfFile(file, 0, std::min(size, PmtilesIndex::kFirstBytes)), size));
  for (const TileId id : ids) {
    PmtilesIndex::Found found = index.find(id);
    if (found.kind == PmtilesIndex::Kind::InDirectory) {
      TERRANE_TRY(index.addDirectory(found.place, bytesOfFile(file, found.place.offset, found.place.bytes)));
      found = index.find(id);
    }
    if (found.kind != PmtilesIndex::Kind::Stored) return makeError("{}: no tile {}", path, toString(id));
    const TileKey key{layer, id};
    byEnd_[name][found.place.offset + found.place.bytes] = {key, found.place.bytes};
    bytes_[key] = found.place.bytes;
  }
  return {};
}

std::vector<std::pair<TileKey, uint64_t>> ArchiveMap::tilesIn(const FetchRequest& request) const {
  std::vector<std::pair<TileKey, uint64_t>> out;
  const auto file = byEnd_.find(request.file);
  if (file == byEnd_.end()) return out;
  const uint64_t end = request.offset + request.bytes;
  for (auto at = file->second.upper_bound(request.offset); at != file->second.end() && at->first <= end;
       ++at) {
    const uint64_t begin = at->first - at->second.bytes;
    if (begin >= request.offset) out.emplace_back(at->second.key, at->second.bytes);
  }
  return out;
}

uint64_t ArchiveMap::bytesOf(const TileKey& key) const {
  const auto at = bytes_.find(key);
  return at == bytes_.end() ? 0 : at->second;
}

}  // namespace terrane
