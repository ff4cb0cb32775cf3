#include "pmtiles_format.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

namespace terrane {
namespace {

constexpr std::string_view kMagic = "PMTiles";
constexpr uint8_t kVersion = 3;

// Byte offsets in the header.
constexpr size_t kRanges = 8;
constexpr size_t kCounts = 72;
constexpr size_t kClustered = 96;
constexpr size_t kInternalCompression = 97;
constexpr size_t kTileCompression = 98;
constexpr size_t kTileType = 99;
constexpr size_t kShallowestLevel = 100;
constexpr size_t kDeepestLevel = 101;

/// zlib's windowBits for a gzip wrapper around the largest window.
constexpr int kGzipWindow = 15 + 16;

void putUint64(std::vector<uint8_t>& bytes, size_t at, uint64_t value) {
  for (size_t i = 0; i < 8; ++i) bytes[at + i] = static_cast<uint8_t>(value >> (8 * i));
}

uint64_t getUint64(std::span<const uint8_t> bytes, size_t at) {
  uint64_t value = 0;
  for (size_t i = 0; i < 8; ++i) value |= uint64_t{bytes[at + i]} << (8 * i);
  return value;
}

void putVarint(std::vector<uint8_t>& bytes, uint64_t value) {
  for (; value >= 128; value >>= 7) bytes.push_back(static_cast<uint8_t>(value | 128));
  bytes.push_back(static_cast<uint8_t>(value));
}

class VarintReader {
 public:
  explicit VarintReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}
  size_t offset() const { return offset_; }
  size_t remaining() const { return bytes_.size() - offset_; }

  Result<uint64_t> next(uint64_t limit) {
    const size_t start = offset_;
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (offset_ == bytes_.size())
        return makeError("directory ends inside the number at its byte {}", start);
      const uint64_t byte = bytes_[offset_++];
      // The tenth byte has room for one bit.
      if (shift == 63 && byte > 1) break;
      value |= (byte & 127U) << shift;
      if (byte >= 128) continue;
      if (value > limit) return makeError("directory has {} at its byte {}, {} at most", value, start, limit);
      return value;
    }
    return makeError("directory has an endless number at its byte {}", start);
  }

 private:
  std::span<const uint8_t> bytes_;
  size_t offset_ = 0;
};

}  // namespace

std::vector<uint8_t> pmtilesHeaderToBytes(const PmtilesHeader& header) {
  // note: the last 25 bytes are a place on the globe, which a projected dataset may not have; they stay 0.
  std::vector<uint8_t> bytes(kPmtilesHeaderBytes, 0);
  std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  bytes[kMagic.size()] = kVersion;
  size_t at = kRanges;
  for (const ByteRange& range : {header.root, header.metadata, header.leaves, header.tileData}) {
    putUint64(bytes, at, range.offset);
    putUint64(bytes, at + 8, range.length);
    at += 16;
  }
  putUint64(bytes, kCounts, header.addressedTiles);
  putUint64(bytes, kCounts + 8, header.tileEntries);
  putUint64(bytes, kCounts + 16, header.tileContents);
  bytes[kClustered] = header.clustered ? 1 : 0;
  bytes[kInternalCompression] = static_cast<uint8_t>(header.internalCompression);
  bytes[kTileCompression] = static_cast<uint8_t>(header.tileCompression);
  bytes[kTileType] = header.tileType;
  bytes[kShallowestLevel] = header.minLevel;
  bytes[kDeepestLevel] = header.maxLevel;
  return bytes;
}

Result<PmtilesHeader> pmtilesHeaderFromBytes(std::span<const uint8_t> bytes) {
  if (bytes.size() < kPmtilesHeaderBytes) {
    return makeError("has {} bytes, a PMTiles header alone has {}", bytes.size(), kPmtilesHeaderBytes);
  }
  if (!std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) return makeError("is not a PMTiles archive");
  if (bytes[kMagic.size()] != kVersion) {
    return makeError("is a PMTiles archive of version {}, only {} can be read", bytes[kMagic.size()],
                     kVersion);
  }

  PmtilesHeader header;
  size_t at = kRanges;
  for (ByteRange* range : {&header.root, &header.metadata, &header.leaves, &header.tileData}) {
    *range = {getUint64(bytes, at), getUint64(bytes, at + 8)};
    at += 16;
  }
  header.addressedTiles = getUint64(bytes, kCounts);
  header.tileEntries = getUint64(bytes, kCounts + 8);
  header.tileContents = getUint64(bytes, kCounts + 16);
  header.clustered = bytes[kClustered] == 1;
  header.internalCompression = static_cast<PmtilesCompression>(bytes[kInternalCompression]);
  header.tileCompression = static_cast<PmtilesCompression>(bytes[kTileCompression]);
  header.tileType = bytes[kTileType];
  header.minLevel = bytes[kShallowestLevel];
  header.maxLevel = bytes[kDeepestLevel];
  if (header.internalCompression != PmtilesCompression::None &&
      header.internalCompression != PmtilesCompression::Gzip) {
    return makeError("has directories compressed by method {}, only none (1) and gzip (2) can be read",
                     bytes[kInternalCompression]);
  }
  if (header.tileCompression != PmtilesCompression::None &&
      header.tileCompression != PmtilesCompression::Unknown) {
    return makeError("has tiles compressed by method {}, only none (1) can be read", bytes[kTileCompression]);
  }
  return header;
}

