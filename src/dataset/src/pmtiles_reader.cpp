#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

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
  DirectoryLoader(const ByteSource& source, const std::string& file, uint64_t fileBytes)
      : source_(source), file_(file), fileBytes_(fileBytes) {}

  Status load() {
    // Header and root directory lie in the first bytes.
    const FileRange first{file_, 0, std::min<uint64_t>(fileBytes_, kPmtilesFirstBytes)};
    TERRANE_ASSIGN(const auto read, source_.read(std::array{first}));
    const std::span<const uint8_t> bytes = read[0];
    auto header = pmtilesHeaderFromBytes(bytes);
    if (!header.ok()) return inFile(header.error());
    header_ = *header;
    if (const Status status = checkRanges(); !status.ok()) return inFile(status.error());
    TERRANE_TRY(loadDirectory(
        header_.root,
        bytes.subspan(static_cast<size_t>(header_.root.offset), static_cast<size_t>(header_.root.length)), 0,
        1));
    if (addressed_ != header_.addressedTiles || entries_.size() != header_.tileEntries) {
      return inFile(makeError("has {} tiles in {} entries where its header says {} in {}", addressed_,
                              entries_.size(), header_.addressedTiles, header_.tileEntries));
    }
    return {};
  }

  const PmtilesHeader& header() const { return header_; }
  std::vector<PmtilesEntry> takeEntries() { return std::move(entries_); }

 private:
  Error inFile(const Error& error) const { return makeError("{}: {}", source_.where(file_), error.message); }

  Status checkRanges() const {
    TERRANE_TRY(checkRange(header_.root, "root directory"));
    TERRANE_TRY(checkRange(header_.metadata, "metadata"));
    TERRANE_TRY(checkRange(header_.leaves, "leaf directories"));
    TERRANE_TRY(checkRange(header_.tileData, "tile data"));
    if (header_.root.offset + header_.root.length > kPmtilesFirstBytes) {
      return makeError("root directory ends beyond byte {}", kPmtilesFirstBytes);
    }
    return {};
  }

  Status checkRange(const ByteRange& range, const char* what) const {
    if (range.offset <= fileBytes_ && range.length <= fileBytes_ - range.offset) return {};
    return makeError("{} at byte {} with {} bytes is beyond the file's {}: the file is truncated or damaged",
                     what, range.offset, range.length, fileBytes_);
  }

  Status loadDirectory(const ByteRange& range, std::span<const uint8_t> bytes, uint64_t firstId, int depth) {
    auto entries = unpack(range, bytes);
    if (!entries.ok()) return inFile(entries.error());
    if (depth > 1 && (entries->empty() || (*entries)[0].id != firstId))
      return inFile(
          makeError("leaf directory at byte {} does not begin with tile id {}", range.offset, firstId));

    // Its leaves are read together, and follow in their places.
    std::vector<FileRange> leaves;
    for (const PmtilesEntry& entry : *entries) {
      if (entry.runLength != 0) continue;
      if (const Status status = checkLeaf(entry, depth); !status.ok()) return inFile(status.error());
      leaves.push_back({file_, header_.leaves.offset + entry.offset, entry.length});
    }
    TERRANE_ASSIGN(const auto read, source_.read(leaves));
    size_t leaf = 0;
    for (const PmtilesEntry& entry : *entries) {
      if (entry.runLength == 0) {
        TERRANE_TRY(
            loadDirectory({leaves[leaf].offset, leaves[leaf].bytes}, read[leaf], entry.id, depth + 1));
        ++leaf;
      } else if (const Status status = addTiles(entry); !status.ok()) {
        return inFile(status.error());
      }
    }
    return {};
  }

  Result<std::vector<PmtilesEntry>> unpack(const ByteRange& range, std::span<const uint8_t> bytes) const {
    if (header_.internalCompression != PmtilesCompression::Gzip) return directoryFromBytes(bytes);
    const auto unpacked = gunzip(bytes, kDirectoryBytesPerByte * fileBytes_);
    if (!unpacked.ok()) return makeError("directory at byte {} {}", range.offset, unpacked.error().message);
    return directoryFromBytes(*unpacked);
  }

  /// Leaves lie in order, each byte in one of them: no leaf is read twice, whatever points at it.
  Status checkLeaf(const PmtilesEntry& entry, int depth) {
    if (depth >= kDeepestDirectory)
      return makeError("directories are nested more than {} deep", kDeepestDirectory);
    if (entry.offset < leafEnd_[depth] || entry.offset > header_.leaves.length ||
        entry.length > header_.leaves.length - entry.offset) {
      return makeError("leaf directory of tile id {} at {} with {} bytes is out of place", entry.id,
                       entry.offset, entry.length);
    }
    leafEnd_[depth] = entry.offset + entry.length;
    return {};
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

  const ByteSource& source_;
  const std::string& file_;
  uint64_t fileBytes_;
  PmtilesHeader header_;
  std::vector<PmtilesEntry> entries_;
  uint64_t nextId_ = 0;
  uint64_t dataEnd_ = 0;
  uint64_t addressed_ = 0;
  std::array<uint64_t, kDeepestDirectory> leafEnd_{};
};

}  // namespace

struct PmtilesReader::State {
  std::shared_ptr<const ByteSource> source;
  std::string file;
  PmtilesHeader header;
  std::vector<PmtilesEntry> entries;  ///< of tiles, by id
};

Result<PmtilesReader> PmtilesReader::open(const std::string& path) {
  const std::filesystem::path whole(path);
  std::shared_ptr<ByteSource> source = openDirectoryBytes(whole.parent_path().string());
  TERRANE_ASSIGN(const File file, File::openForReading(path));
  TERRANE_ASSIGN(const uint64_t bytes, file.size());
  TERRANE_TRY(source->open(whole.filename().string(), bytes));
  return open(std::move(source), whole.filename().string(), bytes);
}

Result<PmtilesReader> PmtilesReader::open(std::shared_ptr<const ByteSource> source, const std::string& file,
                                          uint64_t fileBytes) {
  DirectoryLoader loader(*source, file, fileBytes);
  TERRANE_TRY(loader.load());
  auto state = std::make_unique<State>();
  state->source = std::move(source);
  state->file = file;
  state->header = loader.header();
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
  TERRANE_ASSIGN(auto read, this->read(std::array{id}));
  return std::move(read[0]);
}

Result<std::vector<std::optional<std::vector<uint8_t>>>> PmtilesReader::read(
    std::span<const TileId> ids) const {
  std::vector<FileRange> ranges;
  std::vector<size_t> which;
  for (size_t i = 0; i < ids.size(); ++i) {
    const auto place = find(ids[i]);
    if (!place) continue;
    ranges.push_back({state_->file, place->offset, place->bytes});
    which.push_back(i);
  }
  std::vector<std::optional<std::vector<uint8_t>>> out(ids.size());
  if (ranges.empty()) return out;
  TERRANE_ASSIGN(auto read, state_->source->read(ranges));
  for (size_t i = 0; i < which.size(); ++i) out[which[i]] = std::move(read[i]);
  return out;
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
