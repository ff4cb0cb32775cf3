#include "terrane/codec/elevation_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>

#include "payload_check.h"
#include "random_tiles.h"
#include "resealed.h"

namespace terrane {
namespace {

constexpr TileId kRoot{0, 0, 0};

void expectSameBits(const std::vector<float>& a, const std::vector<float>& b, const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0) << what;
}

void expectSame(const Tile& a, const Tile& b, const std::string& what) {
  expectSameBits(a.samples.heights, b.samples.heights, what);
  EXPECT_TRUE(a.samples.states == b.samples.states) << what;
  EXPECT_EQ(a.samples.coverage.kind, b.samples.coverage.kind) << what;
  EXPECT_TRUE(a.samples.coverage.bits == b.samples.coverage.bits) << what;
  EXPECT_TRUE(a.nodes.error == b.nodes.error) << what;
  EXPECT_TRUE(a.nodes.largeError == b.nodes.largeError) << what;
  EXPECT_TRUE(a.nodes.low == b.nodes.low) << what;
  EXPECT_TRUE(a.nodes.high == b.nodes.high) << what;
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(a.children[i].state, b.children[i].state) << what;
    EXPECT_EQ(a.children[i].error, b.children[i].error) << what;
    EXPECT_EQ(a.children[i].low, b.children[i].low) << what;
    EXPECT_EQ(a.children[i].high, b.children[i].high) << what;
  }
}

/// A tile that is nothing but a plane of Interpolated samples between four coded corners.
Tile plainRoot() {
  std::mt19937 random(5);
  const ElevationScale scale{};
  Tile tile = randomTile(kRoot, nullptr, scale, {.interpolatedShare = 1.0}, random);
  tile.nodes.error.assign(tile.nodes.error.size(), 0);
  tile.nodes.low.assign(tile.nodes.low.size(), 3);
  tile.nodes.high.assign(tile.nodes.high.size(), 9);
  tile.children.fill({ChildState::Interpolated, 0, 3, 9});
  return tile;
}

/// FNV-1a over all that a tile holds.
uint64_t fingerprint(const Tile& tile) {
  uint64_t hash = 0xcbf29ce484222325ULL;
  const auto add = [&](const void* data, size_t size) {
    for (size_t i = 0; i < size; ++i) {
      hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3ULL;
    }
  };
  add(tile.samples.heights.data(), tile.samples.heights.size() * sizeof(float));
  add(tile.samples.states.data(), tile.samples.states.size());
  add(&tile.samples.coverage.kind, 1);
  add(tile.samples.coverage.bits.data(), tile.samples.coverage.bits.size());
  add(tile.nodes.error.data(), tile.nodes.error.size());
  add(tile.nodes.largeError.data(), tile.nodes.largeError.size());
  add(tile.nodes.low.data(), tile.nodes.low.size() * 2);
  add(tile.nodes.high.data(), tile.nodes.high.size() * 2);
  for (const ChildSummary& child : tile.children) {
    add(&child.state, 1);
    add(&child.error, 1);
    add(&child.low, 2);
    add(&child.high, 2);
  }
  return hash;
}

