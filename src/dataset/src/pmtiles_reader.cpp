#include <algorithm>
#include <array>

#include "file.h"
#include "pmtiles_format.h"
#include "terrane/base/check.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// Root, leaves, and one level more than anybody writes.
constexpr int kDeepestDirectory = 3;
/// An entry's varints have at most 10 + 5 + 5 + 10 bytes, and every entry has a byte of tile data of its own.
constexpr uint64_t kDirectoryBytesPerByte = 32;
constexpr uint64_t kIdsAtAll = ((uint64_t{1} << (2 * (kMaxLevel + 1))) - 1) / 3;

/// Reads all of an archive's directories into one list, and believes nothing.
class DirectoryLoader {
 public:
  DirectoryLoader(const File& file, uint64_t fileBytes, const PmtilesHeader& header)
      : file_(file), fileBytes_(fileBytes), header_(header) {}

  Status load() {
    TERRANE_TRY(checkRange(header_.root, "root directory"));
    TERRANE_TRY(checkRange(header_.metadata, "metadata"));
    TERRANE_TRY(checkRange(header_.leaves, "leaf directories"));
    TERRANE_TRY(checkRange(header_.tileData, "tile data"));
    if (header_.root.offset + header_.root.length > kPmtilesFirstBytes) {
      return makeError("root directory ends beyond byte {}", kPmtilesFirstBytes);
    }
    TERRANE_TRY(loadDirectory(header_.root, 0, 1));
    if (addressed_ != header_.addressedTiles || entries_.size() != header_.tileEntries) {
      return makeError("has {} tiles in {} entries where its header says {} in {}", addressed_,
                       entries_.size(), header_.addressedTiles, header_.tileEntries);
    }
    return {};
  }

  std::vector<PmtilesEntry> takeEntries() { return std::move(entries_); }

 private:
  Status checkRange(const ByteRange& range, const char* what) const {
    if (range.offset <= fileBytes_ && range.length <= fileBytes_ - range.offset) return {};
    return makeError("{} at byte {} with {} bytes is beyond the file's {}: the file is truncated or damaged",
                     what, range.offset, range.length, fileBytes_);
  }

  Status loadDirectory(const ByteRange& range, uint64_t firstId, int depth) {
    std::vector<uint8_t> bytes(static_cast<size_t>(range.length));
    TERRANE_TRY(file_.read(range.offset, bytes));
    if (header_.internalCompression == PmtilesCompression::Gzip) {
      auto unpacked = gunzip(bytes, kDirectoryBytesPerByte * fileBytes_);
      if (!unpacked.ok()) return makeError("directory at byte {} {}", range.offset, unpacked.error().message);
      bytes = std::move(unpacked).value();
    }
    TERRANE_ASSIGN(const std::vector<PmtilesEntry> entries, directoryFromBytes(bytes));
    if (depth > 1 && (entries.empty() || entries[0].id != firstId)) {
      return makeError("leaf directory at byte {} does not begin with tile id {}", range.offset, firstId);
    }
    for (const PmtilesEntry& entry : entries) {
      TERRANE_TRY(entry.runLength == 0 ? loadLeaf(entry, depth) : addTiles(entry));
    }
    return {};
  }

  /// Leaves lie in order, each byte in one of them: no leaf is read twice, whatever points at it.
  Status loadLeaf(const PmtilesEntry& entry, int depth) {
    if (depth >= kDeepestDirectory)
      return makeError("directories are nested more than {} deep", kDeepestDirectory);
    if (entry.offset < leafEnd_[depth] || entry.offset > header_.leaves.length ||
        entry.length > header_.leaves.length - entry.offset) {
      return makeError("leaf directory of tile id {} at {} with {} bytes is out of place", entry.id,
                       entry.offset, entry.length);
    }
    leafEnd_[depth] = entry.offset + entry.length;
    return loadDirectory({header_.leaves.offset + entry.offset, entry.length}, entry.id, depth + 1);
  }

