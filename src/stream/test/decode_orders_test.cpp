#include "terrane/stream/decode_orders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "terrane/codec/elevation_codec.h"

namespace terrane {
namespace {

const ElevationScale kScale{.heightStep = 0.5};

/// Hills over the whole tile; with a void lake if asked for.
Tile rootTile(bool hasVoid) {
  Tile tile;
  tile.samples.heights.resize(kTileSampleCount);
  tile.samples.states.assign(kTileSampleCount, SampleState::Coded);
  for (int y = 0; y < kTileSamples; ++y)
    for (int x = 0; x < kTileSamples; ++x)
      tile.samples.heights[static_cast<size_t>(y * kTileSamples + x)] =
          kScale.heightFromInteger((x * x + 3 * y * y) / 200 + (x * y) % 7);
  tile.samples.coverage.kind = Coverage::Kind::Full;
  if (hasVoid) {
    tile.samples.coverage.kind = Coverage::Kind::Partial;
    tile.samples.coverage.bits.assign(Coverage::kBytes, 255);
    for (size_t i = 1000; i < 3000; ++i) tile.samples.coverage.bits[i] = 0x3C;
  }
  tile.nodes.error.assign(static_cast<size_t>(tileNodeCount(true)), 7);
  tile.nodes.largeError.assign(static_cast<size_t>(tileLargeNodeCount(true)), 9);
  tile.nodes.low.assign(static_cast<size_t>(tileNodeCount(true)), 100);
  tile.nodes.high.assign(static_cast<size_t>(tileNodeCount(true)), 200);
  for (ChildSummary& child : tile.children) child = {ChildState::Interpolated, 0, 100, 200};
  return tile;
}

/// A child that has a height of its own at every place that its parent does not give.
Tile childTile(const Tile& parent, int quadrant) {
  Tile tile = interpolateTile(parent, quadrant);
  for (int y = 0; y < kTileSamples; ++y)
    for (int x = 0; x < kTileSamples; ++x) {
      if (x % 2 == 0 && y % 2 == 0) continue;
      const auto i = static_cast<size_t>(y * kTileSamples + x);
      tile.samples.states[i] = SampleState::Coded;
      tile.samples.heights[i] = kScale.heightFromInteger((x + 2 * y + quadrant) % 50);
    }
  return tile;
}

void expectSame(const TileSamples& a, const TileSamples& b) {
  EXPECT_EQ(a.heights, b.heights);
  EXPECT_EQ(a.states, b.states);
  EXPECT_EQ(a.coverage.kind, b.coverage.kind);
  EXPECT_EQ(a.coverage.bits, b.coverage.bits);
  EXPECT_EQ(a.layerCount, b.layerCount);
  EXPECT_EQ(a.layers, b.layers);
}
void expectSame(const Result<TileSamples>& a, const Result<TileSamples>& b) {
  ASSERT_EQ(a.ok(), b.ok());
  if (a.ok())
    expectSame(*a, *b);
  else
    EXPECT_EQ(a.error().message, b.error().message);
}
void expectSame(const Result<Tile>& a, const Result<Tile>& b) {
  ASSERT_EQ(a.ok(), b.ok());
  if (!a.ok()) {
    EXPECT_EQ(a.error().message, b.error().message);
    return;
  }
  expectSame(a->samples, b->samples);
  EXPECT_EQ(a->nodes.error, b->nodes.error);
  EXPECT_EQ(a->nodes.largeError, b->nodes.largeError);
  EXPECT_EQ(a->nodes.low, b->nodes.low);
  EXPECT_EQ(a->nodes.high, b->nodes.high);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(a->children[i].state, b->children[i].state);
    EXPECT_EQ(a->children[i].error, b->children[i].error);
    EXPECT_EQ(a->children[i].low, b->children[i].low);
    EXPECT_EQ(a->children[i].high, b->children[i].high);
  }
}
void expectSame(const Result<ImageryTile>& a, const Result<ImageryTile>& b) {
  ASSERT_EQ(a.ok(), b.ok());
  if (a.ok())
    EXPECT_EQ(a->rgba, b->rgba);
  else
    EXPECT_EQ(a.error().message, b.error().message);
}

/// The order gives the same answer here as in another memory; bytes that are cut short are errors on both
/// ways.
template <class Order>
void expectToTravel(const Order& order) {
  bool isTaken = false;
  const auto take = [&](typename Order::Answer answer) {
    isTaken = true;
    expectSame(answer, order.run());
  };
  OrderedWork<Order, decltype(take)> work(order, take);
  Packer sent, answer;
  work.pack(sent);
  const Status ran = runPacked<Order>(sent.bytes(), answer);
  ASSERT_TRUE(ran.ok()) << ran.error().message;
  ASSERT_TRUE(work.takeAnswer(answer.bytes()).ok());
  EXPECT_TRUE(isTaken);

  isTaken = false;
  std::mt19937 random(5);
  const std::span<const uint8_t> sentBytes = sent.bytes(), answerBytes = answer.bytes();
  for (size_t i = 0; i < 300; ++i) {
    const auto some = [&](size_t size) { return i < 100 ? std::min(i, size - 1) : random() % size; };
    Packer nothing;
    EXPECT_FALSE(runPacked<Order>(sentBytes.first(some(sentBytes.size())), nothing).ok());
    EXPECT_FALSE(work.takeAnswer(answerBytes.first(some(answerBytes.size()))).ok());
  }
  EXPECT_FALSE(isTaken);
}

SharedBytes shared(std::vector<uint8_t> bytes) {
  return std::make_shared<const std::vector<uint8_t>>(std::move(bytes));
}

TEST(DecodeOrders, ElevationTravels) {
  for (const bool hasVoid : {false, true}) {
    const Tile root = rootTile(hasVoid);
    const SharedBytes payload = shared(encodeTile(root, nullptr, 0, kScale));
    expectToTravel(DecodeElevation{payload, nullptr, 0, kScale});
    const auto parent = std::make_shared<const TileSamples>(root.samples);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const SharedBytes child = shared(encodeTile(childTile(root, quadrant), parent.get(), quadrant, kScale));
      expectToTravel(DecodeElevation{child, parent, quadrant, kScale});
    }
  }
}