/// Bytes that version 4 wrote: a root tile and its south-eastern child, small, with every kind of segment.
std::vector<uint8_t> storedPayload(const std::string& name) {
  std::ifstream file(TERRANE_SOURCE_DIR "/src/codec/test/payloads-v4/" + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ElevationCodec, RandomTilesComeBackBitForBit) {
  const std::vector<RandomTileOptions> kinds = {
      {},
      {.voidShare = 0.3, .interpolatedShare = 0.3},
      {.voidShare = 1.0},
      {.interpolatedShare = 1.0},
      {.roughness = 0},
      {.roughness = 70000},
      {.roughness = 16000000, .startRange = 16000000},
      {.voidShare = 0.2, .partialCoverage = true},
  };
  for (uint32_t seed = 0; seed < 3; ++seed) {
    for (const double step : {1.0, 0.02, 1.0 / 3.0}) {
      for (size_t kind = 0; kind < kinds.size(); ++kind) {
        std::mt19937 random(seed * 100 + static_cast<uint32_t>(kind));
        const ElevationScale scale{.heightStep = step, .heightOffset = seed == 0 ? 0.0 : -37.5};
        const Tile root = randomTile(kRoot, nullptr, scale, kinds[kind], random);
        const auto rootBytes = encodeTile(root, nullptr, 0, scale);
        const auto rootAgain = decodeTile(rootBytes, nullptr, 0, scale);
        ASSERT_TRUE(rootAgain.ok()) << rootAgain.error().message;
        expectSame(root, *rootAgain, fmt::format("root, seed {}, kind {}", seed, kind));

        const int quadrant = static_cast<int>(random() % 4);
        const TileId id = kRoot.child(quadrant);
        const Tile child = randomTile(id, &root.samples, scale, kinds[(kind + seed) % kinds.size()], random);
        const auto childBytes = encodeTile(child, &root.samples, quadrant, scale);
        const auto childAgain = decodeTile(childBytes, &rootAgain->samples, quadrant, scale);
        ASSERT_TRUE(childAgain.ok()) << childAgain.error().message;
        expectSame(child, *childAgain, fmt::format("child, seed {}, kind {}", seed, kind));
      }
    }
  }
}

TEST(ElevationCodec, InterpolatedSamplesFollowTheLattice) {
  for (uint32_t seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    const ElevationScale scale{.heightStep = 0.1};
    Tile parent = randomTile(kRoot, nullptr, scale, {.voidShare = 0.2, .interpolatedShare = 0.1}, random);
    // Single samples too, not only blocks.
    for (SampleState& state : parent.samples.states) {
      if (random() % 7 == 0) state = SampleState::Void;
    }
    const int quadrant = static_cast<int>(seed);
    const TileId id = kRoot.child(quadrant);
    const TileSamples child = interpolateSamples(parent.samples, quadrant);

    const auto at = [&](int x, int y) { return static_cast<size_t>(y * kTileSamples + x); };
    const auto isVoid = [&](int x, int y) { return child.states[at(x, y)] == SampleState::Void; };
    for (int y = 0; y < kTileSamples; y += 2) {
      for (int x = 0; x < kTileSamples; x += 2) {
        const size_t from = at((quadrant & 1) * 128 + x / 2, (quadrant >> 1) * 128 + y / 2);
        ASSERT_EQ(child.heights[at(x, y)], parent.samples.heights[from]);
        ASSERT_EQ(child.states[at(x, y)], parent.samples.states[from]);
      }
    }
    const Lattice lattice(1);
    for (const Diamond& d : ownDiamonds(id)) {
      const auto ends = lattice.hypotenuse(d);
      const int left = id.col * kTileCells;
      const int top = id.row * kTileCells;
      const float mean = (child.heights[at(ends[0].x - left, ends[0].y - top)] +
                          child.heights[at(ends[1].x - left, ends[1].y - top)]) *
                         0.5F;
      const int x = d.x - left;
      const int y = d.y - top;
      ASSERT_EQ(child.heights[at(x, y)], mean) << x << ", " << y;
      bool expectVoid =
          isVoid(ends[0].x - left, ends[0].y - top) || isVoid(ends[1].x - left, ends[1].y - top);
      if (d.isQuadCenter()) {
        expectVoid =
            isVoid(x - 1, y - 1) || isVoid(x + 1, y - 1) || isVoid(x - 1, y + 1) || isVoid(x + 1, y + 1);
      }
      ASSERT_EQ(isVoid(x, y), expectVoid) << x << ", " << y;
      ASSERT_NE(child.states[at(x, y)], SampleState::Coded);
    }
    for (int row = 0; row < kTileCells; ++row) {
      for (int col = 0; col < kTileCells; ++col) {
        ASSERT_EQ(
            child.coverage.covered(col, row),
            parent.samples.coverage.covered((quadrant & 1) * 128 + col / 2, (quadrant >> 1) * 128 + row / 2));
      }
    }
  }
}

TEST(ElevationCodec, UniformQuadrantsOfPartialCoverageAreUniform) {
  Tile parent = plainRoot();
  parent.samples.coverage = {Coverage::Kind::Partial, std::vector<uint8_t>(Coverage::kBytes, 0)};
  for (int row = 0; row < 128; ++row) {
    for (int byte = 0; byte < 16; ++byte)
      parent.samples.coverage.bits[static_cast<size_t>(row * 32 + byte)] = 255;
  }
  parent.samples.coverage.bits[static_cast<size_t>(200 * 32)] = 1;
  EXPECT_EQ(interpolateSamples(parent.samples, 0).coverage.kind, Coverage::Kind::Full);
  EXPECT_EQ(interpolateSamples(parent.samples, 1).coverage.kind, Coverage::Kind::None);
  EXPECT_EQ(interpolateSamples(parent.samples, 2).coverage.kind, Coverage::Kind::Partial);
  EXPECT_TRUE(interpolateSamples(parent.samples, 3).coverage.bits.empty());
}

TEST(ElevationCodec, TilesThatAreNotStoredAreWhole) {
  Tile parent = plainRoot();
  parent.children[1] = {ChildState::Interpolated, 0, 12, 34};
  parent.children[2] = {ChildState::Void, 0, 65535, 0};
  const Tile plain = interpolateTile(parent, 1);
  EXPECT_EQ(plain.samples.coverage.kind, Coverage::Kind::Full);
  EXPECT_EQ(plain.nodes.error, std::vector<uint8_t>(400, 0));
  EXPECT_EQ(plain.nodes.low, std::vector<uint16_t>(400, 12));
  EXPECT_EQ(plain.nodes.high, std::vector<uint16_t>(400, 34));
  // And so on below it.
  const Tile below = interpolateTile(plain, 3);
  EXPECT_EQ(below.nodes.high, plain.nodes.high);
  expectSameBits(below.samples.heights, interpolateSamples(plain.samples, 3).heights, "two levels below");

  const Tile hole = interpolateTile(parent, 2);
  EXPECT_EQ(hole.samples.coverage.kind, Coverage::Kind::None);
  EXPECT_EQ(hole.samples.states, std::vector<SampleState>(kTileSampleCount, SampleState::Void));
  EXPECT_EQ(hole.children[0].state, ChildState::Void);
}

TEST(ElevationCodec, NeighboursAgreeOnTheirBorderBitForBit) {
  std::mt19937 random(11);
  const ElevationScale scale{.heightStep = 0.07, .heightOffset = 3.0};
  const Tile root = randomTile(kRoot, nullptr, scale, {.voidShare = 0.2, .interpolatedShare = 0.2}, random);
  const Tile west = randomTile(kRoot.child(0), &root.samples, scale, {.interpolatedShare = 0.3}, random);
  Tile east = randomTile(kRoot.child(1), &root.samples, scale, {.voidShare = 0.3}, random);

  // The east tile gets the west border; nothing else in it hangs on samples that are new at this level.
  const auto at = [](int x, int y) { return static_cast<size_t>(y * kTileSamples + x); };
  for (int y = 0; y < kTileSamples; ++y) {
    east.samples.heights[at(0, y)] = west.samples.heights[at(256, y)];
    east.samples.states[at(0, y)] = west.samples.states[at(256, y)];
  }
  const auto decodedWest = decodeTile(encodeTile(west, &root.samples, 0, scale), &root.samples, 0, scale);
  const auto decodedEast = decodeTile(encodeTile(east, &root.samples, 1, scale), &root.samples, 1, scale);
  ASSERT_TRUE(decodedWest.ok() && decodedEast.ok());
  for (int y = 0; y < kTileSamples; ++y) {
    EXPECT_EQ(decodedWest->samples.heights[at(256, y)], decodedEast->samples.heights[at(0, y)]) << y;
    EXPECT_EQ(decodedWest->samples.states[at(256, y)], decodedEast->samples.states[at(0, y)]) << y;
  }
}

TEST(ElevationCodec, EveryTruncatedLengthIsAnErrorThatNamesAByte) {
  const ElevationScale scale{};
  const auto root = decodeTile(storedPayload("root"), nullptr, 0, scale);
  ASSERT_TRUE(root.ok());
  for (const bool asRoot : {true, false}) {
    const TileSamples* parent = asRoot ? nullptr : &root->samples;
    const auto bytes = storedPayload(asRoot ? "root" : "child");
    for (size_t length = 0; length < bytes.size(); ++length) {
      // A copy of its own, so that AddressSanitizer sees the first byte beyond.
      const std::vector<uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      for (const auto& payload : {cut, resealed(cut)}) {
        const auto result = decodeTile(payload, parent, 3, scale);
        ASSERT_FALSE(result.ok()) << length;
        ASSERT_NE(result.error().message.find("byte "), std::string::npos) << result.error().message;
      }
    }
    auto longer = bytes;
    longer.push_back(0);
    ASSERT_FALSE(decodeTile(longer, parent, 3, scale).ok());
    ASSERT_FALSE(decodeTile(resealed(longer), parent, 3, scale).ok());
  }
}

TEST(ElevationCodec, ChangedBytesNeverCrash) {
  std::mt19937 random(31);
  const ElevationScale scale{};
  const auto root = decodeTile(storedPayload("root"), nullptr, 0, scale);
  ASSERT_TRUE(root.ok());
  for (const bool asRoot : {true, false}) {
    const TileSamples* parent = asRoot ? nullptr : &root->samples;
    const auto bytes = storedPayload(asRoot ? "root" : "child");
    ASSERT_GT(bytes.size(), 100U);
    // Every byte of the head and of the first segment's beginning, some of the others.
    for (size_t at = 0; at < bytes.size(); at += at < 100 ? 1 : 1 + random() % 7) {
      auto changed = bytes;
      changed[at] ^= static_cast<uint8_t>(1 + random() % 255);
      ASSERT_FALSE(decodeTile(changed, parent, 3, scale).ok()) << at;
      const auto result = decodeTile(resealed(changed), parent, 3, scale);
      if (!result.ok()) {
        ASSERT_NE(result.error().message.find("byte "), std::string::npos);
        continue;
      }
      ASSERT_EQ(result->samples.heights.size(), static_cast<size_t>(kTileSampleCount));
      const auto isFinite = [](float height) { return std::isfinite(height); };
      ASSERT_TRUE(std::all_of(result->samples.heights.begin(), result->samples.heights.end(), isFinite));
    }
  }
}

TEST(ElevationCodec, ContradictionsAreErrors) {
  const ElevationScale scale{};
  const Tile root = plainRoot();
  const auto bytes = encodeTile(root, nullptr, 0, scale);
  const auto errorAfter = [&](size_t byte, uint8_t value) {
    auto changed = bytes;
    changed[byte] = value;
    const auto result = decodeTile(resealed(changed), nullptr, 0, scale);
    return result.ok() ? std::string("no error") : result.error().message;
  };
  EXPECT_NE(errorAfter(0, 5).find("update Terrane"), std::string::npos);
  EXPECT_NE(errorAfter(0, 3).find("build the dataset again"), std::string::npos);
  EXPECT_NE(errorAfter(0, 1).find("build the dataset again"), std::string::npos);
  EXPECT_NE(errorAfter(0, 0).find("version 0"), std::string::npos);
  EXPECT_NE(errorAfter(3, 0x81).find("unknown flags"), std::string::npos);
  EXPECT_NE(errorAfter(3, static_cast<uint8_t>(bytes[3] & ~1)).find("not a root"), std::string::npos);
  EXPECT_NE(errorAfter(4, 16).find("byte 4"), std::string::npos);
  EXPECT_NE(errorAfter(5, 0xff).find("unknown state"), std::string::npos);
  EXPECT_NE(errorAfter(6, 1).find("error code"), std::string::npos);
  EXPECT_NE(errorAfter(7, 200).find("above its high"), std::string::npos);
  EXPECT_FALSE(decodeTile(bytes, &root.samples, 0, scale).ok());

  // A height beyond 2^24 steps: the same residuals on a parent that is already at the edge.
  std::mt19937 random(41);
  Tile high = plainRoot();
  const Tile low = plainRoot();
  std::fill(high.samples.heights.begin(), high.samples.heights.end(), scale.heightFromInteger(16777215));
  const Tile child = randomTile(kRoot.child(0), &low.samples, scale, {.roughness = 40}, random);
  const auto result = decodeTile(encodeTile(child, &low.samples, 0, scale), &high.samples, 0, scale);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("2^24"), std::string::npos);
}