  /// Tiles neither overlap in ids nor in bytes.
  Status addTiles(const PmtilesEntry& entry) {
    if (entry.id < nextId_) return makeError("tile id {} is out of order", entry.id);
    if (entry.runLength > kPmtilesLongestRun) {
      return makeError("tile id {} is repeated {} times, {} at most", entry.id, entry.runLength,
                       kPmtilesLongestRun);
    }
    if (entry.id >= kIdsAtAll || entry.runLength > kIdsAtAll - entry.id) {
      return makeError("tile id {} is below level {}", entry.id, kMaxLevel);
    }
    if (entry.offset < dataEnd_ || entry.offset > header_.tileData.length ||
        entry.length > header_.tileData.length - entry.offset) {
      return makeError("tile id {} at {} with {} bytes is out of place", entry.id, entry.offset,
                       entry.length);
    }
    nextId_ = entry.id + entry.runLength;
    dataEnd_ = entry.offset + entry.length;
    addressed_ += entry.runLength;
    entries_.push_back(entry);
    return {};
  }

  const File& file_;
  uint64_t fileBytes_;
  const PmtilesHeader& header_;
  std::vector<PmtilesEntry> entries_;
  uint64_t nextId_ = 0;
  uint64_t dataEnd_ = 0;
  uint64_t addressed_ = 0;
  std::array<uint64_t, kDeepestDirectory> leafEnd_{};
};

}  // namespace

struct PmtilesReader::State {
  explicit State(File opened) : file(std::move(opened)) {}
  File file;
  PmtilesHeader header;
  std::vector<PmtilesEntry> entries;  ///< of tiles, by id
};

Result<PmtilesReader> PmtilesReader::open(const std::string& path) {
  TERRANE_ASSIGN(File file, File::openForReading(path));
  TERRANE_ASSIGN(const uint64_t fileBytes, file.size());
  std::vector<uint8_t> bytes(std::min<uint64_t>(fileBytes, kPmtilesHeaderBytes));
  TERRANE_TRY(file.read(0, bytes));

  auto state = std::make_unique<State>(std::move(file));
  auto header = pmtilesHeaderFromBytes(bytes);
  if (!header.ok()) return makeError("{}: {}", path, header.error().message);
  state->header = *header;
  DirectoryLoader loader(state->file, fileBytes, state->header);
  if (const Status status = loader.load(); !status.ok())
    return makeError("{}: {}", path, status.error().message);
  state->entries = loader.takeEntries();
  return PmtilesReader(std::move(state));
}

PmtilesReader::PmtilesReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
PmtilesReader::~PmtilesReader() = default;
PmtilesReader::PmtilesReader(PmtilesReader&&) noexcept = default;
PmtilesReader& PmtilesReader::operator=(PmtilesReader&&) noexcept = default;

std::optional<PmtilesPlace> PmtilesReader::find(TileId id) const {
  if (!id.valid()) return {};
  const uint64_t number = pmtilesId(id);
  const auto after =
      std::upper_bound(state_->entries.begin(), state_->entries.end(), number,
                       [](uint64_t value, const PmtilesEntry& entry) { return value < entry.id; });
  if (after == state_->entries.begin()) return {};
  const PmtilesEntry& entry = *(after - 1);
  if (number >= entry.id + entry.runLength) return {};
  return PmtilesPlace{number, state_->header.tileData.offset + entry.offset, entry.length};
}

Result<std::optional<std::vector<uint8_t>>> PmtilesReader::read(TileId id) const {
  using Bytes = std::optional<std::vector<uint8_t>>;
  const auto place = find(id);
  if (!place) return Bytes{};
  std::vector<uint8_t> bytes(place->bytes);
  TERRANE_TRY(state_->file.read(place->offset, bytes));
  return Bytes{std::move(bytes)};
}

uint64_t PmtilesReader::tileCount() const {
  return state_->header.addressedTiles;
}

std::vector<TileId> PmtilesReader::tiles() const {
  std::vector<TileId> ids;
  ids.reserve(state_->header.addressedTiles);
  for (const PmtilesEntry& entry : state_->entries) {
    for (uint64_t i = 0; i < entry.runLength; ++i) ids.push_back(tileIdFromPmtiles(entry.id + i));
  }
  return ids;
}

}  // namespace terrane
