#include <algorithm>
#include <memory>

#include "byte_streams.h"
#include "parent_samples.h"
#include "payload_check.h"
#include "sample_coding.h"
#include "sample_lattice.h"
#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"

// docs/format/refinement-v1.md specifies every byte that is written and read here.
namespace terrane {
namespace {

constexpr uint8_t kRefinementVersion = 1;
constexpr uint8_t kFlagOfRoot = 1;
constexpr uint8_t kFlagClosed = 2;
constexpr uint8_t kFlagEmpty = 4;

/// The largest half-size of samples that are not all of the first layer.
constexpr int kLargestRefined = 8;

/// The parent as the layer has it: itself where it has no more.
const TileSamples* parentOfLayer(const TileSamples* parent, int layer, TileSamples& room) {
  if (parent == nullptr || parent->layerCount == layer + 1) return parent;
  room = samplesOfLayer(*parent, layer);
  return &room;
}

/// Does the layer code any of the tile's own samples?
bool codesAny(const TileSamples& samples, bool isRoot, int layer) {
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      if (!isRoot && x % 2 == 0 && y % 2 == 0) continue;
      const auto at = static_cast<size_t>(y * kTileSamples + x);
      if (samples.states[at] == SampleState::Coded && samples.layerAt(at) == layer) return true;
    }
  }
  return false;
}

/// Does the layer code any sample of this half-size?
bool codesAnyOf(int s, const TileSamples& samples, int layer) {
  bool any = false;
  const auto look = [&](int center, int, int, int, int) {
    const auto at = static_cast<size_t>(center);
    any |= samples.states[at] == SampleState::Coded && samples.layerAt(at) == layer;
  };
  visitQuadCenters(s, look);
  visitEdgeCenters(s, look);
  return any;
}

/// Puts the parent's samples of a quadrant in the place of the tile's, which have a layer less.
void takeParent(const TileSamples& parent, int quadrant, TileSamples& tile) {
  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  for (int y = 0; y <= kTileCells / 2; ++y) {
    for (int x = 0; x <= kTileCells / 2; ++x) {
      const auto from = static_cast<size_t>((firstY + y) * kTileSamples + firstX + x);
      const auto to = static_cast<size_t>(2 * (y * kTileSamples + x));
      tile.heights[to] = parent.heights[from];
      tile.states[to] = parent.states[from];
    }
  }
  copyParentLayers(parent, quadrant, tile);
}

}  // namespace

TileSamples samplesOfLayer(const TileSamples& samples, int layer) {
  TERRANE_CHECK(layer >= 0 && layer < samples.layerCount, "layer {} of {}", layer, samples.layerCount);
  TileSamples out = samples;
  if (layer + 1 == samples.layerCount) return out;
  out.layerCount = layer + 1;
  if (layer == 0) out.layers.clear();
  const auto set = [&](int center, int endA, int endB) {
    const auto at = static_cast<size_t>(center);
    SampleState& state = out.states[at];
    if (state == SampleState::Coded && samples.layerAt(at) <= layer) return;
    if (state == SampleState::Coded) state = SampleState::Interpolated;
    float* heights = out.heights.data();
    heights[center] = (heights[endA] + heights[endB]) * 0.5F;
  };
  for (int s = kLargestRefined; s >= 1; s /= 2) {
    visitQuadCenters(s, [&](int center, int endA, int endB, int, int) { set(center, endA, endB); });
    visitEdgeCenters(s, [&](int center, int endA, int endB, int, int) { set(center, endA, endB); });
  }
  return out;
}

std::vector<uint8_t> encodeRefinement(const TileSamples& tile, const TileSamples* parent, int quadrant,
                                      int layer, const ElevationScale& scale) {
  TERRANE_CHECK(layer > 0 && layer < tile.layerCount && tile.layerCount <= ElevationScale::kMostLayers,
                "layer {} of {}", layer, tile.layerCount);
  const bool isRoot = parent == nullptr;
  const TileSamples samples = samplesOfLayer(tile, layer);
  if (!isRoot) {
    TileSamples room;
    checkParentSamples(samples, *parentOfLayer(parent, layer, room), quadrant);
  }
  const bool closed = ownStatesOf(samples.states, isRoot).closed;
  const bool isEmpty = !codesAny(samples, isRoot, layer);
  ByteWriter head;
  head.byte(kRefinementVersion);
  head.uint16(0);  // the check, when all else is there
  head.byte(static_cast<uint8_t>((isRoot ? kFlagOfRoot : 0) | (closed ? kFlagClosed : 0) |
                                 (isEmpty ? kFlagEmpty : 0)));
  std::vector<uint8_t> out = head.take();
  if (!isEmpty) {
    const auto models = std::make_unique<SampleModels>();
    for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2)
      encodeLevel(samples, s, layer, refinedStates(closed), scale, models.get(), out);
  }
  sealPayload(out);
  return out;
}

Result<TileSamples> refineTile(std::span<const uint8_t> payload, const TileSamples& before,
                               const TileSamples* parent, int quadrant, const ElevationScale& scale) {
  const int layer = before.layerCount;
  const bool isRoot = parent == nullptr;
  TERRANE_CHECK(isRoot || parent->layerCount > layer, "layer {} below {} layers", layer,
                isRoot ? 0 : parent->layerCount);
  if (layer >= scale.layerCount || layer >= ElevationScale::kMostLayers)
    return makeError("the dataset has {} layers, this would be one more", scale.layerCount);
  ByteReader in(payload);
  TERRANE_ASSIGN(const uint8_t version, in.byte());
  if (version != kRefinementVersion) {
    return makeError("byte 0: refinement version {}, this program reads {}: {}", version, kRefinementVersion,
                     version > kRefinementVersion ? "update Terrane" : "build the dataset again");
  }
  TERRANE_TRY(in.skip(kCheckedFrom - kCheckOffset));
  TERRANE_TRY(checkPayload(payload));
  TERRANE_ASSIGN(const unsigned flags, in.byte());
  if (flags >= 8) return makeError("byte 3: unknown flags {:#x}", flags);
  if (((flags & kFlagOfRoot) != 0) != isRoot) {
    return makeError("byte 3: {}",
                     isRoot ? "not a root tile, and no parent given" : "a root tile, but a parent given");
  }

  TileSamples out = before;
  out.layerCount = layer + 1;
  if (out.layers.empty()) out.layers.assign(kTileSampleCount, 0);
  if (!isRoot) {
    TileSamples room;
    takeParent(*parentOfLayer(parent, layer, room), quadrant, out);
  }
  if ((flags & kFlagEmpty) != 0) {
    if (in.remaining() > 0) return makeError("byte {}: {} bytes too many", in.offset(), in.remaining());
    // What is between the parent's samples, and not coded, follows them.
    for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) interpolateOthers(s, out);
    return out;
  }
  const auto models = std::make_unique<SampleModels>();
  const OwnStates states = refinedStates((flags & kFlagClosed) != 0);
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) {
    const auto used = decodeLevel(payload.subspan(in.offset()), s, layer, states, scale, models.get(), out);
    if (!used.ok()) return makeError("at byte {}: {}", in.offset(), used.error().message);
    if (s > kLargestRefined && codesAnyOf(s, out, layer)) {
      return makeError("at byte {}: a sample of half-size {} that is not of the first layer", in.offset(), s);
    }
    TERRANE_TRY(in.skip(*used));
  }
  if (in.remaining() > 0) return makeError("byte {}: {} bytes too many", in.offset(), in.remaining());
  return out;
}

}  // namespace terrane
