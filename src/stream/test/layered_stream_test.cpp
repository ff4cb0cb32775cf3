#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <random>
#include <set>

#include "layered_dataset.h"
#include "made_dataset.h"
#include "streaming.h"

/// Elevation in layers of significance, streamed in simulated time.
namespace terrane {
namespace {

constexpr int kLayers = 3;

class LayeredStreamTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory();
    auto plain = Dataset::open(madeDataset(*folder_));
    ASSERT_TRUE(plain.ok()) << plain.error().message;
    plain_ = plain->directory();
    truth_ = new std::map<TileId, Tile>(decodedTiles(*plain));
    putIntoLayers(*truth_, plain->manifest().frame.finestLevel, kLayers);
    const Status written = writeLayeredDataset(*plain, *truth_, kLayers, directory());
    ASSERT_TRUE(written.ok()) << written.error().message;
  }
  static void TearDownTestSuite() {
    delete truth_;
    delete folder_;
  }
  static std::string directory() { return folder_->file("layered.terrane"); }
  static TileId deepest() { return truth_->rbegin()->first; }

  static std::vector<StreamWish> allWishes(int significance) {
    std::vector<StreamWish> out;
    for (const auto& [id, tile] : *truth_)
      out.push_back(wishForTile(TileKey::elevation(id, significance), 20.0 / (1 + id.level)));
    return out;
  }
  /// The tile is here with so many layers, and is what it has to be.
  static void expectTrue(const TileStream& stream, TileId id, int layers) {
    const auto tile = stream.elevation(id);
    ASSERT_NE(tile, nullptr) << toString(id);
    ASSERT_EQ(tile->samples.layerCount, layers) << toString(id);
    const Tile& truth = truth_->at(id);
    const TileSamples samples = samplesOfLayer(truth.samples, layers - 1);
    EXPECT_EQ(tile->samples.heights, samples.heights) << toString(id);
    EXPECT_EQ(tile->samples.states, samples.states) << toString(id);
    EXPECT_EQ(tile->samples.coverage.bits, samples.coverage.bits) << toString(id);
    EXPECT_EQ(tile->nodes.error, truth.nodes.error) << toString(id);
    EXPECT_EQ(tile->nodes.low, truth.nodes.low) << toString(id);
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(tile->children[i].error, truth.children[i].error);
  }
  /// Each tile came after all that it needs.
  static void expectInOrder(const std::vector<TileKey>& news) {
    std::set<TileKey> here;
    for (const TileKey& key : news) {
      EXPECT_TRUE(key.tile.isRoot() || here.count(key.parent()) == 1) << toString(key.tile);
      EXPECT_TRUE(!key.isRefinement() || here.count(key.before()) == 1) << toString(key.tile);
      here.insert(key);
    }
  }

  static TemporaryDirectory* folder_;
  static std::string plain_;
  static std::map<TileId, Tile>* truth_;
};
TemporaryDirectory* LayeredStreamTest::folder_ = nullptr;
std::string LayeredStreamTest::plain_;
std::map<TileId, Tile>* LayeredStreamTest::truth_ = nullptr;

TEST_F(LayeredStreamTest, ALayerBringsAllThatItNeedsInOneRoundTrip) {
  Streaming s(directory(), {2e7, 0.2});
  ASSERT_TRUE(s.open());
  s.stream->want(std::vector{wishForTile(TileKey::elevation(deepest(), 2))});
  // Directories of the later layers may be a round trip behind.
  EXPECT_LT(s.settle(10.0), 0.6);
  const std::vector<TileKey> news = s.stream->takeNews();
  EXPECT_EQ(news.size(), static_cast<size_t>(kLayers * (deepest().level + 1)));
  expectInOrder(news);
  for (int level = 0; level <= deepest().level; ++level)
    expectTrue(*s.stream, deepest().ancestor(level), kLayers);
}

