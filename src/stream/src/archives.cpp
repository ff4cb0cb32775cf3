#include "archives.h"

#include <algorithm>

namespace terrane {

Status Archives::setManifest(const std::vector<uint8_t>& bytes, const std::string& where) {
  TERRANE_ASSIGN(Manifest manifest,
                 manifestFromJson(std::string(bytes.begin(), bytes.end()), where + "/manifest.json"));
  std::vector<std::string> names;
  names.reserve(static_cast<size_t>(manifest.scale.layerCount) + manifest.imagery.size());
  for (int i = 0; i < manifest.scale.layerCount; ++i) names.push_back(elevationArchiveName(i));
  for (const ImageryLayerRecord& layer : manifest.imagery) names.push_back(layer.archive);
  std::vector<File> files;
  for (const std::string& name : names) {
    const auto record = std::find_if(manifest.archives.begin(), manifest.archives.end(),
                                     [&](const ArchiveRecord& archive) { return archive.name == name; });
    if (record == manifest.archives.end())
      return makeError("{}/manifest.json: lists no {}; build the dataset again", where, name);
    files.push_back({name, record->bytes, std::nullopt});
  }
  manifest_ = std::move(manifest);
  files_ = std::move(files);
  return {};
}

std::vector<TileKey> Archives::roots() const {
  std::vector<TileKey> out;
  out.reserve(static_cast<size_t>(count()));
  for (int file = 0; file < count(); ++file)
    if (!isRefinement(file)) out.push_back(keyOf(file, TileId{}));
  return out;
}

FetchRequest Archives::request(int file, uint64_t offset, uint64_t bytes) const {
  const File& archive = files_[static_cast<size_t>(file)];
  return {archive.name, offset, bytes, false, archive.bytes};
}

FetchRequest Archives::firstBytes(int file, uint64_t bytes) const {
  const uint64_t most = std::max(bytes, PmtilesIndex::kFirstBytes);
  return request(file, 0, std::min(files_[static_cast<size_t>(file)].bytes, most));
}

Status Archives::setFirstBytes(int file, const std::vector<uint8_t>& bytes) {
  File& archive = files_[static_cast<size_t>(file)];
  TERRANE_ASSIGN(archive.index, PmtilesIndex::open(bytes, archive.bytes));
  return {};
}

PmtilesIndex::Found Archives::find(const TileKey& key) const {
  if (key.isElevation() && key.significance() >= elevationFiles()) return {PmtilesIndex::Kind::NotStored, {}};
  const int file = fileOf(key);
  if (isRefinement(file) && !isOpen(file)) {
    const FetchRequest first = firstBytes(file, 0);
    return {PmtilesIndex::Kind::InDirectory,
            {first.offset, static_cast<decltype(PmtilesIndex::Place::bytes)>(first.bytes)}};
  }
  return files_[static_cast<size_t>(file)].index->find(key.tile);
}

Status Archives::addDirectory(int file, PmtilesIndex::Place place, const std::vector<uint8_t>& bytes) {
  if (!isOpen(file)) return setFirstBytes(file, bytes);
  return files_[static_cast<size_t>(file)].index->addDirectory(place, bytes);
}

}  // namespace terrane
