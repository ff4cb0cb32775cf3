#include "terrane/dataset/dataset.h"

#include <algorithm>
#include <atomic>
#include <filesystem>

#include "file.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

constexpr const char* kManifest = "manifest.json";

std::string pathIn(const std::string& directory, const std::string& name) {
  return (std::filesystem::path(directory) / name).string();
}

}  // namespace

struct Dataset::State {
  State(std::shared_ptr<ByteSource> from, Manifest read)
      : source(std::move(from)), manifest(std::move(read)) {}
  std::shared_ptr<ByteSource> source;
  Manifest manifest;
  std::vector<PmtilesReader> elevation;  ///< a layer of significance
  std::vector<PmtilesReader> imagery;    ///< a layer
  mutable std::atomic<uint64_t> bytesRead{0};

  template <class Payload>
  Result<Payload> counted(Result<Payload> payload) const {
    if (payload.ok() && payload->has_value()) bytesRead += (*payload)->size();
    return payload;
  }
  template <class Payload>
  Result<std::vector<Payload>> counted(Result<std::vector<Payload>> payloads) const {
    for (size_t i = 0; payloads.ok() && i < payloads->size(); ++i)
      if ((*payloads)[i]) bytesRead += (*payloads)[i]->size();
    return payloads;
  }
  const PmtilesReader& layer(size_t index) const {
    TERRANE_CHECK(index < imagery.size(), "layer {} of {}", index, imagery.size());
    return imagery[index];
  }
  const PmtilesReader& elevationLayer(int index) const {
    TERRANE_CHECK(index >= 0 && static_cast<size_t>(index) < elevation.size(), "layer {} of {}", index,
                  elevation.size());
    return elevation[static_cast<size_t>(index)];
  }
};

Result<Dataset> Dataset::open(const std::string& directory) {
  std::error_code ignored;
  // note: who puts paths into order makes one slash of two.
  if (directory.rfind("http:/", 0) == 0 || directory.rfind("https:/", 0) == 0) {
    return makeError(
        "{}: is an address, and this reads datasets on disk; terrane render, bench and info take both",
        directory);
  }
  if (!std::filesystem::exists(directory, ignored)) {
    return makeError("{}: does not exist; make a dataset with terrane build", directory);
  }
  if (!std::filesystem::is_directory(directory, ignored)) {
    return makeError("{}: is not a dataset directory; make one with terrane build", directory);
  }
  std::error_code trouble;
  if (!std::filesystem::exists(pathIn(directory, kManifest), trouble)) {
    if (trouble) return makeError("{}: cannot be looked into ({})", directory, trouble.message());
    return makeError("{}: has no manifest.json, so it is not a whole dataset; build it again", directory);
  }
  return open(openDirectoryBytes(directory));
}

Result<Dataset> Dataset::open(std::shared_ptr<ByteSource> source) {
  const std::string manifestPath = source->where(kManifest);
  TERRANE_ASSIGN(const std::string text, source->readWhole(kManifest));
  TERRANE_ASSIGN(Manifest manifest, manifestFromJson(text, manifestPath));

  for (const ArchiveRecord& record : manifest.archives) TERRANE_TRY(source->open(record.name, record.bytes));
  const auto openArchive = [&](const std::string& name, uint64_t tiles) -> Result<PmtilesReader> {
    const auto record = std::find_if(manifest.archives.begin(), manifest.archives.end(),
                                     [&](const ArchiveRecord& archive) { return archive.name == name; });
    if (record == manifest.archives.end())
      return makeError("{}: lists no {}; build the dataset again", manifestPath, name);
    TERRANE_ASSIGN(PmtilesReader reader, PmtilesReader::open(source, name, record->bytes));
    if (reader.tileCount() != tiles)
      return makeError("{}: has {} tiles, the manifest says {}: build the dataset again", source->where(name),
                       reader.tileCount(), tiles);
    return reader;
  };
  std::vector<PmtilesReader> elevation;
  for (int layer = 0; layer < manifest.scale.layerCount; ++layer) {
    TERRANE_ASSIGN(PmtilesReader reader, openArchive(elevationArchiveName(layer), manifest.tileCount));
    elevation.push_back(std::move(reader));
  }
  std::vector<PmtilesReader> imagery;
  for (const ImageryLayerRecord& layer : manifest.imagery) {
    TERRANE_ASSIGN(PmtilesReader reader, openArchive(layer.archive, layer.tileCount));
    imagery.push_back(std::move(reader));
  }
  auto state = std::make_unique<State>(std::move(source), std::move(manifest));
  state->elevation = std::move(elevation);
  state->imagery = std::move(imagery);
  return Dataset(std::move(state));
}

