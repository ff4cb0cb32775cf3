#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"

/// The parts of a PMTiles v3 archive as values (github.com/protomaps/PMTiles, spec/v3/spec.md). What our
/// archives use of it is said in docs/format/dataset-v1.md.
namespace terrane {

inline constexpr size_t kPmtilesHeaderBytes = 127;
/// A client's first request: header and root directory lie within.
inline constexpr size_t kPmtilesFirstBytes = 16384;
/// Our archives' own limit, so that a listing of tiles is never out of proportion to the file.
inline constexpr uint32_t kPmtilesLongestRun = 64;

struct ByteRange {
  uint64_t offset = 0;
  uint64_t length = 0;
};

enum class PmtilesCompression : uint8_t { Unknown = 0, None = 1, Gzip = 2, Brotli = 3, Zstd = 4 };

struct PmtilesHeader {
  ByteRange root{};
  ByteRange metadata{};
  ByteRange leaves{};
  ByteRange tileData{};
  uint64_t addressedTiles = 0;
  uint64_t tileEntries = 0;
  uint64_t tileContents = 0;
  bool clustered = true;
  PmtilesCompression internalCompression = PmtilesCompression::Gzip;
  PmtilesCompression tileCompression = PmtilesCompression::None;
  uint8_t tileType = 0;  ///< unknown
  uint8_t minLevel = 0;
  uint8_t maxLevel = 0;
};

std::vector<uint8_t> pmtilesHeaderToBytes(const PmtilesHeader& header);
/// Magic, version and our profile are checked, ranges are not.
Result<PmtilesHeader> pmtilesHeaderFromBytes(std::span<const uint8_t> bytes);

/// Tiles id, id + 1, ... id + runLength - 1 have the bytes at `offset` of the tile data; runLength 0: the
/// directory at `offset` of the leaf directories has the entries from id on.
struct PmtilesEntry {
  uint64_t id = 0;
  uint64_t offset = 0;
  uint32_t length = 0;
  uint32_t runLength = 0;
};

/// A directory's columns of varints, not yet compressed. Ids must ascend.
std::vector<uint8_t> directoryToBytes(std::span<const PmtilesEntry> entries);
/// Ids ascend; nothing else is checked. Never more entries than a quarter of the bytes.
Result<std::vector<PmtilesEntry>> directoryFromBytes(std::span<const uint8_t> bytes);

std::vector<uint8_t> gzip(std::span<const uint8_t> bytes);
/// Unpacks at most `limit` bytes; memory grows with what is unpacked.
Result<std::vector<uint8_t>> gunzip(std::span<const uint8_t> bytes, uint64_t limit);

}  // namespace terrane
