#include "terrane/stream/tile_stream.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <random>

#include "layered_dataset.h"
#include "made_dataset.h"
#include "streaming.h"
#include "temporary_directory.h"
#include "terrane/dataset/dataset.h"

/// Streams in simulated time: the line's clock is a number.
namespace terrane {
namespace {

class TileStreamTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory();
    auto dataset = Dataset::open(madeDataset(*folder_));
    ASSERT_TRUE(dataset.ok()) << dataset.error().message;
    dataset_ = new Dataset(std::move(*dataset));
  }
  static void TearDownTestSuite() {
    delete dataset_;
    delete folder_;
  }

  /// All tiles, decoded straight from the files.
  static const std::map<TileId, Tile>& truth() {
    static const std::map<TileId, Tile> tiles = decodedTiles(*dataset_);
    return tiles;
  }

  static Streaming streaming(LineModel model, const StreamOptions& options = {},
                             const LineFaults& faults = {}) {
    return {dataset_->directory(), model, options, faults};
  }
  /// Directories come by themselves, so that every tile is asked for.
  static StreamOptions nothingAlong() {
    StreamOptions out;
    out.firstBytes = 0;
    return out;
  }
  static StreamWish wishFor(TileId id, double now = 8.0, double area = 1000.0) {
    return wishForTile(TileKey::elevation(id), now, area);
  }
  static std::vector<StreamWish> allWishes() {
    std::vector<StreamWish> out;
    for (const auto& [id, tile] : truth()) out.push_back(wishFor(id, 20.0 / (1 + id.level)));
    return out;
  }
  static void expectTrue(const TileStream& stream, TileId id) {
    const auto tile = stream.elevation(id);
    ASSERT_NE(tile, nullptr) << toString(id);
    EXPECT_EQ(tile->samples.heights, truth().at(id).samples.heights) << toString(id);
    EXPECT_EQ(tile->nodes.error, truth().at(id).nodes.error) << toString(id);
  }

  static TemporaryDirectory* folder_;
  static Dataset* dataset_;
};
TemporaryDirectory* TileStreamTest::folder_ = nullptr;
Dataset* TileStreamTest::dataset_ = nullptr;

TEST_F(TileStreamTest, ADeepTileBringsItsAncestorsInOneRoundTrip) {
  Streaming s = streaming({5e6, 0.2});
  ASSERT_TRUE(s.open());
  const TileId deep = truth().rbegin()->first;
  ASSERT_EQ(deep.level, 3);
  s.stream->want(std::vector{wishFor(deep)});
  // Latency once, and not once a level.
  EXPECT_LT(s.settle(10.0), 0.35);
  const std::vector<TileKey> news = s.stream->takeNews();
  ASSERT_EQ(news.size(), 4U);
  for (int level = 0; level <= 3; ++level) {
    EXPECT_EQ(news[static_cast<size_t>(level)].tile, deep.ancestor(level));
    expectTrue(*s.stream, deep.ancestor(level));
  }
}

TEST_F(TileStreamTest, EverythingComesAndNeighboursShareRequests) {
  Streaming s = streaming({5e6, 0.05});
  ASSERT_TRUE(s.open());
  s.stream->want(allWishes());
  s.settle(30.0);
  for (const auto& [id, tile] : truth()) expectTrue(*s.stream, id);
  const StreamStatistics statistics = s.stream->statistics();
  EXPECT_EQ(statistics.tilesDecoded, truth().size());
  EXPECT_EQ(statistics.wishes, 0U);
  EXPECT_EQ(statistics.debt, 0.0);
  EXPECT_LT(statistics.requests, truth().size());
  EXPECT_NEAR(statistics.latencySeconds, 0.05, 0.03);
}

TEST_F(TileStreamTest, TheRootComesWithTheDirectories) {
  Streaming s = streaming({5e6, 0.05});
  ASSERT_TRUE(s.open());
  const uint64_t opening = s.stream->statistics().requests;
  s.stream->want(std::vector{wishFor(TileId{})});
  s.step(0.05);
  EXPECT_EQ(s.stream->statistics().requests, opening);
  expectTrue(*s.stream, TileId{});
  // Over a thin line nothing comes with them.
  Streaming thin = streaming({3000.0, 0.05});
  ASSERT_TRUE(thin.open());
  thin.stream->want(std::vector{wishFor(TileId{})});
  thin.step(0.05);
  EXPECT_EQ(thin.stream->elevation(TileId{}), nullptr);
}

