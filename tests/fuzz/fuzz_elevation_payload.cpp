#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "fuzz_tiles.h"
#include "payload_check.h"
#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"

/// The first byte says whose payload it is: bit 0 a child's, bits 1 and 2 its quadrant; the rest is the
/// payload.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  if (size == 0) return 0;
  static const Tile parent = fuzzParent();
  const TileSamples* parentSamples = (data[0] & 1) != 0 ? &parent.samples : nullptr;
  const int quadrant = parentSamples != nullptr ? data[0] >> 1 & 3 : 0;

  // The check would keep out all that is not a whole payload: it is made right.
  std::vector<uint8_t> payload(data + 1, data + size);
  if (payload.size() >= kCheckedFrom) sealPayload(payload);
  if (parentSamples == nullptr) {
    const Result<Tile> sketch = decodeRootBeginning(payload, kFuzzScale);
    if (sketch.ok())
      for (const float height : sketch->samples.heights) TERRANE_CHECK(std::isfinite(height));
  }
  const Result<Tile> tile = decodeTile(payload, parentSamples, quadrant, kFuzzScale);
  if (!tile.ok()) return 0;

  // What was accepted is a tile like any other: it can be written and read again.
  for (const float height : tile->samples.heights) TERRANE_CHECK(std::isfinite(height), "height {}", height);
  const Result<Tile> again =
      decodeTile(encodeTile(*tile, parentSamples, quadrant, kFuzzScale), parentSamples, quadrant, kFuzzScale);
  TERRANE_CHECK(again.ok(), "{}", again.error().message);
  TERRANE_CHECK(again->samples.heights == tile->samples.heights);
  TERRANE_CHECK(again->samples.states == tile->samples.states);
  TERRANE_CHECK(again->nodes.error == tile->nodes.error && again->nodes.low == tile->nodes.low);
  for (int row = 0; row < kTileCells; ++row)
    for (int col = 0; col < kTileCells; ++col)
      TERRANE_CHECK(again->samples.coverage.covered(col, row) == tile->samples.coverage.covered(col, row));
  return 0;
}
