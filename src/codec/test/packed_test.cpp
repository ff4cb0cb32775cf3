#include "terrane/codec/packed.h"

#include <gtest/gtest.h>

#include <random>

#include "made_ground.h"
#include "random_tiles.h"

namespace terrane {
namespace {

template <class T>
std::vector<uint8_t> packed(const T& value) {
  Packer packer;
  pack(packer, value);
  return packer.take();
}

/// Comes back as it was, byte for byte when packed again; cut short, or with a byte more, it is an error.
template <class T, class Unpack>
T travelled(const T& value, const Unpack& unpack, std::mt19937& random) {
  const std::vector<uint8_t> bytes = packed(value);
  Unpacker unpacker(bytes);
  T out = unpack(unpacker);
  EXPECT_TRUE(unpacker.status().ok()) << unpacker.status().error().message;
  EXPECT_EQ(packed(out), bytes);

  for (int i = 0; i < 60; ++i) {
    const size_t size =
        i < 40 ? std::min<size_t>(static_cast<size_t>(i), bytes.size() - 1) : random() % bytes.size();
    Unpacker cut(std::span<const uint8_t>(bytes).first(size));
    unpack(cut);
    EXPECT_FALSE(cut.status().ok()) << size << " of " << bytes.size();
  }
  std::vector<uint8_t> longer = bytes;
  longer.push_back(0);
  Unpacker more(longer);
  unpack(more);
  EXPECT_FALSE(more.status().ok());
  return out;
}

TEST(Packed, TilesOfAllCoverages) {
  std::mt19937 random(11);
  const ElevationScale scale{.heightStep = 0.25};
  int seen = 0;
  for (const double voidShare : {0.0, 0.3, 1.0}) {
    for (const bool isRoot : {true, false}) {
      RandomTileOptions options{.voidShare = voidShare, .interpolatedShare = 0.3};
      options.partialCoverage = voidShare == 0.0 && !isRoot;
      const Tile root = randomTile({}, nullptr, scale, options, random);
      const Tile tile = isRoot ? root : randomTile({1, 1, 0}, &root.samples, scale, options, random);
      seen |= 1 << static_cast<int>(tile.samples.coverage.kind);
      const Tile out = travelled(tile, unpackTile, random);
      EXPECT_EQ(out.samples.heights, tile.samples.heights);
      EXPECT_EQ(out.samples.states, tile.samples.states);
      EXPECT_EQ(out.samples.coverage.kind, tile.samples.coverage.kind);
      EXPECT_EQ(out.samples.coverage.bits, tile.samples.coverage.bits);
      EXPECT_EQ(out.nodes.error, tile.nodes.error);
      EXPECT_EQ(out.nodes.largeError, tile.nodes.largeError);
      EXPECT_EQ(out.nodes.low, tile.nodes.low);
      EXPECT_EQ(out.nodes.high, tile.nodes.high);

      // A quadrant suffices for whatever a child is made of.
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        Packer packer;
        packQuadrant(packer, tile.samples, quadrant);
        const std::vector<uint8_t> bytes = packer.take();
        Unpacker unpacker(bytes);
        const TileSamples part = unpackQuadrant(unpacker, quadrant);
        ASSERT_TRUE(unpacker.status().ok());
        const TileSamples a = interpolateSamples(part, quadrant),
                          b = interpolateSamples(tile.samples, quadrant);
        EXPECT_EQ(a.heights, b.heights);
        EXPECT_EQ(a.states, b.states);
        EXPECT_EQ(a.coverage.kind, b.coverage.kind);
        EXPECT_EQ(a.coverage.bits, b.coverage.bits);
        for (size_t size = 0; size < bytes.size(); size += 997) {
          Unpacker cut(std::span<const uint8_t>(bytes).first(size));
          unpackQuadrant(cut, quadrant);
          EXPECT_FALSE(cut.status().ok());
        }
      }
    }
  }
  EXPECT_EQ(seen, 7) << "none, full and partial";
}

TEST(Packed, LayersOfSignificance) {
  std::mt19937 random(14);
  const ElevationScale scale{.heightStep = 0.25};
  TileSamples samples = randomTile({}, nullptr, scale, {.voidShare = 0.1}, random).samples;
  samples.layerCount = 3;
  samples.layers.resize(kTileSampleCount);
  for (uint8_t& layer : samples.layers) layer = static_cast<uint8_t>(random() % 3);
  const TileSamples out = travelled(samples, unpackSamples, random);
  EXPECT_EQ(out.layerCount, samples.layerCount);
  EXPECT_EQ(out.layers, samples.layers);

  const auto packedQuadrant = [](const TileSamples& parent, int quadrant) {
    Packer packer;
    packQuadrant(packer, parent, quadrant);
    return packer.take();
  };
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const std::vector<uint8_t> bytes = packedQuadrant(samples, quadrant);
    Unpacker unpacker(bytes);
    const TileSamples part = unpackQuadrant(unpacker, quadrant);
    ASSERT_TRUE(unpacker.status().ok());
    EXPECT_EQ(part.layerCount, samples.layerCount);
    ASSERT_EQ(part.layers.size(), samples.layers.size());
    for (int y = 0; y <= kTileCells / 2; ++y)
      for (int x = 0; x <= kTileCells / 2; ++x) {
        const auto at = static_cast<size_t>((y + (quadrant >> 1) * kTileCells / 2) * kTileSamples + x +
                                            (quadrant & 1) * kTileCells / 2);
        ASSERT_EQ(part.layers[at], samples.layers[at]);
      }
    for (size_t size = 0; size < bytes.size(); size += 499) {
      Unpacker cut(std::span<const uint8_t>(bytes).first(size));
      unpackQuadrant(cut, quadrant);
      EXPECT_FALSE(cut.status().ok());
    }
  }

