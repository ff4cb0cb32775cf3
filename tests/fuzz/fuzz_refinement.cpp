#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "fuzz_tiles.h"
#include "payload_check.h"
#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"

namespace {

using namespace terrane;

/// The root and its four children, each with all layers, and with so many less.
struct Tiles {
  Tiles() {
    tiles[0] = fuzzLayeredParent();
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      tiles[static_cast<size_t>(1 + quadrant)] = fuzzLayeredChild(tiles[0], quadrant);
    for (size_t i = 0; i < tiles.size(); ++i)
      for (int layer = 0; layer < kFuzzLayers - 1; ++layer)
        before[i][static_cast<size_t>(layer)] = samplesOfLayer(tiles[i], layer);
  }
  std::array<TileSamples, 5> tiles;
  std::array<std::array<TileSamples, kFuzzLayers - 1>, 5> before;
};

void checkSame(const TileSamples& a, const TileSamples& b) {
  TERRANE_CHECK(a.heights == b.heights);
  TERRANE_CHECK(a.states == b.states);
  TERRANE_CHECK(a.layerCount == b.layerCount);
  for (size_t i = 0; i < a.states.size(); ++i) {
    if (a.states[i] == SampleState::Coded)
      TERRANE_CHECK(a.layerAt(i) == b.layerAt(i), "sample {}: {}, {}", i, a.layerAt(i), b.layerAt(i));
  }
}

}  // namespace

/// The first byte is a FuzzPlace, the rest the payload.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  static const Tiles all;
  static const ElevationScale scale = fuzzScaleOfLayers();
  const FuzzPlace place(data[0]);
  const TileSamples* parent = place.isChild ? &all.tiles[0] : nullptr;
  const auto tile = static_cast<size_t>(place.isChild ? 1 + place.quadrant : 0);
  const TileSamples& before = all.before[tile][static_cast<size_t>(place.layer - 1)];

  // The check would keep out all that is not a whole payload: it is made right.
  std::vector<uint8_t> payload(data + 1, data + size);
  if (payload.size() >= kCheckedFrom) sealPayload(payload);
  const Result<TileSamples> refined = refineTile(payload, before, parent, place.quadrant, scale);
  if (!refined.ok()) return 0;

  // What was accepted is a tile in layers: the one that was refined is in it, and it can be written and read
  // again.
  for (const float height : refined->heights) TERRANE_CHECK(std::isfinite(height), "height {}", height);
  checkSame(samplesOfLayer(*refined, place.layer - 1), before);
  const Result<TileSamples> again =
      refineTile(encodeRefinement(*refined, parent, place.quadrant, place.layer, scale), before, parent,
                 place.quadrant, scale);
  TERRANE_CHECK(again.ok(), "{}", again.error().message);
  checkSame(*again, *refined);
  return 0;
}