/// Puts samples into layers, each by its place: those of the root on every 8th, which are on every 16th of
/// its children, stay in the first.
void putIntoLayers(TileSamples& samples, const TileSamples* parent, int quadrant, int layerCount) {
  samples.layerCount = layerCount;
  samples.layers.assign(kTileSampleCount, 0);
  for (int y = 0; y < kTileSamples; ++y)
    for (int x = 0; x < kTileSamples; ++x) {
      uint8_t& layer = samples.layers[static_cast<size_t>(y * kTileSamples + x)];
      const int parentX = (quadrant & 1) * kTileCells / 2 + x / 2;
      const int parentY = (quadrant >> 1) * kTileCells / 2 + y / 2;
      if (parent != nullptr && x % 2 == 0 && y % 2 == 0)
        layer = parent->layers[static_cast<size_t>(parentY * kTileSamples + parentX)];
      else if (x % 8 != 0 || y % 8 != 0)
        layer = static_cast<uint8_t>((x * 5 + y * 3) % layerCount);
    }
}

TEST(DecodeOrders, RefinementsTravel) {
  constexpr int kLayers = 3;
  ElevationScale scale = kScale;
  scale.layerCount = kLayers;
  for (const bool hasVoid : {false, true}) {
    Tile root = rootTile(hasVoid);
    putIntoLayers(root.samples, nullptr, 0, kLayers);
    const auto sharedSamples = [](TileSamples samples) {
      return std::make_shared<const TileSamples>(std::move(samples));
    };
    // The parent may have as many layers, or more.
    for (int layer = 1; layer < kLayers; ++layer) {
      const RefineElevation order{shared(encodeRefinement(root.samples, nullptr, 0, layer, scale)),
                                  sharedSamples(samplesOfLayer(root.samples, layer - 1)), nullptr, 0, scale};
      ASSERT_TRUE(order.run().ok());
      EXPECT_EQ(order.run()->heights, samplesOfLayer(root.samples, layer).heights);
      EXPECT_EQ(order.run()->layerCount, layer + 1);
      expectToTravel(order);
    }
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      Tile child = childTile(root, quadrant);
      putIntoLayers(child.samples, &root.samples, quadrant, kLayers);
      for (int layer = 0; layer < kLayers; ++layer) {
        for (int parentLayer = layer; parentLayer < kLayers; ++parentLayer) {
          const auto parent = sharedSamples(samplesOfLayer(root.samples, parentLayer));
          const TileSamples all = samplesOfLayer(child.samples, layer);
          if (layer == 0) {
            const DecodeElevation order{shared(encodeTile(child, &root.samples, quadrant, scale)), parent,
                                        quadrant, scale};
            ASSERT_TRUE(order.run().ok());
            EXPECT_EQ(order.run()->samples.heights, all.heights);
            expectToTravel(order);
            continue;
          }
          RefineElevation order{
              shared(encodeRefinement(child.samples, &root.samples, quadrant, layer, scale)),
              sharedSamples(samplesOfLayer(child.samples, layer - 1)), parent, quadrant, scale};
          ASSERT_TRUE(order.run().ok());
          EXPECT_EQ(order.run()->heights, all.heights);
          EXPECT_EQ(order.run()->states, all.states);
          expectToTravel(order);
          std::vector<uint8_t> damaged = *order.payload;
          damaged[damaged.size() / 2] ^= 1;
          order.payload = shared(damaged);
          ASSERT_FALSE(order.run().ok());
          expectToTravel(order);
        }
      }
    }
  }
}