TEST_F(LayeredStreamTest, OnlyTheLayersThatAreWantedCome) {
  Streaming s(directory(), {5e6, 0.05});
  ASSERT_TRUE(s.open());
  s.stream->want(allWishes(0));
  s.settle(30.0);
  for (const auto& [id, tile] : *truth_) expectTrue(*s.stream, id, 1);
  // Of one tile two layers: its ancestors have as many, the others stay what they are.
  s.stream->want(std::vector{wishForTile(TileKey::elevation(deepest(), 1))});
  s.settle(30.0);
  for (const auto& [id, tile] : *truth_)
    expectTrue(*s.stream, id, id.level <= deepest().level && deepest().ancestor(id.level) == id ? 2 : 1);
  // A layer that there is not is nowhere stored.
  EXPECT_TRUE(s.stream->isStored(TileKey::elevation(deepest(), 2)));
  EXPECT_FALSE(s.stream->isStored(TileKey::elevation(deepest(), 3)));
  s.stream->want(std::vector{wishForTile(TileKey::elevation(deepest(), 3))});
  s.settle(30.0);
  EXPECT_TRUE(s.stream->isIdle());
  expectTrue(*s.stream, deepest(), 3);
}

TEST_F(LayeredStreamTest, AllLayersTogetherAreWhatADatasetWithoutHas) {
  Streaming layered(directory(), {5e6, 0.05}), plain(plain_, {5e6, 0.05});
  ASSERT_TRUE(layered.open() && plain.open());
  layered.stream->want(allWishes(2));
  plain.stream->want(allWishes(0));
  layered.settle(30.0);
  plain.settle(30.0);
  expectInOrder(layered.stream->takeNews());
  for (const auto& [id, tile] : *truth_) {
    expectTrue(*layered.stream, id, kLayers);
    ASSERT_NE(plain.stream->elevation(id), nullptr);
    EXPECT_EQ(layered.stream->elevation(id)->samples.heights, plain.stream->elevation(id)->samples.heights);
  }
  // A tile is kept once, with the numbers of its samples' layers.
  const StreamStatistics a = layered.stream->statistics(), b = plain.stream->statistics();
  EXPECT_EQ(a.wishes, 0U);
  EXPECT_EQ(a.debt, 0.0);
  EXPECT_EQ(a.tilesDecoded, kLayers * truth_->size());
  EXPECT_EQ(a.decodedTiles, truth_->size());
  EXPECT_EQ(a.decodedBytes, b.decodedBytes + truth_->size() * kTileSampleCount);
}

TEST_F(LayeredStreamTest, FaultyAnswersDelayLayersAndNoMore) {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    LineFaults faults;
    faults.busyShare = faults.slowShare = faults.truncatedShare = faults.corruptShare = 0.025;
    faults.seed = seed;
    Streaming s(directory(), {5e6, 0.05}, {.mostRequests = 6}, faults);
    ASSERT_TRUE(s.open());
    for (int i = 0; i < 10; ++i) {
      s.stream->want(allWishes(2));
      s.settle(60.0);
    }
    for (const auto& [id, tile] : *truth_) expectTrue(*s.stream, id, kLayers);
    EXPECT_GT(s.line->answersSpoilt(), 0U);
  }
}

TEST_F(LayeredStreamTest, WhereARefinementIsGivenUpTheTileStaysWithoutIt) {
  // note: nothing comes along with the directories.
  Streaming s(directory(), {5e6, 0.05}, {.firstBytes = 0});
  ASSERT_TRUE(s.open());
  s.stream->want(std::vector{wishForTile(TileKey::elevation(deepest()))});
  s.settle(10.0);
  const TileId parent = deepest().parent();
  s.stream->want(std::vector{wishForTile(TileKey::elevation(parent, 1))});
  s.settle(10.0);
  expectTrue(*s.stream, parent, 2);

  LineFaults faults;
  faults.corruptShare = 1.0;
  s.line->setFaults(faults);
  const uint64_t failed = s.stream->statistics().tilesDamaged;
  const std::vector wishes = {wishForTile(TileKey::elevation(deepest(), 2))};
  s.stream->want(wishes);
  s.settle(120.0);
  EXPECT_TRUE(s.stream->isIdle());
  EXPECT_GT(s.stream->statistics().tilesDamaged, failed + 1) << "tried once only";
  EXPECT_NE(s.stream->problem().find(": layer "), std::string::npos) << s.stream->problem();
  EXPECT_TRUE(s.stream->isLost(TileKey::elevation(deepest(), 1)));
  EXPECT_FALSE(s.stream->isLost(TileKey::elevation(deepest())));
  expectTrue(*s.stream, deepest(), 1);
  expectTrue(*s.stream, parent, 2);
  const uint64_t requests = s.stream->statistics().requests;
  s.stream->want(wishes);
  s.step(5.0);
  EXPECT_EQ(s.stream->statistics().requests, requests);

  // Not for good.
  s.line->setFaults({});
  s.step(70.0);
  s.settle(10.0);
  expectTrue(*s.stream, deepest(), kLayers);
}