// They must decode to the same tile for as long as version 4 is read.
TEST(ElevationCodec, StoredPayloadsOfVersion4DecodeAsEver) {
  const ElevationScale scale{};
  const auto root = decodeTile(storedPayload("root"), nullptr, 0, scale);
  ASSERT_TRUE(root.ok()) << root.error().message;
  EXPECT_EQ(fingerprint(*root), 720188364450808731ULL);
  const auto child = decodeTile(storedPayload("child"), &root->samples, 3, scale);
  ASSERT_TRUE(child.ok()) << child.error().message;
  EXPECT_EQ(fingerprint(*child), 9872784697156144357ULL);
}

// Of made-up ground under a bound, with Coded samples among Interpolated ones.
TEST(ElevationCodec, StoredSparsePayloadsOfVersion4DecodeAsEver) {
  const ElevationScale scale{
      .heightStep = 18.75, .errorUnit = 0.29296875, .rangeUnit = 18.75, .sampleError = 15.0};
  const auto root = decodeTile(storedPayload("sparse_root"), nullptr, 0, scale);
  ASSERT_TRUE(root.ok()) << root.error().message;
  EXPECT_EQ(fingerprint(*root), 7634408267213693620ULL);
  const auto child = decodeTile(storedPayload("sparse_child"), &root->samples, 3, scale);
  ASSERT_TRUE(child.ok()) << child.error().message;
  EXPECT_EQ(fingerprint(*child), 16238760352350643820ULL);
  // They are what is written, too.
  EXPECT_EQ(encodeTile(*root, nullptr, 0, scale), storedPayload("sparse_root"));
  EXPECT_EQ(encodeTile(*child, &root->samples, 3, scale), storedPayload("sparse_child"));
}

