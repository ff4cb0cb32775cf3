#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "function_source.h"
#include "scripted_server.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/stream/tile_stream.h"

/// Streams over real sockets from a server that misbehaves as it is told.
namespace terrane {
namespace {

using Request = ScriptedServer::Request;

/// A dataset, the bytes of its files, and its tiles decoded straight from them.
struct Build {
  std::map<std::string, std::string> files;
  std::map<TileId, Tile> tiles;
  std::string etag;

  ScriptedServer::Reply serve(const Request& request) const {
    const auto file = files.find(request.target.substr(request.target.rfind('/') + 1));
    if (file == files.end()) return ScriptedServer::reply(404, "", "");
    return ScriptedServer::honest(request, file->second, "ETag: \"" + etag + "\"\r\n");
  }
};

class HttpStreamTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    first_ = new Build(build("first", 61.0));
    second_ = new Build(build("second", 47.0));
  }
  static void TearDownTestSuite() {
    delete first_;
    delete second_;
  }

  static Build build(const std::string& name, double wave) {
    const TemporaryDirectory folder;
    BuildOptions options;
    options.output = folder.file("made.terrane");
    const FunctionSource source(
        {{.level = 3,
          .x0 = 0,
          .y0 = 0,
          .x1 = 1600,
          .y1 = 1400,
          .height =
              [wave](int64_t x, int64_t y) {
                const double u = static_cast<double>(x), v = static_cast<double>(y);
                return static_cast<float>(300.0 * std::sin(u / wave) * std::cos(v / 83.0) +
                                          20.0 * std::sin(u / 5.0 + v / 7.0));
              }}},
        0.1, 0.05);
    SilentProgress silent;
    const auto built = buildDataset(source, options, silent);
    EXPECT_TRUE(built.ok());
    Build out;
    out.etag = name;
    for (const char* file : {"manifest.json", "elevation.pmtiles"})
      out.files[file] = readWholeFile(options.output + "/" + file);
    const auto dataset = Dataset::open(options.output);
    std::vector<TileId> ids = dataset->elevationTiles();
    std::sort(ids.begin(), ids.end());
    for (const TileId id : ids) {
      const auto payload = dataset->readElevation(id);
      auto tile = decodeTile(**payload, id.isRoot() ? nullptr : &out.tiles.at(id.parent()).samples,
                             id.isRoot() ? 0 : id.quadrant(), dataset->manifest().scale);
      out.tiles.emplace(id, std::move(*tile));
    }
    return out;
  }

  struct Streaming {
    std::unique_ptr<Workers> workers = makeThreadWorkers(2);
    std::unique_ptr<TileStream> stream;

    /// Polls until something holds; false after five minutes. The stream's clock runs twenty times as fast,
    /// so that nobody waits long for another try.
    template <class Condition>
    bool until(const Condition& holds) const {
      const auto begun = std::chrono::steady_clock::now();
      for (double now = 0.0; now < 300.0; std::this_thread::yield()) {
        now = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
        stream->poll(20.0 * now);
        if (holds()) return true;
      }
      return false;
    }
    bool open() const {
      return until([&] { return stream->phase() != StreamPhase::Opening; }) &&
             stream->phase() == StreamPhase::Ready;
    }
    bool settle() const {
      return until([&] { return stream->isIdle(); });
    }
  };
  static Streaming streaming(const ScriptedServer& server) {
    Streaming out;
    out.stream = std::make_unique<TileStream>(openTransport(server.url()), *out.workers);
    return out;
  }
  static std::vector<StreamWish> wishesFor(const Build& build, int finestLevel) {
    std::vector<StreamWish> out;
    for (const auto& [id, tile] : build.tiles)
      if (id.level <= finestLevel) out.push_back({{TileKey::kElevation, id}, 8.0, 4.0, 1.0, 1000.0, 1.0});
    return out;
  }
  /// What is here is of this build; how many tiles that are.
  static size_t countTrue(const TileStream& stream, const Build& build) {
    size_t count = 0;
    for (const auto& [id, tile] : build.tiles) {
      const auto here = stream.elevation(id);
      if (here == nullptr) continue;
      EXPECT_EQ(here->samples.heights, tile.samples.heights) << toString(id);
      ++count;
    }
    return count;
  }