TEST_F(TileStreamTest, TheRestOfAGroupComesAlong) {
  // Of the sixteen tiles below one, all but the last are wished for, those that are stored.
  std::vector<TileId> group;
  for (const auto& [id, tile] : truth())
    if (id.level == 2) group.push_back(id);
  ASSERT_GE(group.size(), 4U);
  const TileId last = group.back();
  std::vector<StreamWish> wishes;
  for (const TileId id : group)
    if (id != last) wishes.push_back(wishFor(id));
  Streaming s = streaming({5e6, 0.05}, nothingAlong());
  ASSERT_TRUE(s.open());
  s.stream->want(wishes);
  s.settle(10.0);
  const uint64_t requests = s.stream->statistics().requests;
  EXPECT_EQ(s.stream->elevation(last), nullptr);
  s.stream->want(std::vector{wishFor(last)});
  s.step(0.02);
  expectTrue(*s.stream, last);
  EXPECT_EQ(s.stream->statistics().requests, requests);
}

TEST_F(TileStreamTest, WhatIsForLaterWaitsForOthersButNotForLong) {
  Streaming s = streaming({5e6, 0.05}, nothingAlong());
  ASSERT_TRUE(s.open());
  s.stream->want(std::vector{wishFor(TileId{})});
  s.settle(10.0);
  const uint64_t requests = s.stream->statistics().requests;
  const TileId deep = truth().rbegin()->first;
  std::vector<StreamWish> later = {wishFor(deep)};
  later[0].chance = 0.25;
  const double begun = s.now;
  while (s.now < begun + 1.5) {
    s.stream->want(later);
    s.step(0.1);
  }
  EXPECT_EQ(s.stream->statistics().requests, requests);
  while (s.now < begun + 2.5) {
    s.stream->want(later);
    s.step(0.1);
  }
  EXPECT_GT(s.stream->statistics().requests, requests);
  expectTrue(*s.stream, deep);
}

TEST_F(TileStreamTest, WhatIsWorthMoreComesFirst) {
  Streaming s = streaming({20000.0, 0.05});
  ASSERT_TRUE(s.open());
  std::vector<TileId> finest;
  for (const auto& [id, tile] : truth())
    if (id.level == 2) finest.push_back(id);
  std::vector<StreamWish> wishes;
  for (size_t i = 0; i < finest.size(); ++i)
    wishes.push_back(wishFor(finest[i], 4.0, i + 1 == finest.size() ? 1e6 : 10.0));
  s.stream->want(wishes);
  s.settle(300.0);
  std::vector<TileId> order;
  for (const TileKey& key : s.stream->takeNews())
    if (key.tile.level == 2) order.push_back(key.tile);
  ASSERT_EQ(order.size(), finest.size());
  EXPECT_EQ(order.front(), finest.back());
}

TEST_F(TileStreamTest, NoMoreIsUnderWayThanAThinLineCanUse) {
  Streaming s = streaming({3000.0, 0.05});
  ASSERT_TRUE(s.open());
  s.stream->want(allWishes());
  s.step(120.0);
  uint64_t most = 0;
  for (int i = 0; i < 60; ++i) {
    s.step(0.5);
    most = std::max(most, s.stream->statistics().bytesUnderway);
  }
  // A tile, or a few seconds of the line.
  EXPECT_LT(most, 80000U);
  EXPECT_GT(s.stream->statistics().looseness, 0.99);
}

TEST_F(TileStreamTest, OneAnswerInTenGoneWrongDelaysAndNoMore) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    LineFaults faults;
    faults.busyShare = faults.slowShare = faults.truncatedShare = faults.corruptShare = 0.025;
    faults.seed = seed;
    Streaming s = streaming({5e6, 0.05}, {.mostRequests = 6});
    ASSERT_TRUE(s.open());
    s.line->setFaults(faults);
    // One by one, so that there are many answers.
    std::vector<StreamWish> wishes;
    for (const StreamWish& wish : allWishes()) {
      wishes.push_back(wish);
      s.stream->want(wishes);
      s.step(0.05);
    }
    s.settle(120.0);
    for (const auto& [id, tile] : truth()) expectTrue(*s.stream, id);
    EXPECT_EQ(s.stream->statistics().tilesLost, 0U);
    EXPECT_GT(s.line->answersSpoilt(), 0U);
  }
}

