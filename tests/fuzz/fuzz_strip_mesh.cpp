#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/check.h"
#include "terrane/codec/strip_mesh.h"

/// The input is a strip mesh.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  const std::span<const uint8_t> bytes(data, size);
  const Result<StripMesh> mesh = parseStripMesh(bytes);
  if (!mesh.ok()) return 0;

  // What was read is written again as it was, and both decoders agree on it.
  std::vector<uint32_t> vertices;
  const Result<size_t> count = decodeStripMesh(*mesh, vertices);
  TERRANE_CHECK(count.ok() == validateStripMesh(*mesh).ok());
  TERRANE_CHECK(vertices.size() == (count.ok() ? *count * 3 : 0), "{} vertices", vertices.size());
  const std::vector<uint8_t> again = bytesOf(*mesh);
  TERRANE_CHECK(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()));

  // What is drawn lies on the tile.
  for (const uint32_t packed : vertices) {
    const StripVertex vertex = unpackStripVertex(packed);
    const auto side = static_cast<uint32_t>(mesh->side);
    TERRANE_CHECK(vertex.x < side && vertex.y < side && vertex.q >> mesh->heightBits == 0, "{} {} {}",
                  vertex.x, vertex.y, vertex.q);
  }
  return 0;
}
