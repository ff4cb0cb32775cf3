#include <bit>

#include "byte_streams.h"
#include "terrane/base/bit_cast.h"
#include "terrane/codec/strip_mesh.h"

namespace terrane {

namespace {

constexpr uint8_t kStripVersion = 1;

void putDouble(ByteWriter& out, double value) {
  const auto bits = bitCast<uint64_t>(value);
  out.uint32(static_cast<uint32_t>(bits));
  out.uint32(static_cast<uint32_t>(bits >> 32));
}

Result<double> readDouble(ByteReader& in) {
  TERRANE_ASSIGN(const uint32_t low, in.uint32());
  TERRANE_ASSIGN(const uint32_t high, in.uint32());
  return bitCast<double>(low | uint64_t{high} << 32);
}

size_t entryBytes(const StripMesh& mesh) {
  return (mesh.topologyBitCount() + mesh.heightBitCount() + 7) / 8;
}

Result<StripMesh> parse(std::span<const uint8_t> bytes) {
  ByteReader in(bytes);
  StripMesh mesh;
  TERRANE_ASSIGN(const uint8_t version, in.byte());
  if (version != kStripVersion)
    return makeError("has version {}, this program reads {}", version, kStripVersion);
  TERRANE_ASSIGN(const uint8_t levels, in.byte());
  if (levels < 1 || levels > 9) return makeError("byte 1: a side of 2^{} + 1 samples", levels);
  mesh.side = (1 << levels) + 1;
  TERRANE_ASSIGN(const uint8_t heightBits, in.byte());
  if (heightBits > kMaxStripHeightBits) return makeError("byte 2: heights of {} bits", heightBits);
  mesh.heightBits = heightBits;
  TERRANE_ASSIGN(const uint8_t unused, in.byte());
  if (unused != 0) return makeError("byte 3: is not 0");
  TERRANE_ASSIGN(mesh.triangleCount, in.uint32());
  TERRANE_ASSIGN(mesh.baseMeters, readDouble(in));
  TERRANE_ASSIGN(mesh.stepMeters, readDouble(in));

  // Nothing is allocated for what is not there.
  const size_t headers = (size_t{mesh.triangleCount} + kStripLength - 1) / kStripLength;
  const size_t wanted = headers * 4 + entryBytes(mesh);
  if (in.remaining() != wanted)
    return makeError("byte {}: has {} more bytes, {} triangles take {}", in.offset(), in.remaining(),
                     mesh.triangleCount, wanted);
  mesh.headers.reserve(headers);
  for (size_t i = 0; i < headers; ++i) {
    TERRANE_ASSIGN(const uint32_t header, in.uint32());
    mesh.headers.push_back(header);
  }
  const std::span<const uint8_t> rest = bytes.subspan(in.offset());
  mesh.entries.assign((rest.size() + 3) / 4 + 1, 0);
  for (size_t i = 0; i < rest.size(); ++i) mesh.entries[i / 4] |= uint32_t{rest[i]} << (i % 4 * 8);
  return mesh;
}

}  // namespace

std::vector<uint8_t> bytesOf(const StripMesh& mesh) {
  ByteWriter out;
  out.byte(kStripVersion);
  out.byte(static_cast<uint8_t>(std::countr_zero(static_cast<unsigned>(mesh.side - 1))));
  out.byte(static_cast<uint8_t>(mesh.heightBits));
  out.byte(0);
  out.uint32(mesh.triangleCount);
  putDouble(out, mesh.baseMeters);
  putDouble(out, mesh.stepMeters);
  for (const uint32_t header : mesh.headers) out.uint32(header);
  const size_t count = entryBytes(mesh);
  for (size_t i = 0; i < count; ++i) out.byte(static_cast<uint8_t>(mesh.entries[i / 4] >> (i % 4 * 8)));
  return out.take();
}

Result<StripMesh> parseStripMesh(std::span<const uint8_t> bytes) {
  auto mesh = parse(bytes);
  if (!mesh.ok()) return makeError("strip mesh: {}", mesh.error().message);
  return mesh;
}

}  // namespace terrane