TEST_F(TileStreamTest, DamagedTilesAreFetchedAgain) {
  LineFaults faults;
  faults.corruptShare = 1.0;
  Streaming s = streaming({5e6, 0.05}, nothingAlong());
  ASSERT_TRUE(s.open());
  s.line->setFaults(faults);
  s.stream->want(std::vector{wishFor(TileId{})});
  while (s.stream->statistics().tilesDamaged == 0 && s.now < 60.0) s.step(0.1);
  EXPECT_GT(s.stream->statistics().tilesDamaged, 0U);
  EXPECT_NE(s.stream->problem(), "");
  s.line->setFaults({});
  s.settle(200.0);
  expectTrue(*s.stream, TileId{});
}

TEST_F(TileStreamTest, ABusyServerIsNotHeldAgainstATile) {
  Streaming s = streaming({5e6, 0.05}, nothingAlong());
  ASSERT_TRUE(s.open());
  s.stream->want(std::vector{wishFor(TileId{})});
  const auto failUntil = [&](const LineFaults& faults, uint64_t count) {
    s.line->setFaults(faults);
    while (s.stream->statistics().requestsFailed < count && s.now < 60.0) s.step(0.01);
    ASSERT_EQ(s.stream->statistics().requestsFailed, count);
  };
  // Refused for a while, then cut off once: neither often enough to give it up.
  LineFaults busy, cutOff;
  busy.busyShare = cutOff.truncatedShare = 1.0;
  failUntil(busy, 6);
  failUntil(cutOff, 7);
  EXPECT_EQ(s.stream->statistics().tilesLost, 0U);
  s.line->setFaults({});
  EXPECT_LT(s.settle(60.0), 20.0);
  expectTrue(*s.stream, TileId{});
}

TEST_F(TileStreamTest, OverAThinLineTheRootIsSketchedFirst) {
  Streaming s = streaming({3000.0, 0.05});
  ASSERT_TRUE(s.open());
  const TileKey root{TileKey::kElevation, TileId{}};
  const TileId deep = truth().rbegin()->first;
  s.stream->want(std::vector{wishFor(deep), wishFor(TileId{})});
  const double begun = s.now;
  while (s.stream->elevation(TileId{}) == nullptr && s.now < begun + 60.0) s.step(0.05);
  EXPECT_LT(s.now - begun, 2.5);
  EXPECT_TRUE(s.stream->isSketch(root));
  EXPECT_FALSE(s.stream->isIdle());
  // Near enough to be recognised: hills of 300 m.
  const Tile& whole = truth().at(TileId{});
  const auto sketch = s.stream->elevation(TileId{});
  double squares = 0.0;
  for (size_t i = 0; i < whole.samples.heights.size(); ++i)
    squares += std::pow(sketch->samples.heights[i] - whole.samples.heights[i], 2.0);
  EXPECT_LT(std::sqrt(squares / kTileSampleCount), 60.0);

  s.settle(300.0);
  EXPECT_FALSE(s.stream->isSketch(root));
  expectTrue(*s.stream, TileId{});
  expectTrue(*s.stream, deep);
  // Told when the sketch came, and again when the root was whole; no child before that.
  const std::vector<TileKey> news = s.stream->takeNews();
  ASSERT_GE(news.size(), 3U);
  EXPECT_EQ(news[0], root);
  const auto last = std::find(news.rbegin(), news.rend(), root);
  EXPECT_TRUE(std::all_of(news.begin(), last.base(), [&](const TileKey& key) { return key == root; }));
}

TEST_F(TileStreamTest, ARootDamagedInOneOfItsPartsIsFetchedAgain) {
  Streaming s = streaming({3000.0, 0.05});
  ASSERT_TRUE(s.open());
  s.stream->want(std::vector{wishFor(TileId{})});
  while (!s.stream->isSketch({TileKey::kElevation, TileId{}}) && s.now < 90.0) s.step(0.05);
  LineFaults faults;
  faults.corruptShare = 1.0;
  s.line->setFaults(faults);
  while (s.stream->statistics().tilesDamaged == 0 && s.now < 300.0) s.step(0.1);
  EXPECT_EQ(s.stream->statistics().tilesDamaged, 1U);
  EXPECT_TRUE(s.stream->isSketch({TileKey::kElevation, TileId{}}));
  s.line->setFaults({});
  s.settle(200.0);
  expectTrue(*s.stream, TileId{});
}