TEST(ElevationCodec, NothingIsLeftOfARecycledTile) {
  const ElevationScale scale{};
  const std::vector<RandomTileOptions> kinds = {
      {}, {.voidShare = 0.3, .interpolatedShare = 0.3}, {.voidShare = 1.0}, {.interpolatedShare = 1.0}};
  for (size_t kind = 0; kind < kinds.size(); ++kind) {
    std::mt19937 random(static_cast<uint32_t>(kind));
    const Tile root = randomTile(kRoot, nullptr, scale, kinds[kind], random);
    const Tile child = randomTile(kRoot.child(2), &root.samples, scale, kinds[kind], random);
    const auto bytes = encodeTile(child, &root.samples, 2, scale);
    // A tile of another shape, of nothing sensible.
    Tile recycled = root;
    std::fill(recycled.samples.heights.begin(), recycled.samples.heights.end(),
              std::numeric_limits<float>::quiet_NaN());
    recycled.nodes.error.assign(7, 255);
    recycled.nodes.largeError.assign(999, 255);
    const auto again = decodeTile(bytes, &root.samples, 2, scale, std::move(recycled));
    ASSERT_TRUE(again.ok()) << again.error().message;
    expectSame(child, *again, fmt::format("kind {}", kind));
  }
}

TEST(ElevationCodec, BytesThatNobodySealedAreRefused) {
  const auto bytes = storedPayload("root");
  for (const size_t at : {kCheckOffset, kCheckOffset + 1, kCheckedFrom, bytes.size() - 1}) {
    auto changed = bytes;
    changed[at] ^= 1;
    const auto result = decodeTile(changed, nullptr, 0, {});
    ASSERT_FALSE(result.ok());
    EXPECT_NE(result.error().message.find("damaged"), std::string::npos) << result.error().message;
  }
}