TEST_F(LayeredStreamTest, ALayerWhoseArchiveIsGoneLeavesTheOthers) {
  const TemporaryDirectory folder;
  for (const std::string& name :
       {std::string("manifest.json"), elevationArchiveName(0), elevationArchiveName(1)})
    writeWholeFile(folder.file(name), readWholeFile(directory() + "/" + name));
  const std::string incomplete = std::filesystem::path(folder.file("manifest.json")).parent_path().string();
  Streaming s(incomplete, {5e6, 0.05});
  ASSERT_TRUE(s.open()) << s.stream->problem();
  s.stream->want(std::vector{wishForTile(TileKey::elevation(deepest(), 2))});
  s.step(20.0);
  EXPECT_EQ(s.stream->phase(), StreamPhase::Ready);
  expectTrue(*s.stream, deepest(), 2);
  // Given up from the root on, and said so; asked for again once a minute.
  EXPECT_TRUE(s.stream->isIdle());
  EXPECT_TRUE(s.stream->isLost(TileKey::elevation({}, 2)));
  EXPECT_GT(s.stream->statistics().tilesLost, 0U);
  EXPECT_EQ(s.stream->statistics().requestsFailed, 1U);
  s.step(60.0);
  EXPECT_EQ(s.stream->statistics().requestsFailed, 2U);

  // It comes back.
  writeWholeFile(incomplete + "/" + elevationArchiveName(2),
                 readWholeFile(directory() + "/" + elevationArchiveName(2)));
  s.step(70.0);
  expectTrue(*s.stream, deepest(), kLayers);
  EXPECT_EQ(s.stream->statistics().tilesLost, 0U);
}

TEST_F(LayeredStreamTest, OverAThinLineLaterLayersHoldUpNothing) {
  const LineModel thin{3000.0, 0.05};
  std::vector<double> seconds;
  for (const std::string& dataset : {plain_, directory()}) {
    Streaming s(dataset, thin);
    ASSERT_TRUE(s.open());
    s.stream->want(std::vector{wishForTile(TileKey::elevation(deepest(), dataset == plain_ ? 0 : 2))});
    while (s.stream->elevation(TileId{}) == nullptr && s.now < 60.0) s.step(0.05);
    EXPECT_TRUE(s.stream->isSketch(TileKey::elevation({})));
    seconds.push_back(s.now);
    if (dataset == plain_) continue;
    s.settle(900.0);
    EXPECT_FALSE(s.stream->isSketch(TileKey::elevation({})));
    for (int level = 0; level <= deepest().level; ++level)
      expectTrue(*s.stream, deepest().ancestor(level), kLayers);
  }
  EXPECT_NEAR(seconds[1], seconds[0], 0.5);
}