TEST_F(TileStreamTest, AServerThatIsAwayIsAskedRarelyAndFoundAgain) {
  Streaming s = streaming({5e6, 0.05});
  ASSERT_TRUE(s.open());
  LineFaults faults;
  faults.outages = {{s.now, s.now + 30.0}};
  s.line->setFaults(faults);
  const uint64_t before = s.line->requestsStarted();
  s.stream->want(allWishes());
  s.step(29.0);
  EXPECT_TRUE(s.stream->statistics().isOffline);
  EXPECT_LT(s.line->requestsStarted() - before, 40U);
  EXPECT_FALSE(s.stream->isIdle());
  s.settle(60.0);
  EXPECT_FALSE(s.stream->statistics().isOffline);
  for (const auto& [id, tile] : truth()) expectTrue(*s.stream, id);
}

TEST_F(TileStreamTest, WhatIsMissingForGoodIsRememberedAndAllElseComes) {
  LineFaults faults;
  faults.missingShare = 0.3;
  Streaming s = streaming({5e6, 0.05}, nothingAlong());
  ASSERT_TRUE(s.open());
  s.stream->want(std::vector{wishFor(TileId{})});
  s.settle(10.0);
  s.line->setFaults(faults);
  s.stream->want(allWishes());
  s.settle(200.0);
  EXPECT_TRUE(s.stream->isIdle());
  const uint64_t requests = s.stream->statistics().requests;
  uint64_t lost = 0;
  for (const auto& [id, tile] : truth()) {
    bool canCome = true;
    for (int level = 0; level <= id.level; ++level)
      canCome = canCome && !s.stream->isLost({TileKey::kElevation, id.ancestor(level)});
    if (canCome) expectTrue(*s.stream, id);
    lost += s.stream->isLost({TileKey::kElevation, id}) ? 1 : 0;
  }
  EXPECT_GT(lost, 0U);
  EXPECT_EQ(s.stream->statistics().tilesLost, lost);
  // They are not asked for again.
  s.stream->want(allWishes());
  s.step(5.0);
  EXPECT_EQ(s.stream->statistics().requests, requests);
}

TEST_F(TileStreamTest, CachesKeepTheirBudgetsAndWhatIsHeld) {
  const uint64_t oneTile = 340000;
  Streaming s = streaming({5e7, 0.01}, {.compressedBytes = 200000, .decodedBytes = 12 * oneTile});
  ASSERT_TRUE(s.open());
  const TileId held = truth().rbegin()->first;
  s.stream->want(std::vector{wishFor(held)});
  s.settle(10.0);
  s.stream->hold(std::vector{held});
  std::mt19937 random(3);
  std::vector<TileId> ids;
  for (const auto& [id, tile] : truth()) ids.push_back(id);
  for (int turn = 0; turn < 60; ++turn) {
    s.stream->want(std::vector{wishFor(ids[random() % ids.size()])});
    s.settle(10.0);
    s.stream->want({});
    s.step(0.05);
    const StreamStatistics statistics = s.stream->statistics();
    EXPECT_LE(statistics.decodedBytes, 12 * oneTile);
    EXPECT_LE(statistics.compressedBytes, 200000U);
    for (int level = 0; level <= held.level; ++level) expectTrue(*s.stream, held.ancestor(level));
  }
}

TEST_F(TileStreamTest, ABrokenDatasetFailsWithWords) {
  const TemporaryDirectory other;
  writeWholeFile(other.file("manifest.json"), "{\"format\": 1}");
  const std::string file = other.file("manifest.json");
  const auto workers = makeInlineWorkers();
  for (const bool present : {true, false}) {
    if (!present) std::filesystem::remove(file);
    TileStream stream(std::make_unique<SimulatedLine>(file.substr(0, file.rfind('/')), LineModel{}),
                      *workers);
    for (double now = 0.0; now < 120.0 && stream.phase() == StreamPhase::Opening; now += 0.05)
      stream.poll(now);
    EXPECT_EQ(stream.phase(), StreamPhase::Failed);
    EXPECT_NE(stream.problem().find("manifest.json"), std::string::npos) << stream.problem();
  }
}

}  // namespace
}  // namespace terrane