TEST(DecodeOrders, WhatCannotBeDecodedSaysSoInTheSameWords) {
  std::vector<uint8_t> payload = encodeTile(rootTile(false), nullptr, 0, kScale);
  payload[payload.size() / 2] ^= 1;
  const DecodeElevation damaged{shared(payload), nullptr, 0, kScale};
  ASSERT_FALSE(damaged.run().ok());
  expectToTravel(damaged);
  expectToTravel(DecodePicture{shared({1, 2, 3}), false});
}

TEST(DecodeOrders, BeginningsTravel) {
  std::vector<uint8_t> payload = encodeTile(rootTile(false), nullptr, 0, kScale);
  payload.resize(payload.size() * 2 / 3);
  const SketchElevation sketch{shared(payload), kScale};
  ASSERT_TRUE(sketch.run().ok());
  expectToTravel(sketch);

  ImageryTile picture;
  for (size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = static_cast<uint8_t>(i % 4 == 3 ? 255 : i / 700 + i % 4 * 20);
  std::vector<uint8_t> jpeg = encodeImagery(picture, ImageryFormat::Jpeg, 80);
  expectToTravel(DecodePicture{shared(jpeg), false});
  jpeg.resize(imageryLayout(jpeg)->scanEnds[0] + 10);
  const DecodePicture beginning{shared(jpeg), true};
  ASSERT_TRUE(beginning.run().ok());
  expectToTravel(beginning);
}

TEST(DecodeOrders, WebpTravelsWholeCutAndDamaged) {
  ImageryTile picture;
  for (size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = static_cast<uint8_t>(i % 4 == 3 ? 255 : i / 700 + i % 4 * 20);
  const std::vector<uint8_t> webp = encodeImagery(picture, ImageryFormat::Webp, 75);
  const DecodePicture whole{shared(webp), false};
  ASSERT_TRUE(whole.run().ok());
  expectToTravel(whole);
  std::vector<uint8_t> cut = webp, damaged = webp;
  cut.resize(webp.size() / 2);
  damaged[webp.size() / 2] ^= 1;
  for (const bool isBeginning : {false, true}) {
    for (const auto& bytes : {cut, damaged}) {
      const DecodePicture broken{shared(bytes), isBeginning};
      ASSERT_FALSE(broken.run().ok());
      expectToTravel(broken);
    }
  }
}

/// No order's number stands for two.
TEST(DecodeOrders, KindsAreOfOneTypeEach) {
  const std::set<uint32_t> kinds = {DecodeElevation::kKind, RefineElevation::kKind, SketchElevation::kKind,
                                    DecodePicture::kKind};
  EXPECT_EQ(kinds.size(), 4U);
}

}  // namespace
}  // namespace terrane