TEST(RootBeginning, IsTheTileFromAfar) {
  for (const RandomTileOptions& kind :
       {RandomTileOptions{.roughness = 4}, RandomTileOptions{.voidShare = 0.2, .partialCoverage = true},
        RandomTileOptions{.voidShare = 0.2, .interpolatedShare = 0.4}}) {
    std::mt19937 random(3);
    const ElevationScale scale{.heightStep = 0.5};
    const Tile whole = randomTile(kRoot, nullptr, scale, kind, random);
    const auto bytes = encodeTile(whole, nullptr, 0, scale);
    int levelsBefore = 0;
    bool failedBefore = true;
    for (size_t length = 0; length <= bytes.size(); length += 1 + length / 50) {
      const std::vector<uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      const auto tile = decodeRootBeginning(cut, scale);
      if (!tile.ok()) {
        ASSERT_TRUE(failedBefore) << length;
        ASSERT_NE(tile.error().message.find("byte "), std::string::npos) << tile.error().message;
        continue;
      }
      failedBefore = false;
      // Some levels are the tile's own, all the rest interpolated.
      int s = kTileCells;
      const auto isOwn = [&](int spacing) {
        for (int y = 0; y < kTileSamples; y += spacing)
          for (int x = 0; x < kTileSamples; x += spacing) {
            const auto at = static_cast<size_t>(y * kTileSamples + x);
            if (tile->samples.heights[at] != whole.samples.heights[at]) return false;
            if (tile->samples.states[at] != whole.samples.states[at]) return false;
          }
        return true;
      };
      int levels = 0;
      while (s >= 1 && isOwn(s)) ++levels, s /= 2;
      ASSERT_GE(levels, 5) << length;
      ASSERT_GE(levels, levelsBefore) << length;
      levelsBefore = levels;
      ASSERT_EQ(tile->children[2].state, whole.children[2].state);
      // Claims about nodes hold whatever the rest of the payload says.
      ASSERT_EQ(tile->nodes.error.size(), whole.nodes.error.size());
      ASSERT_EQ(tile->nodes.largeError.size(), whole.nodes.largeError.size());
      for (int i = 1; i < kNodeLevels; ++i)
        ASSERT_GT(tile->nodes.error[static_cast<size_t>(nodeOffset(i - 1, true))],
                  tile->nodes.error[static_cast<size_t>(nodeOffset(i, true))]);
    }
    EXPECT_EQ(levelsBefore, 9);
  }
}

TEST(RootBeginning, ChangedBytesNeverCrash) {
  std::mt19937 random(7);
  const auto bytes = storedPayload("root");
  for (size_t at = 0; at < bytes.size(); at += at < 100 ? 1 : 1 + random() % 7) {
    auto changed = bytes;
    changed[at] ^= static_cast<uint8_t>(1 + random() % 255);
    changed.resize(bytes.size() / 2 + random() % (bytes.size() / 2));
    const auto tile = decodeRootBeginning(changed, {});
    if (!tile.ok()) continue;
    const auto isFinite = [](float height) { return std::isfinite(height); };
    ASSERT_TRUE(std::all_of(tile->samples.heights.begin(), tile->samples.heights.end(), isFinite));
  }
}

}  // namespace
}  // namespace terrane