TEST_F(LayeredStreamTest, CachesKeepTheirBudgetsAndWhatIsHeldWithItsLayers) {
  const uint64_t budget = 12 * 410000;
  Streaming s(directory(), {5e7, 0.01}, {.compressedBytes = 200000, .decodedBytes = budget});
  ASSERT_TRUE(s.open());
  const TileId held = deepest();
  s.stream->want(std::vector{wishForTile(TileKey::elevation(held, 2))});
  s.settle(10.0);
  s.stream->hold(std::vector{held});
  std::mt19937 random(3);
  std::vector<TileId> ids;
  for (const auto& [id, tile] : *truth_) ids.push_back(id);
  uint64_t most = 0;
  for (int turn = 0; turn < 80; ++turn) {
    const TileId id = ids[random() % ids.size()];
    const int significance = static_cast<int>(random() % kLayers);
    s.stream->want(std::vector{wishForTile(TileKey::elevation(id, significance))});
    s.settle(10.0);
    ASSERT_TRUE(s.stream->isIdle());
    const auto tile = s.stream->elevation(id);
    ASSERT_NE(tile, nullptr);
    EXPECT_GT(tile->samples.layerCount, significance);
    expectTrue(*s.stream, id, tile->samples.layerCount);
    s.stream->want({});
    s.step(0.05);
    const StreamStatistics statistics = s.stream->statistics();
    most = std::max(most, statistics.decodedBytes);
    EXPECT_LE(statistics.decodedBytes, budget);
    EXPECT_LE(statistics.compressedBytes, 200000U);
    for (int level = 0; level <= held.level; ++level) expectTrue(*s.stream, held.ancestor(level), kLayers);
  }
  EXPECT_GT(most, budget / 2) << "nothing had to go";
}

/// Whatever is forgotten while it is being refined: what is here is always true, and its bytes are counted.
TEST_F(LayeredStreamTest, WishesThatChangeAllTheTimeLeaveNothingWrong) {
  const uint64_t budget = 8 * 410000;
  Streaming s(directory(), {2e6, 0.02}, {.compressedBytes = 150000, .decodedBytes = budget});
  ASSERT_TRUE(s.open());
  std::mt19937 random(4);
  std::vector<TileId> ids;
  for (const auto& [id, tile] : *truth_) ids.push_back(id);
  for (int turn = 0; turn < 300; ++turn) {
    std::vector<StreamWish> wishes;
    for (int i = 0; i < 3; ++i)
      wishes.push_back(
          wishForTile(TileKey::elevation(ids[random() % ids.size()], static_cast<int>(random() % kLayers))));
    s.stream->want(wishes);
    s.step(0.05);
    if (turn % 20 != 0) continue;
    for (const TileId id : ids)
      if (const auto tile = s.stream->elevation(id);
          tile != nullptr && !s.stream->isSketch(TileKey::elevation(id)))
        expectTrue(*s.stream, id, tile->samples.layerCount);
  }
  s.stream->want({});
  s.settle(10.0);
  s.step(0.1);
  EXPECT_LE(s.stream->statistics().decodedBytes, budget);
  uint64_t tiles = 0;
  for (const TileId id : ids) tiles += s.stream->elevation(id) != nullptr ? 1 : 0;
  EXPECT_EQ(s.stream->statistics().decodedTiles, tiles);
  EXPECT_EQ(s.stream->statistics().tilesDamaged, 0U);
}

TEST(TileKey, LayersOfElevationAndImageryAreApart) {
  const TileId id{3, 2, 1};
  const TileKey key = TileKey::elevation(id, 2);
  EXPECT_TRUE(key.isElevation() && key.isRefinement());
  EXPECT_EQ(key.significance(), 2);
  EXPECT_EQ(key.before(), TileKey::elevation(id, 1));
  EXPECT_EQ(key.parent(), TileKey::elevation(id.parent(), 2));
  EXPECT_EQ(TileKey::elevation(id), (TileKey{TileKey::kElevation, id}));
  EXPECT_FALSE(TileKey::elevation(id).isRefinement());
  EXPECT_FALSE((TileKey{0, id}).isElevation());
  std::set<size_t> hashes;
  for (int32_t layer = -4; layer < 4; ++layer) hashes.insert(TileKeyHash{}(TileKey{layer, id}));
  EXPECT_EQ(hashes.size(), 8U);
}

}  // namespace
}  // namespace terrane