  static Build* first_;
  static Build* second_;
};
Build* HttpStreamTest::first_ = nullptr;
Build* HttpStreamTest::second_ = nullptr;

TEST_F(HttpStreamTest, EverythingComesFromAServerThatNeverAnswersTheFirstTime) {
  std::mutex mutex;
  std::set<std::string> asked;
  int refused = 0;
  ScriptedServer server([&](const Request& request) {
    const std::lock_guard lock(mutex);
    if (!asked.insert(request.target + request.field("range")).second) return first_->serve(request);
    ++refused;
    if (refused % 4 != 0) return ScriptedServer::reply(500 + refused % 4, "", "not now");
    ScriptedServer::Reply broken = first_->serve(request);
    broken.bytes.resize(broken.bytes.size() / 2);
    broken.closes = true;
    return broken;
  });
  Streaming s = streaming(server);
  ASSERT_TRUE(s.open()) << s.stream->problem();
  for (int level = 0; level <= 3; ++level) {
    s.stream->want(wishesFor(*first_, level));
    ASSERT_TRUE(s.settle());
  }
  EXPECT_EQ(countTrue(*s.stream, *first_), first_->tiles.size());
  EXPECT_GT(refused, 10);
  EXPECT_EQ(s.stream->statistics().tilesLost, 0U);
}

TEST_F(HttpStreamTest, ADatasetThatIsBuiltAgainIsNoticedAndNeverMixedIn) {
  for (const bool hasTags : {true, false}) {
    const auto serve = [hasTags](const Build& build) {
      return [&build, hasTags](const Request& request) {
        ScriptedServer::Reply reply = build.serve(request);
        // Without tags the size tells.
        if (!hasTags) reply.bytes.replace(reply.bytes.find("ETag"), 4, "Else");
        return reply;
      };
    };
    ASSERT_NE(first_->files["elevation.pmtiles"].size(), second_->files["elevation.pmtiles"].size());
    ScriptedServer server(serve(*first_));
    Streaming s = streaming(server);
    ASSERT_TRUE(s.open()) << s.stream->problem();
    s.stream->want(wishesFor(*first_, 2));
    ASSERT_TRUE(s.settle());
    server.setScript(serve(*second_));
    s.stream->want(wishesFor(*first_, 3));
    ASSERT_TRUE(s.until([&] { return s.stream->phase() == StreamPhase::Failed; }));
    EXPECT_NE(s.stream->problem().find("another build"), std::string::npos) << s.stream->problem();
    EXPECT_EQ(countTrue(*s.stream, *first_), wishesFor(*first_, 2).size());
  }
}

TEST_F(HttpStreamTest, AnArchiveThatIsNotTheManifestsIsNotOpened) {
  ScriptedServer server([](const Request& request) {
    return (request.target.find("manifest") != std::string::npos ? first_ : second_)->serve(request);
  });
  Streaming s = streaming(server);
  EXPECT_FALSE(s.open());
  EXPECT_NE(s.stream->problem().find("the manifest says"), std::string::npos) << s.stream->problem();
}

TEST_F(HttpStreamTest, AServerWithoutRangesFailsTheFirstTime) {
  ScriptedServer server([](const Request& request) {
    Request whole = request;
    whole.fields.erase("range");
    return first_->serve(whole);
  });
  Streaming s = streaming(server);
  EXPECT_FALSE(s.open());
  EXPECT_NE(s.stream->problem().find("knows ranges"), std::string::npos) << s.stream->problem();
  EXPECT_EQ(server.requests().size(), 2U);
}

TEST_F(HttpStreamTest, WhatIsNoDatasetIsSaidToBeNone) {
  ScriptedServer server([](const Request&) { return ScriptedServer::reply(404, "", ""); });
  Streaming s = streaming(server);
  EXPECT_FALSE(s.open());
  EXPECT_NE(s.stream->problem().find("manifest.json: the server answers 404"), std::string::npos);
  server.setScript([](const Request&) { return ScriptedServer::reply(200, "", "<html>Welcome</html>"); });
  s = streaming(server);
  EXPECT_FALSE(s.open());
  EXPECT_NE(s.stream->problem().find("manifest.json"), std::string::npos) << s.stream->problem();
}

}  // namespace
}  // namespace terrane