std::vector<uint8_t> directoryToBytes(std::span<const PmtilesEntry> entries) {
  std::vector<uint8_t> bytes;
  putVarint(bytes, entries.size());
  uint64_t last = 0;
  for (const PmtilesEntry& entry : entries) {
    putVarint(bytes, entry.id - last);
    last = entry.id;
  }
  for (const PmtilesEntry& entry : entries) putVarint(bytes, entry.runLength);
  for (const PmtilesEntry& entry : entries) putVarint(bytes, entry.length);
  for (size_t i = 0; i < entries.size(); ++i) {
    // 0 says: right behind the entry before.
    const bool follows = i > 0 && entries[i].offset == entries[i - 1].offset + entries[i - 1].length;
    putVarint(bytes, follows ? 0 : entries[i].offset + 1);
  }
  return bytes;
}

Result<std::vector<PmtilesEntry>> directoryFromBytes(std::span<const uint8_t> bytes) {
  VarintReader in(bytes);
  constexpr uint64_t kAny = std::numeric_limits<uint64_t>::max();
  constexpr uint64_t kAny32 = std::numeric_limits<uint32_t>::max();

  // Every entry takes at least a byte in each of the four columns.
  TERRANE_ASSIGN(const uint64_t count, in.next(kAny));
  if (count > in.remaining() / 4) {
    return makeError("directory claims {} entries in {} bytes", count, in.remaining());
  }
  std::vector<PmtilesEntry> entries(static_cast<size_t>(count));

  uint64_t last = 0;
  for (size_t i = 0; i < entries.size(); ++i) {
    TERRANE_ASSIGN(const uint64_t step, in.next(kAny - last));
    if (i > 0 && step == 0) return makeError("directory has the tile id {} twice", last);
    entries[i].id = last += step;
  }
  for (PmtilesEntry& entry : entries) {
    TERRANE_ASSIGN(const uint64_t runLength, in.next(kAny32));
    entry.runLength = static_cast<uint32_t>(runLength);
  }
  for (PmtilesEntry& entry : entries) {
    TERRANE_ASSIGN(const uint64_t length, in.next(kAny32));
    if (length == 0) return makeError("directory has a tile (id {}) without bytes", entry.id);
    entry.length = static_cast<uint32_t>(length);
  }
  for (size_t i = 0; i < entries.size(); ++i) {
    TERRANE_ASSIGN(const uint64_t offset, in.next(kAny));
    if (offset > 0) {
      entries[i].offset = offset - 1;
    } else if (i == 0) {
      return makeError("directory begins with a tile that follows another");
    } else {
      const PmtilesEntry& before = entries[i - 1];
      if (before.offset > kAny - before.length) return makeError("directory has an offset beyond 64 bits");
      entries[i].offset = before.offset + before.length;
    }
  }
  if (in.remaining() != 0) return makeError("directory has {} bytes too many", in.remaining());
  return entries;
}

std::vector<uint8_t> gzip(std::span<const uint8_t> bytes) {
  z_stream stream{};
  TERRANE_CHECK(
      deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) == Z_OK,
      "zlib does not start");
  std::vector<uint8_t> packed(deflateBound(&stream, static_cast<uLong>(bytes.size())));
  stream.next_in = const_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  const int status = deflate(&stream, Z_FINISH);
  packed.resize(packed.size() - stream.avail_out);
  deflateEnd(&stream);
  TERRANE_CHECK(status == Z_STREAM_END, "zlib status {}", status);
  return packed;
}

Result<std::vector<uint8_t>> gunzip(std::span<const uint8_t> bytes, uint64_t limit) {
  z_stream stream{};
  TERRANE_CHECK(inflateInit2(&stream, kGzipWindow) == Z_OK, "zlib does not start");
  stream.next_in = const_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());

  // note: nothing of the size that the stream may claim is believed.
  std::vector<uint8_t> unpacked;
  std::array<uint8_t, 16384> piece;
  int status = Z_OK;
  while (status == Z_OK && unpacked.size() <= limit) {
    stream.next_out = piece.data();
    stream.avail_out = static_cast<uInt>(piece.size());
    status = inflate(&stream, Z_NO_FLUSH);
    unpacked.insert(unpacked.end(), piece.data(), piece.data() + (piece.size() - stream.avail_out));
  }
  const size_t unread = stream.avail_in;
  inflateEnd(&stream);
  if (unpacked.size() > limit) return makeError("unpacks to more than {} bytes", limit);
  if (status != Z_STREAM_END) return makeError("is not whole gzip data");
  if (unread != 0) return makeError("has {} bytes after its gzip data", unread);
  return unpacked;
}

}  // namespace terrane
