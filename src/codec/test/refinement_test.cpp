#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numeric>
#include <string>

#include "payload_check.h"
#include "random_tiles.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {
namespace {

constexpr TileId kRootTile{0, 0, 0};
constexpr int kLayers = 3;

ElevationScale scaleOfLayers() {
  ElevationScale scale;
  scale.heightStep = 0.37;
  scale.heightOffset = 812.4;
  scale.layerCount = kLayers;
  scale.layerErrors = {16.0, 4.0};
  scale.sampleError = 1.0;
  return scale;
}

/// Divides a tile's own samples into layers: at random, or so that what is coded has its parents coded.
void divide(TileId id, const TileSamples* parent, bool closed, TileSamples& samples, std::mt19937& random) {
  const Lattice lattice(id.level);
  samples.layerCount = kLayers;
  samples.layers.assign(kTileSampleCount, 0);
  if (parent != nullptr) {
    for (int y = 0; y < kTileSamples; y += 2)
      for (int x = 0; x < kTileSamples; x += 2)
        samples.layers[static_cast<size_t>(y * kTileSamples + x)] = parent->layers[static_cast<size_t>(
            ((id.row & 1) * kTileCells / 2 + y / 2) * kTileSamples + (id.col & 1) * kTileCells / 2 + x / 2)];
  }
  const auto indexOf = [&](LatticePoint p) {
    const int x = p.x - id.col * kTileCells, y = p.y - id.row * kTileCells;
    const bool isInside = x >= 0 && y >= 0 && x < kTileSamples && y < kTileSamples;
    return isInside ? y * kTileSamples + x : -1;
  };
  for (const Diamond& d : ownDiamonds(id)) {
    const auto at = static_cast<size_t>(indexOf(d.center()));
    const int size = std::min({std::countr_zero(static_cast<unsigned>(at % kTileSamples) | 256U),
                               std::countr_zero(static_cast<unsigned>(at / kTileSamples) | 256U)});
    if (id.isRoot() && size >= 3) continue;
    int layer = static_cast<int>(random() % kLayers);
    if (closed) {
      for (const LatticePoint apex : lattice.apexes(d))
        if (const int above = indexOf(apex);
            above >= 0 && samples.states[static_cast<size_t>(above)] == SampleState::Coded)
          layer = std::max(layer, samples.layerAt(static_cast<size_t>(above)));
    }
    samples.layers[at] = static_cast<uint8_t>(layer);
  }
}

void expectSame(const TileSamples& a, const TileSamples& b, const std::string& what) {
  ASSERT_EQ(a.heights.size(), b.heights.size()) << what;
  EXPECT_EQ(std::memcmp(a.heights.data(), b.heights.data(), a.heights.size() * sizeof(float)), 0) << what;
  EXPECT_TRUE(a.states == b.states) << what;
  EXPECT_EQ(a.layerCount, b.layerCount) << what;
  EXPECT_EQ(a.coverage.kind, b.coverage.kind) << what;
  EXPECT_TRUE(a.coverage.bits == b.coverage.bits) << what;
  size_t others = 0;
  for (size_t i = 0; i < a.states.size(); ++i)
    others += a.states[i] == SampleState::Coded && a.layerAt(i) != b.layerAt(i) ? 1 : 0;
  EXPECT_EQ(others, 0U) << what;
}

/// All layers of a tile, from their payloads.
Result<Tile> decodeAll(const std::vector<std::vector<uint8_t>>& payloads, const TileSamples* parent,
                       int quadrant, const ElevationScale& scale) {
  TERRANE_ASSIGN(Tile tile, decodeTile(payloads[0], parent, quadrant, scale));
  for (size_t i = 1; i < payloads.size(); ++i) {
    TERRANE_ASSIGN(tile.samples, refineTile(payloads[i], tile.samples, parent, quadrant, scale));
  }
  return tile;
}
std::vector<std::vector<uint8_t>> encodeAll(const Tile& tile, const TileSamples* parent, int quadrant,
                                            const ElevationScale& scale) {
  std::vector<std::vector<uint8_t>> out = {encodeTile(tile, parent, quadrant, scale)};
  for (int layer = 1; layer < kLayers; ++layer)
    out.push_back(encodeRefinement(tile.samples, parent, quadrant, layer, scale));
  return out;
}

struct Case {
  RandomTileOptions options;
  bool closed = false;
};

class Refinement : public testing::TestWithParam<Case> {};

TEST_P(Refinement, BringsBackEveryLayerOfEveryTile) {
  std::mt19937 random(41);
  const ElevationScale scale = scaleOfLayers();
  for (int round = 0; round < 3; ++round) {
    Tile root = randomTile(kRootTile, nullptr, scale, GetParam().options, random);
    divide(kRootTile, nullptr, GetParam().closed, root.samples, random);
    const auto rootPayloads = encodeAll(root, nullptr, 0, scale);
    const auto decodedRoot = decodeAll(rootPayloads, nullptr, 0, scale);
    ASSERT_TRUE(decodedRoot.ok()) << decodedRoot.error().message;
    expectSame(root.samples, decodedRoot->samples, "root");

    const TileId child{1, round % 2, round / 2};
    Tile tile = randomTile(child, &root.samples, scale, GetParam().options, random);
    divide(child, &root.samples, GetParam().closed, tile.samples, random);
    const auto payloads = encodeAll(tile, &root.samples, child.quadrant(), scale);
    const auto decoded = decodeAll(payloads, &decodedRoot->samples, child.quadrant(), scale);
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    expectSame(tile.samples, decoded->samples, "child");
    EXPECT_TRUE(tile.nodes.error == decoded->nodes.error);

    // Each layer by itself, below a parent that has just as many, or more.
    for (int layer = 0; layer < kLayers; ++layer) {
      const TileSamples above = samplesOfLayer(decodedRoot->samples, layer);
      auto some = decodeTile(payloads[0], &above, child.quadrant(), scale);
      ASSERT_TRUE(some.ok()) << some.error().message;
      for (int i = 1; i <= layer; ++i) {
        auto more =
            refineTile(payloads[static_cast<size_t>(i)], some->samples, &above, child.quadrant(), scale);
        ASSERT_TRUE(more.ok()) << more.error().message;
        some->samples = std::move(*more);
      }
      expectSame(some->samples, samplesOfLayer(tile.samples, layer), "layer " + std::to_string(layer));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Ground, Refinement,
    testing::Values(Case{{}, false}, Case{{}, true}, Case{{.interpolatedShare = 0.5}, false},
                    Case{{.interpolatedShare = 0.9}, true}, Case{{.voidShare = 0.3}, true},
                    Case{{.voidShare = 0.3, .interpolatedShare = 0.4, .partialCoverage = true}, false},
                    Case{{.voidShare = 1.0}, false}, Case{{.interpolatedShare = 1.0}, true},
                    Case{{.roughness = 300000, .startRange = 9000000}, true}));

TEST(RefinementBytes, WhereNothingIsAddedThereAreFour) {
  std::mt19937 random(7);
  const ElevationScale scale = scaleOfLayers();
  Tile root = randomTile(kRootTile, nullptr, scale, {}, random);
  root.samples.layerCount = kLayers;
  root.samples.layers.assign(kTileSampleCount, 0);
  EXPECT_EQ(encodeRefinement(root.samples, nullptr, 0, 1, scale).size(), 4U);
}

TEST(RefinementBytes, DamagedOnesAreRefused) {
  std::mt19937 random(11);
  const ElevationScale scale = scaleOfLayers();
  Tile root = randomTile(kRootTile, nullptr, scale, {.interpolatedShare = 0.3}, random);
  divide(kRootTile, nullptr, true, root.samples, random);
  const TileSamples before = samplesOfLayer(root.samples, 0);
  const std::vector<uint8_t> payload = encodeRefinement(root.samples, nullptr, 0, 1, scale);
  for (size_t size = 0; size < payload.size(); size += 1 + size / 9) {
    std::vector<uint8_t> cut(payload.begin(), payload.begin() + static_cast<ptrdiff_t>(size));
    EXPECT_FALSE(refineTile(cut, before, nullptr, 0, scale).ok()) << size;
    if (size < 4) continue;
    sealPayload(cut);
    EXPECT_FALSE(refineTile(cut, before, nullptr, 0, scale).ok()) << size;
  }
  // With a check that is right, another byte is refused, or is another tile's; never a crash.
  for (size_t at = 3; at < payload.size(); at += 1 + at / 20) {
    std::vector<uint8_t> other = payload;
    other[at] = static_cast<uint8_t>(other[at] ^ (1U << random() % 8));
    EXPECT_FALSE(refineTile(other, before, nullptr, 0, scale).ok()) << at;
    sealPayload(other);
    const auto decoded = refineTile(other, before, nullptr, 0, scale);
    if (!decoded.ok()) continue;
    size_t moved = 0;
    for (size_t i = 0; i < before.states.size(); ++i)
      moved += before.states[i] == SampleState::Coded && decoded->heights[i] != before.heights[i] ? 1 : 0;
    EXPECT_EQ(moved, 0U);
  }
  // Another place in the world, and a layer that there is not.
  const auto misplaced = refineTile(payload, before, &root.samples, 2, scale);
  ASSERT_FALSE(misplaced.ok());
  ElevationScale single = scale;
  single.layerCount = 1;
  EXPECT_FALSE(refineTile(payload, before, nullptr, 0, single).ok());
}

/// Bytes that version 1 wrote, those of the first layer among them.
std::vector<std::vector<uint8_t>> storedPayloads(const std::string& tile) {
  std::vector<std::vector<uint8_t>> out;
  for (int layer = 0; layer < kLayers; ++layer) {
    std::ifstream file(TERRANE_SOURCE_DIR "/src/codec/test/refinements-v1/" + tile + std::to_string(layer),
                       std::ios::binary);
    out.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return out;
}

uint64_t fingerprint(const TileSamples& samples) {
  uint64_t hash = 0xcbf29ce484222325ULL;
  const auto add = [&](const void* bytes, size_t count) {
    for (size_t i = 0; i < count; ++i)
      hash = (hash ^ static_cast<const uint8_t*>(bytes)[i]) * 0x100000001b3ULL;
  };
  for (size_t i = 0; i < samples.states.size(); ++i) {
    const int layer = samples.states[i] == SampleState::Coded ? samples.layerAt(i) : 0;
    add(&samples.heights[i], sizeof(float));
    add(&samples.states[i], 1);
    add(&layer, 1);
  }
  return hash;
}

// They must be the same tiles for as long as version 1 is read, and are what is written. The root is closed
// in its later layers, the child is not; both have samples of all states.
TEST(RefinementBytes, StoredOnesOfVersion1DecodeAsEver) {
  const ElevationScale scale = scaleOfLayers();
  const auto rootPayloads = storedPayloads("root");
  EXPECT_EQ(rootPayloads[2][3], 3) << "root, closed";
  const auto root = decodeAll(rootPayloads, nullptr, 0, scale);
  ASSERT_TRUE(root.ok()) << root.error().message;
  EXPECT_EQ(fingerprint(root->samples), 7131721703165733389ULL);
  EXPECT_EQ(encodeAll(*root, nullptr, 0, scale), rootPayloads);

  const auto childPayloads = storedPayloads("child");
  EXPECT_EQ(childPayloads[2][3], 0);
  const auto child = decodeAll(childPayloads, &root->samples, 3, scale);
  ASSERT_TRUE(child.ok()) << child.error().message;
  EXPECT_EQ(fingerprint(child->samples), 6925536361504691326ULL);
  EXPECT_EQ(encodeAll(*child, &root->samples, 3, scale), childPayloads);
  for (const Tile* tile : {&*root, &*child}) {
    std::array<std::array<int, kLayers>, 3> counts{};
    for (size_t i = 0; i < kTileSampleCount; ++i)
      ++counts[static_cast<size_t>(tile->samples.states[i])][static_cast<size_t>(tile->samples.layerAt(i))];
    for (const int count : counts[static_cast<size_t>(SampleState::Coded)]) EXPECT_GT(count, 100);
    EXPECT_GT(counts[0][0], 100);
  }
}

TEST(RefinementBytes, WhatTheLayersBeforeContradictIsRefused) {
  const ElevationScale scale = scaleOfLayers();
  const auto root = decodeAll(storedPayloads("root"), nullptr, 0, scale);
  ASSERT_TRUE(root.ok());
  auto payloads = storedPayloads("child");
  // As if it were closed: then some samples that are Coded before would not be asked about.
  payloads[1][3] = 2;
  sealPayload(payloads[1]);
  const auto child = decodeAll(payloads, &root->samples, 3, scale);
  ASSERT_FALSE(child.ok());
  EXPECT_NE(child.error().message.find("damaged"), std::string::npos) << child.error().message;
}

TEST(RefinementBytes, WhatOnlyTheFirstLayerMayCodeIsRefused) {
  std::mt19937 random(3);
  const ElevationScale scale = scaleOfLayers();
  Tile root = randomTile(kRootTile, nullptr, scale, {}, random);
  divide(kRootTile, nullptr, false, root.samples, random);
  root.samples.layers[64 * kTileSamples + 64] = 1;
  TileSamples before = samplesOfLayer(root.samples, 0);
  before.states[64 * kTileSamples + 64] = SampleState::Interpolated;
  const auto refined =
      refineTile(encodeRefinement(root.samples, nullptr, 0, 1, scale), before, nullptr, 0, scale);
  ASSERT_FALSE(refined.ok());
  EXPECT_NE(refined.error().message.find("half-size 64"), std::string::npos) << refined.error().message;
}

}  // namespace
}  // namespace terrane