Dataset::Dataset(std::unique_ptr<State> state) : state_(std::move(state)) {}
Dataset::~Dataset() = default;
Dataset::Dataset(Dataset&&) noexcept = default;
Dataset& Dataset::operator=(Dataset&&) noexcept = default;

const Manifest& Dataset::manifest() const {
  return state_->manifest;
}
const std::string& Dataset::directory() const {
  return state_->source->where();
}

Result<std::optional<std::vector<uint8_t>>> Dataset::readElevation(int layer, TileId id) const {
  return state_->counted(state_->elevationLayer(layer).read(id));
}
Result<std::vector<std::optional<std::vector<uint8_t>>>> Dataset::readElevation(
    int layer, std::span<const TileId> ids) const {
  return state_->counted(state_->elevationLayer(layer).read(ids));
}
Result<std::optional<TilePayloads>> Dataset::readAllLayers(TileId id) const {
  TERRANE_ASSIGN(std::vector<std::optional<TilePayloads>> read, readAllLayers(std::span(&id, 1)));
  return std::move(read[0]);
}
Result<std::vector<std::optional<TilePayloads>>> Dataset::readAllLayers(std::span<const TileId> ids) const {
  std::vector<std::optional<TilePayloads>> out(ids.size());
  for (int layer = 0; layer < state_->manifest.scale.layerCount; ++layer) {
    TERRANE_ASSIGN(auto payloads, readElevation(layer, ids));
    for (size_t i = 0; i < ids.size(); ++i) {
      if (layer == 0 && payloads[i]) out[i].emplace();
      if (payloads[i].has_value() != out[i].has_value()) {
        return makeError("{}: tile {} is {} the layer before; build the dataset again",
                         state_->source->where(elevationArchiveName(layer)), toString(ids[i]),
                         payloads[i] ? "here and not in" : "not here, but in");
      }
      if (payloads[i]) out[i]->push_back(std::move(*payloads[i]));
    }
  }
  return out;
}
Result<std::optional<std::vector<uint8_t>>> Dataset::readImagery(size_t layer, TileId id) const {
  return state_->counted(state_->layer(layer).read(id));
}
Result<std::vector<std::optional<std::vector<uint8_t>>>> Dataset::readImagery(
    size_t layer, std::span<const TileId> ids) const {
  return state_->counted(state_->layer(layer).read(ids));
}
std::vector<TileId> Dataset::imageryTiles(size_t layer) const {
  return state_->layer(layer).tiles();
}

std::vector<TileId> Dataset::elevationTiles() const {
  return state_->elevation[0].tiles();
}
uint64_t Dataset::bytesRead() const {
  return state_->bytesRead;
}

Status checkArchives(const Dataset& dataset, Progress& progress) {
  const std::vector<ArchiveRecord>& records = dataset.manifest().archives;
  progress.beginStage("hashes", static_cast<int64_t>(records.size()), "files");
  for (const ArchiveRecord& record : records) {
    const std::string path = pathIn(dataset.directory(), record.name);
    TERRANE_ASSIGN(const std::string sha256, sha256OfFile(path));
    if (sha256 != record.sha256) {
      return makeError(
          "{}: was changed after it was written (SHA-256 {}, the manifest says {}): copy the dataset "
          "again, or build it again",
          path, sha256, record.sha256);
    }
    progress.advance(1);
  }
  return {};
}

}  // namespace terrane
