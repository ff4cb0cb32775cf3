#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "memory_file.h"
#include "pmtiles_format.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// Opens bytes as an archive and reads whatever it claims to have.
void openAndRead(std::span<const uint8_t> bytes) {
  const MemoryFile file(bytes);
  const Result<PmtilesReader> reader = PmtilesReader::open(file.path());
  if (!reader.ok()) return;
  const std::vector<TileId> tiles = reader->tiles();
  TERRANE_CHECK(tiles.size() == reader->tileCount(), "{} of {}", tiles.size(), reader->tileCount());
  const size_t few = std::min<size_t>(tiles.size(), 64);
  for (size_t i = 0; i < few; ++i) {
    TERRANE_CHECK(tiles[i].valid(), "{}", toString(tiles[i]));
    const auto tile = reader->read(tiles[i]);
    TERRANE_CHECK(!tile.ok() || tile->has_value(), "{} is listed and not there", toString(tiles[i]));
  }
}

/// An archive with the given directories, compressed as they must be: what random bytes never get past.
std::vector<uint8_t> archiveAround(std::span<const uint8_t> root, std::span<const uint8_t> leaf) {
  const std::vector<uint8_t> rootBytes = gzip(root);
  const std::vector<uint8_t> leafBytes = gzip(leaf);
  const std::vector<uint8_t> metadata = gzip(std::vector<uint8_t>{'{', '}'});
  PmtilesHeader header;
  header.root = {kPmtilesHeaderBytes, rootBytes.size()};
  header.metadata = {header.root.offset + header.root.length, metadata.size()};
  header.leaves = {header.metadata.offset + header.metadata.length, leafBytes.size()};
  header.tileData = {header.leaves.offset + header.leaves.length, 256};
  header.maxLevel = 21;
  // Counts that fit, as far as the root alone says.
  if (const auto entries = directoryFromBytes(root); entries.ok()) {
    for (const PmtilesEntry& entry : *entries) header.addressedTiles += entry.runLength;
    header.tileEntries = entries->size();
    header.tileContents = entries->size();
  }

  std::vector<uint8_t> bytes = pmtilesHeaderToBytes(header);
  for (const auto* part : {&rootBytes, &metadata, &leafBytes})
    bytes.insert(bytes.end(), part->begin(), part->end());
  bytes.resize(bytes.size() + 256, 7);
  return bytes;
}

}  // namespace
}  // namespace terrane

/// First byte 0: the rest is an archive. Else the rest is a root directory of that many bytes, then a leaf
/// directory.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  if (size == 0) return 0;
  const std::span<const uint8_t> rest(data + 1, size - 1);
  if (data[0] == 0) {
    openAndRead(rest);
  } else {
    const size_t rootSize = std::min<size_t>(data[0], rest.size());
    openAndRead(archiveAround(rest.first(rootSize), rest.subspan(rootSize)));
  }
  return 0;
}
