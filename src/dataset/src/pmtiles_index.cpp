#include "terrane/dataset/pmtiles_index.h"

#include <algorithm>

#include "pmtiles_format.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// No directory of ours is larger, unpacked; nobody's should be.
constexpr uint64_t kLargestDirectory = 64U << 20;

bool isWithin(const ByteRange& range, uint64_t bytes) {
  return range.offset <= bytes && range.length <= bytes - range.offset;
}

Result<std::vector<PmtilesEntry>> unpack(std::span<const uint8_t> bytes, PmtilesCompression compression) {
  if (compression != PmtilesCompression::Gzip) return directoryFromBytes(bytes);
  TERRANE_ASSIGN(const std::vector<uint8_t> unpacked, gunzip(bytes, kLargestDirectory));
  return directoryFromBytes(unpacked);
}

/// The last entry at or before an id.
const PmtilesEntry* entryFor(const std::vector<PmtilesEntry>& entries, uint64_t id) {
  const auto after =
      std::upper_bound(entries.begin(), entries.end(), id,
                       [](uint64_t value, const PmtilesEntry& entry) { return value < entry.id; });
  return after == entries.begin() ? nullptr : &*(after - 1);
}

}  // namespace

struct PmtilesIndex::State {
  PmtilesHeader header;
  std::vector<PmtilesEntry> root;
  std::map<uint64_t, std::vector<PmtilesEntry>> leaves;  ///< by their offset in the file
};

PmtilesIndex::PmtilesIndex() : state_(std::make_unique<State>()) {}
PmtilesIndex::~PmtilesIndex() = default;
PmtilesIndex::PmtilesIndex(PmtilesIndex&&) noexcept = default;
PmtilesIndex& PmtilesIndex::operator=(PmtilesIndex&&) noexcept = default;

Result<PmtilesIndex> PmtilesIndex::open(std::span<const uint8_t> firstBytes, uint64_t archiveBytes) {
  PmtilesIndex out;
  PmtilesHeader& header = out.state_->header;
  TERRANE_ASSIGN(header, pmtilesHeaderFromBytes(firstBytes));
  if (!isWithin(header.root, firstBytes.size()))
    return makeError("root directory at byte {} with {} bytes is beyond the first {}", header.root.offset,
                     header.root.length, firstBytes.size());
  if (!isWithin(header.leaves, archiveBytes) || !isWithin(header.tileData, archiveBytes))
    return makeError("its sections lie beyond its {} bytes: the file is truncated or damaged", archiveBytes);
  TERRANE_ASSIGN(out.state_->root, unpack(firstBytes.subspan(static_cast<size_t>(header.root.offset),
                                                             static_cast<size_t>(header.root.length)),
                                          header.internalCompression));
  return out;
}

PmtilesIndex::Found PmtilesIndex::find(TileId id) const {
  if (!id.valid()) return {};
  const uint64_t number = pmtilesId(id);
  const PmtilesHeader& header = state_->header;
  const PmtilesEntry* entry = entryFor(state_->root, number);
  if (entry != nullptr && entry->runLength == 0) {
    const ByteRange range{header.leaves.offset + entry->offset, entry->length};
    if (entry->offset > header.leaves.length || entry->length > header.leaves.length - entry->offset)
      return {};
    const auto leaf = state_->leaves.find(range.offset);
    if (leaf == state_->leaves.end()) return {Kind::InDirectory, {range.offset, range.length}};
    entry = entryFor(leaf->second, number);
  }
  // note: leaves of leaves, which our writer never makes, count as not stored.
  if (entry == nullptr || entry->runLength == 0 || number - entry->id >= entry->runLength) return {};
  if (entry->offset > header.tileData.length || entry->length > header.tileData.length - entry->offset)
    return {};
  return {Kind::Stored, {header.tileData.offset + entry->offset, entry->length}};
}

Status PmtilesIndex::addDirectory(Place place, std::span<const uint8_t> bytes) {
  if (bytes.size() != place.bytes)
    return makeError("directory at byte {} has {} bytes, not {}", place.offset, bytes.size(), place.bytes);
  auto entries = unpack(bytes, state_->header.internalCompression);
  if (!entries.ok()) return makeError("directory at byte {}: {}", place.offset, entries.error().message);
  state_->leaves[place.offset] = std::move(*entries);
  return {};
}

}  // namespace terrane
