#include "terrane/engine/tile_orders.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "made_ground.h"
#include "random_tiles.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/codec/packed.h"
#include "terrane/engine/line_orders.h"
#include "terrane/engine/run_order.h"
#include "terrane/stream/decode_orders.h"

namespace terrane {
namespace {

template <class Order>
std::vector<uint8_t> packedAnswer(const typename Order::Answer& answer) {
  Packer packer;
  Order::packAnswer(packer, answer);
  return packer.take();
}

/// What an order gives here is what it gives in another memory; cut short, neither order nor answer is taken.
template <class Order>
void expectToTravel(const Order& order, std::mt19937& random) {
  const std::vector<uint8_t> truth = packedAnswer<Order>(order.run());
  std::vector<uint8_t> taken;
  const auto take = [&](const typename Order::Answer& answer) { taken = packedAnswer<Order>(answer); };
  OrderedWork<Order, decltype(take)> work(order, take);
  Packer sent, answer;
  work.pack(sent);
  const Status ran = runOrder(work.kind(), sent.bytes(), answer);
  ASSERT_TRUE(ran.ok()) << ran.error().message;
  ASSERT_TRUE(work.takeAnswer(answer.bytes()).ok());
  EXPECT_EQ(taken, truth);

  taken.clear();
  const std::span<const uint8_t> sentBytes = sent.bytes(), answerBytes = answer.bytes();
  for (size_t i = 0; i < 100; ++i) {
    const auto some = [&](size_t size) { return i < 50 && i < size ? i : random() % size; };
    Packer nothing;
    EXPECT_FALSE(runOrder(work.kind(), sentBytes.first(some(sentBytes.size())), nothing).ok());
    EXPECT_FALSE(work.takeAnswer(answerBytes.first(some(answerBytes.size()))).ok());
  }
  EXPECT_TRUE(taken.empty());
}

TEST(TileOrders, PreparingTravels) {
  std::mt19937 random(21);
  const ElevationScale scale{.heightStep = 0.25};
  for (const double voidShare : {0.0, 0.3, 1.0}) {
    const Tile tile = randomTile({}, nullptr, scale, {.voidShare = voidShare}, random);
    expectToTravel(PrepareTile{std::make_shared<const Tile>(tile)}, random);
  }
}

TEST(TileOrders, MeshesTravel) {
  std::mt19937 random(22);
  MeshScale meshScale{.spacingMeters = 10.0};
  meshScale.finestLevel = 1;
  for (unsigned kind = 0; kind < 5; ++kind) {
    const MadeGround ground(1, someGround(kind, random));
    const auto root = std::make_shared<const Tile>(ground.tile({}, random, 10));
    const MakeMeshes first{{TileId{}, 0, nullptr, meshScale, {}}, root};
    expectToTravel(first, random);
    // Those of a child start from the root's last, and go on beyond its own.
    const auto roots = first.run();
    const auto child = std::make_shared<const Tile>(ground.tile({1, 1, 0}, random, 10));
    const MakeMeshes second{{{1, 1, 0}, meshScale.firstLevel(false), roots.back(), meshScale, {}}, child};
    expectToTravel(second, random);
    const MakeMeshes beyond{{{1, 1, 0}, meshScale.lastOwnLevel() + 1, second.run().back(), meshScale, {}},
                            child};
    expectToTravel(beyond, random);
  }
}

TEST(TileOrders, ATileThatIsThereIsNotSentAgain) {
  std::mt19937 random(24);
  SentObjects sent;
  KeptObjects kept;
  const auto send = [&](const std::shared_ptr<const Tile>& tile) {
    const PrepareTile order{tile};
    Packer packer, answer;
    packer.sendTo(&sent);
    order.pack(packer);
    const Status ran = runOrder(PrepareTile::kKind, packer.bytes(), answer, &kept);
    EXPECT_TRUE(ran.ok()) << ran.error().message;
    EXPECT_EQ(answer.bytes(), packedAnswer<PrepareTile>(order.run()));
    return packer.bytes().size();
  };
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (uint32_t i = 0; i < SentObjects::kMost + 3; ++i)
    tiles.push_back(std::make_shared<const Tile>(randomTile({}, nullptr, {.heightStep = 0.25}, {}, random)));
  for (const auto& tile : tiles) EXPECT_GT(send(tile), size_t{kTileSampleCount});
  // The last ones are there, the first have given way.
  EXPECT_LT(send(tiles.back()), 16U);
  EXPECT_GT(send(tiles.front()), size_t{kTileSampleCount});
  EXPECT_LT(send(tiles.front()), 16U);
  // Another tile is sent, even where one that is gone lay.
  while (!tiles.empty()) {
    tiles.pop_back();
    EXPECT_GT(send(std::make_shared<const Tile>(randomTile({}, nullptr, {.heightStep = 0.5}, {}, random))),
              size_t{kTileSampleCount});
  }
  // One who keeps nothing, or something else there, cannot do without.
  Packer named, nothing;
  const auto tile = std::make_shared<const Tile>(randomTile({}, nullptr, {.heightStep = 0.25}, {}, random));
  send(tile);
  named.sendTo(&sent);
  PrepareTile{tile}.pack(named);
  KeptObjects empty;
  EXPECT_FALSE(runOrder(PrepareTile::kKind, named.bytes(), nothing).ok());
  EXPECT_FALSE(runOrder(PrepareTile::kKind, named.bytes(), nothing, &empty).ok());
  EXPECT_TRUE(runOrder(PrepareTile::kKind, named.bytes(), nothing, &kept).ok());
}

TEST(TileOrders, LinesTravel) {
  std::mt19937 random(24);
  std::uniform_real_distribution<double> place(-5000.0, 5000.0);
  for (const size_t count : {1, 40}) {
    auto lines = std::make_shared<std::vector<GroundLine>>(count);
    for (GroundLine& line : *lines) {
      for (size_t i = 3 + random() % 30; i > 0; --i) line.corners.emplace_back(place(random), place(random));
      line.srgba = {0.2F, 0.4F, 0.6F, 0.5F};
      line.width = 1.0 + static_cast<double>(random() % 9);
      line.isWidthInMeters = random() % 2 == 0;
    }
    expectToTravel(PrepareLines{lines}, random);
  }
}

TEST(TileOrders, WhatIsNoOrderIsAnError) {
  Packer nothing;
  EXPECT_FALSE(runOrder(0, {}, nothing).ok());
  EXPECT_FALSE(runOrder(12345, {}, nothing).ok());
  // A mesh level without the one that it starts from, and one that there is not.
  std::mt19937 random(23);
  const MadeGround ground(1, someGround(1, random));
  const auto tile = std::make_shared<const Tile>(ground.tile({1, 0, 0}, random, 10));
  for (const int level : {-1, 3, 99}) {
    Packer packer;
    MakeMeshes{{{1, 0, 0}, level, nullptr, {}, {}}, tile}.pack(packer);
    EXPECT_FALSE(runOrder(MakeMeshes::kKind, packer.bytes(), nothing).ok()) << level;
  }
}

}  // namespace
}  // namespace terrane
