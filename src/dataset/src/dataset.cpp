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
constexpr const char* kElevationArchive = "elevation.pmtiles";

std::string pathIn(const std::string& directory, const std::string& name) {
  return (std::filesystem::path(directory) / name).string();
}

}  // namespace

struct Dataset::State {
  State(std::shared_ptr<ByteSource> from, Manifest read, PmtilesReader opened)
      : source(std::move(from)), manifest(std::move(read)), elevation(std::move(opened)) {}
  std::shared_ptr<ByteSource> source;
  Manifest manifest;
  PmtilesReader elevation;
  std::vector<PmtilesReader> imagery;  ///< a layer
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
  if (!std::filesystem::exists(pathIn(directory, kManifest), ignored)) {
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
  TERRANE_ASSIGN(PmtilesReader elevation, openArchive(kElevationArchive, manifest.tileCount));
  std::vector<PmtilesReader> imagery;
  for (const ImageryLayerRecord& layer : manifest.imagery) {
    TERRANE_ASSIGN(PmtilesReader reader, openArchive(layer.archive, layer.tileCount));
    imagery.push_back(std::move(reader));
  }
  auto state = std::make_unique<State>(std::move(source), std::move(manifest), std::move(elevation));
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

Result<std::optional<std::vector<uint8_t>>> Dataset::readElevation(TileId id) const {
  return state_->counted(state_->elevation.read(id));
}
Result<std::vector<std::optional<std::vector<uint8_t>>>> Dataset::readElevation(
    std::span<const TileId> ids) const {
  return state_->counted(state_->elevation.read(ids));
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
  return state_->elevation.tiles();
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
