#include "terrane/dataset/dataset.h"

#include <algorithm>
#include <atomic>
#include <filesystem>

#include "file.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

constexpr const char* kElevationArchive = "elevation.pmtiles";

std::string pathIn(const std::string& directory, const std::string& name) {
  return (std::filesystem::path(directory) / name).string();
}

/// The file is there and has the size that the manifest says: what a broken copy most often fails.
Status checkSize(const std::string& path, const ArchiveRecord& record) {
  TERRANE_ASSIGN(const File file, File::openForReading(path));
  TERRANE_ASSIGN(const uint64_t bytes, file.size());
  if (bytes == record.bytes) return {};
  return makeError("{}: has {} bytes, the manifest says {}: copy the dataset again, or build it again", path,
                   bytes, record.bytes);
}

}  // namespace

struct Dataset::State {
  State(std::string path, Manifest read, PmtilesReader opened)
      : directory(std::move(path)), manifest(std::move(read)), elevation(std::move(opened)) {}
  std::string directory;
  Manifest manifest;
  PmtilesReader elevation;
  std::vector<PmtilesReader> imagery;  ///< a layer
  mutable std::atomic<uint64_t> bytesRead{0};
};

Result<Dataset> Dataset::open(const std::string& directory) {
  std::error_code ignored;
  const std::string manifestPath = pathIn(directory, "manifest.json");
  if (!std::filesystem::exists(directory, ignored)) {
    return makeError("{}: does not exist; make a dataset with terrane build", directory);
  }
  if (!std::filesystem::is_directory(directory, ignored)) {
    return makeError("{}: is not a dataset directory; make one with terrane build", directory);
  }
  if (!std::filesystem::exists(manifestPath, ignored)) {
    return makeError("{}: has no manifest.json, so it is not a whole dataset; build it again", directory);
  }
  TERRANE_ASSIGN(const std::string text, readTextFile(manifestPath));
  TERRANE_ASSIGN(Manifest manifest, manifestFromJson(text, manifestPath));

  for (const ArchiveRecord& record : manifest.archives) {
    TERRANE_TRY(checkSize(pathIn(directory, record.name), record));
  }
  const auto checkListed = [&](const std::string& name) -> Status {
    for (const ArchiveRecord& record : manifest.archives)
      if (record.name == name) return {};
    return makeError("{}: lists no {}; build the dataset again", manifestPath, name);
  };
  TERRANE_TRY(checkListed(kElevationArchive));
  const std::string elevationPath = pathIn(directory, kElevationArchive);
  TERRANE_ASSIGN(PmtilesReader elevation, PmtilesReader::open(elevationPath));
  if (elevation.tileCount() != manifest.tileCount) {
    return makeError("{}: has {} tiles, the manifest says {}: build the dataset again", elevationPath,
                     elevation.tileCount(), manifest.tileCount);
  }
  std::vector<PmtilesReader> imagery;
  for (const ImageryLayerRecord& layer : manifest.imagery) {
    TERRANE_TRY(checkListed(layer.archive));
    TERRANE_ASSIGN(PmtilesReader reader, PmtilesReader::open(pathIn(directory, layer.archive)));
    if (reader.tileCount() != layer.tileCount) {
      return makeError("{}: has {} tiles, the manifest says {}: build the dataset again",
                       pathIn(directory, layer.archive), reader.tileCount(), layer.tileCount);
    }
    imagery.push_back(std::move(reader));
  }
  auto state = std::make_unique<State>(directory, std::move(manifest), std::move(elevation));
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
  return state_->directory;
}

Result<std::optional<std::vector<uint8_t>>> Dataset::readElevation(TileId id) const {
  auto bytes = state_->elevation.read(id);
  if (bytes.ok() && bytes->has_value()) state_->bytesRead += (*bytes)->size();
  return bytes;
}

Result<std::optional<std::vector<uint8_t>>> Dataset::readImagery(size_t layer, TileId id) const {
  TERRANE_CHECK(layer < state_->imagery.size(), "layer {} of {}", layer, state_->imagery.size());
  auto bytes = state_->imagery[layer].read(id);
  if (bytes.ok() && bytes->has_value()) state_->bytesRead += (*bytes)->size();
  return bytes;
}
std::vector<TileId> Dataset::imageryTiles(size_t layer) const {
  TERRANE_CHECK(layer < state_->imagery.size(), "layer {} of {}", layer, state_->imagery.size());
  return state_->imagery[layer].tiles();
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
    TERRANE_TRY(checkSize(path, record));
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
