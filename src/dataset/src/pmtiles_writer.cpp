#include <unistd.h>

#include <algorithm>

#include "file.h"
#include "pmtiles_format.h"
#include "terrane/base/check.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// Where the tile data begins: header and root directory have the bytes before for themselves, so that tiles
/// are written once, as they come.
constexpr uint64_t kTileDataStart = kPmtilesFirstBytes;
constexpr size_t kFewestLeafEntries = 4096;

/// A root directory that fits behind the header, and the leaf directories that it then needs.
struct Directories {
  std::vector<uint8_t> root;
  std::vector<uint8_t> leaves;
};

Directories makeDirectories(std::span<const PmtilesEntry> entries) {
  constexpr size_t kRoom = kPmtilesFirstBytes - kPmtilesHeaderBytes;
  Directories directories;
  if (entries.size() <= kFewestLeafEntries) directories.root = gzip(directoryToBytes(entries));
  if (!directories.root.empty() && directories.root.size() <= kRoom) return directories;

  // Larger leaves make a smaller root.
  for (size_t leafEntries = kFewestLeafEntries;; leafEntries *= 2) {
    std::vector<PmtilesEntry> pointers;
    directories.leaves.clear();
    for (size_t first = 0; first < entries.size(); first += leafEntries) {
      const auto part = entries.subspan(first, std::min(leafEntries, entries.size() - first));
      const std::vector<uint8_t> leaf = gzip(directoryToBytes(part));
      pointers.push_back({part[0].id, directories.leaves.size(), static_cast<uint32_t>(leaf.size()), 0});
      directories.leaves.insert(directories.leaves.end(), leaf.begin(), leaf.end());
    }
    directories.root = gzip(directoryToBytes(pointers));
    if (directories.root.size() <= kRoom) return directories;
  }
}

}  // namespace

struct PmtilesWriter::State {
  explicit State(File opened) : file(std::move(opened)) {}
  ~State() {
    // Half an archive is worth nothing, unless someone goes on with it.
    if (!finished && !keep) ::unlink(file.path().c_str());
  }

  /// Does the tile's entry extend the one before, whose bytes are the same?
  bool continuesRun(uint64_t number) const {
    return !entries.empty() && number == entries.back().id + entries.back().runLength &&
           entries.back().runLength < kPmtilesLongestRun;
  }

  File file;
  std::vector<PmtilesEntry> entries;
  std::vector<uint8_t> lastTile;
  uint64_t dataBytes = 0;
  uint64_t addressedTiles = 0;
  bool finished = false;
  bool keep = false;  ///< the file stays though it was not finished
};

Result<PmtilesWriter> PmtilesWriter::create(const std::string& path) {
  TERRANE_ASSIGN(File file, File::create(path));
  return PmtilesWriter(std::make_unique<State>(std::move(file)));
}

Result<PmtilesWriter> PmtilesWriter::goOn(const std::string& path, std::span<const PmtilesPlace> before) {
  TERRANE_ASSIGN(File file, File::openOrCreate(path));
  auto state = std::make_unique<State>(std::move(file));
  state->keep = true;
  for (const PmtilesPlace& place : before) {
    ++state->addressedTiles;
    if (state->continuesRun(place.id) && place.offset == state->entries.back().offset) {
      ++state->entries.back().runLength;
      continue;
    }
    if (place.offset != state->dataBytes || place.bytes == 0 || place.bytes > UINT32_MAX)
      return makeError("{}: tile {} cannot lie at byte {}; delete it and start afresh", path, place.id,
                       place.offset);
    state->entries.push_back({place.id, place.offset, static_cast<uint32_t>(place.bytes), 1});
    state->dataBytes += place.bytes;
  }

  // The next tile may be the last one again.
  if (!state->entries.empty()) {
    const PmtilesEntry& last = state->entries.back();
    state->lastTile.resize(last.length);
    TERRANE_TRY(state->file.read(kTileDataStart + last.offset, state->lastTile));
  }
  TERRANE_TRY(state->file.resize(before.empty() ? 0 : kTileDataStart + state->dataBytes));
  return PmtilesWriter(std::move(state));
}

PmtilesWriter::PmtilesWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
PmtilesWriter::~PmtilesWriter() = default;
PmtilesWriter::PmtilesWriter(PmtilesWriter&&) noexcept = default;
PmtilesWriter& PmtilesWriter::operator=(PmtilesWriter&&) noexcept = default;

Result<PmtilesPlace> PmtilesWriter::add(TileId id, std::span<const uint8_t> bytes) {
  State& state = *state_;
  const uint64_t number = pmtilesId(id);
  TERRANE_CHECK(!state.finished, "tile {} after finish()", toString(id));
  TERRANE_CHECK(!bytes.empty(), "tile {} has no bytes", toString(id));
  TERRANE_CHECK(bytes.size() <= UINT32_MAX, "tile {} has {} bytes", toString(id), bytes.size());
  ++state.addressedTiles;

  // The same bytes again, next to them: the run grows.
  if (!state.entries.empty()) {
    PmtilesEntry& last = state.entries.back();
    TERRANE_CHECK(number >= last.id + last.runLength, "tile {} comes too late", toString(id));
    if (state.continuesRun(number) &&
        std::equal(bytes.begin(), bytes.end(), state.lastTile.begin(), state.lastTile.end())) {
      ++last.runLength;
      return PmtilesPlace{number, last.offset, last.length};
    }
  }

  const PmtilesPlace place{number, state.dataBytes, bytes.size()};
  TERRANE_TRY(state.file.write(kTileDataStart + place.offset, bytes));
  state.entries.push_back({number, place.offset, static_cast<uint32_t>(bytes.size()), 1});
  state.lastTile.assign(bytes.begin(), bytes.end());
  state.dataBytes += bytes.size();
  return place;
}

Status PmtilesWriter::finish(const std::string& metadataJson) {
  State& state = *state_;
  TERRANE_CHECK(!state.finished, "finish() twice");

  // Behind the tiles come the leaf directories and the metadata.
  const Directories directories = makeDirectories(state.entries);
  const std::vector<uint8_t> metadata =
      gzip({reinterpret_cast<const uint8_t*>(metadataJson.data()), metadataJson.size()});
  PmtilesHeader header;
  header.root = {kPmtilesHeaderBytes, directories.root.size()};
  header.tileData = {kTileDataStart, state.dataBytes};
  header.leaves = {kTileDataStart + state.dataBytes, directories.leaves.size()};
  header.metadata = {header.leaves.offset + header.leaves.length, metadata.size()};
  header.addressedTiles = state.addressedTiles;
  header.tileEntries = state.entries.size();
  header.tileContents = state.entries.size();
  if (!state.entries.empty()) {
    const PmtilesEntry& last = state.entries.back();
    header.minLevel = static_cast<uint8_t>(tileIdFromPmtiles(state.entries.front().id).level);
    header.maxLevel = static_cast<uint8_t>(tileIdFromPmtiles(last.id + last.runLength - 1).level);
  }
  TERRANE_TRY(state.file.write(header.leaves.offset, directories.leaves));
  TERRANE_TRY(state.file.write(header.metadata.offset, metadata));

  // The bytes between root directory and tile data are written too: no holes whose content depends on the
  // disk.
  std::vector<uint8_t> first = pmtilesHeaderToBytes(header);
  first.insert(first.end(), directories.root.begin(), directories.root.end());
  first.resize(kPmtilesFirstBytes, 0);
  TERRANE_TRY(state.file.write(0, first));
  TERRANE_TRY(state.file.syncAndClose());
  state.finished = true;
  return {};
}

}  // namespace terrane