  // Layers that there are not, and too few of their numbers.
  const auto expectRefused = [&](const TileSamples& wrong) {
    const std::vector<uint8_t> whole = packed(wrong);
    Unpacker unpacker(whole);
    unpackSamples(unpacker);
    EXPECT_FALSE(unpacker.status().ok());
    if (wrong.layers.size() != kTileSampleCount) return;
    const std::vector<uint8_t> part = packedQuadrant(wrong, 3);
    Unpacker ofPart(part);
    unpackQuadrant(ofPart, 3);
    EXPECT_FALSE(ofPart.status().ok());
  };
  for (const int count : {-1, 0, ElevationScale::kMostLayers + 1}) {
    TileSamples wrong = samples;
    wrong.layerCount = count;
    expectRefused(wrong);
  }
  TileSamples wrong = samples;
  wrong.layers.back() = ElevationScale::kMostLayers;
  expectRefused(wrong);
  wrong = samples;
  wrong.layers.pop_back();
  expectRefused(wrong);
}

TEST(Packed, MeshLevels) {
  std::mt19937 random(12);
  for (unsigned kind = 0; kind < 5; ++kind) {
    const MadeGround ground(0, someGround(kind, random));
    const Tile tile = ground.tile({}, random, 10);
    MeshLevel before;
    for (int level = 0; level < 4; ++level) {
      MeshLevel meshes =
          makeMeshLevel({}, tile, level, level == 0 ? nullptr : &before, {.spacingMeters = 10.0}, {});
      const MeshLevel out = travelled(meshes, unpackMeshLevel, random);
      EXPECT_EQ(out.level, meshes.level);
      EXPECT_EQ(out.centerFalls, meshes.centerFalls);
      EXPECT_EQ(out.patches.size(), meshes.patches.size());
      EXPECT_EQ(out.indices, meshes.indices);
      EXPECT_EQ(out.extras, meshes.extras);
      EXPECT_EQ(out.chosen, meshes.chosen);
      EXPECT_EQ(out.relief.step, meshes.relief.step);
      EXPECT_EQ(out.relief.codes, meshes.relief.codes);

      // Patches that reach beyond what is there are refused.
      MeshLevel wrong = meshes;
      wrong.patches.back().firstVertex = static_cast<uint32_t>(wrong.vertices.size());
      const std::vector<uint8_t> bytes = packed(wrong);
      Unpacker unpacker(bytes);
      unpackMeshLevel(unpacker);
      EXPECT_FALSE(unpacker.status().ok());
      before = std::move(meshes);
    }
  }
}

TEST(Packed, PicturesAndMasks) {
  std::mt19937 random(13);
  ImageryTile picture;
  for (uint8_t& value : picture.rgba) value = static_cast<uint8_t>(random());
  EXPECT_EQ(travelled(picture, unpackPicture, random).rgba, picture.rgba);

  // A kind that there is not, and a mask of another size.
  for (const auto& [kind, size] : {std::pair<int, size_t>{3, 0}, {2, 10}, {1, Coverage::kBytes}}) {
    Coverage coverage{static_cast<Coverage::Kind>(kind), std::vector<uint8_t>(size)};
    const std::vector<uint8_t> bytes = packed(coverage);
    Unpacker unpacker(bytes);
    unpackCoverage(unpacker);
    EXPECT_FALSE(unpacker.status().ok()) << kind;
  }
}

}  // namespace
}  // namespace terrane
