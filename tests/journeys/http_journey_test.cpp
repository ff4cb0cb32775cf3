#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "http_client.h"
#include "http_dataset.h"
#include "terrane/engine/terrain.h"
#include "terrane/engine/terrain_view.h"
#include "terrane/gpu/context.h"

/// What `terrane serve` serves, seen from far: files, tiles, pictures, and a view that outlives its server.
namespace terrane {
namespace {

class HttpJourney : public HttpDatasetTest {
 protected:
  static std::vector<std::string> serveAt(int port) {
    return {"serve", directory(), "--port", std::to_string(port), "-q"};
  }
  static std::string urlAt(int port) { return "http://127.0.0.1:" + std::to_string(port) + "/d/made"; }
};

TEST_F(HttpJourney, FilesTilesAndPicturesAreThoseOfTheDirectory) {
  Program server(serveAt(0));
  const int port = portOf(server.firstLine());
  ASSERT_GT(port, 0);
  serve::HttpClient client(port);
  const auto list = client.get("/datasets.json");
  ASSERT_TRUE(list);
  const std::string hash = nlohmann::json::parse(list->body)["datasets"][0]["hash"];
  for (const std::string& url : {urlAt(port), urlAt(port) + "/" + hash}) {
    expectFiles(url);
    expectTiles(url);
  }
  expectPicture(urlAt(port));
  expectPicture(urlAt(port) + "/manifest.json");
}

/// A view of the served dataset, drawn in software.
class View {
 public:
  explicit View(const std::string& url) {
    auto made = gpu::Context::createHeadless({.forceSoftware = true});
    EXPECT_TRUE(made.ok());
    context_ = std::move(*made);
    auto renderer = TerrainRenderer::create(*context_);
    EXPECT_TRUE(renderer.ok());
    renderer_ = std::move(*renderer);
    view_ = std::make_unique<TerrainView>(openHttpTransport(url, 8, 2.0), *workers_, renderer_.get(),
                                          ViewOptions{});
  }

  /// One frame. The view's clock runs ten times as fast, so that nobody waits long for another try.
  void frame(const Camera& camera) {
    now_ = 10.0 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
    const auto updated = view_->update(camera, now_);
    ASSERT_TRUE(updated.ok()) << updated.error().message;
    std::this_thread::yield();
  }
  /// Frames until something holds, each of them whole. False after five minutes.
  template <class Condition, class CameraAt>
  bool framesUntil(const CameraAt& cameraAt, const Condition& holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(5);
    for (int64_t i = 0; std::chrono::steady_clock::now() < deadline; ++i) {
      frame(cameraAt(i));
      if (!view_->cut().patches.empty()) expectWhole(cameraAt(i));
      if (::testing::Test::HasFailure()) return false;
      if (holds()) return true;
    }
    return false;
  }
  /// Ground under every pixel of a camera that sees nothing else, drawn from what is here.
  void expectWhole(const Camera& camera) {
    const auto places = renderer_->drawPositions(view_->cut(), view_->manifest().frame, camera);
    ASSERT_TRUE(places.ok()) << places.error().message;
    const auto sky = std::count_if(places->begin(), places->end(),
                                   [](const glm::dvec3& place) { return std::isnan(place.x); });
    ASSERT_EQ(sky, 0) << "with " << view_->cut().patches.size() << " patches";
    ++wholeFrames_;
  }

  TerrainView& operator*() { return *view_; }
  TerrainView* operator->() { return view_.get(); }
  TerrainRenderer& renderer() { return *renderer_; }
  int wholeFrames() const { return wholeFrames_; }

 private:
  std::unique_ptr<gpu::Context> context_;
  std::unique_ptr<TerrainRenderer> renderer_;
  std::unique_ptr<Workers> workers_ = makeThreadWorkers(1);
  std::unique_ptr<TerrainView> view_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  double now_ = 0.0;
  int wholeFrames_ = 0;
};

/// Of the steps of a colour, over all values.
double meanDifference(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(static_cast<int>(a[i]) - static_cast<int>(b[i]));
  return sum / static_cast<double>(std::max<size_t>(a.size(), 1));
}

std::set<std::tuple<int, int, int, int, int>> patchesOf(const Cut& cut) {
  std::set<std::tuple<int, int, int, int, int>> out;
  for (const Patch& patch : cut.patches)
    out.insert({patch.triangle.diamond.x, patch.triangle.diamond.y, patch.triangle.diamond.level,
                patch.triangle.apex.x, patch.triangle.apex.y});
  return out;
}

TEST_F(HttpJourney, AViewOutlivesItsServer) {
  auto terrain = Terrain::open(directory(), {.forceSoftware = true});
  ASSERT_TRUE(terrain.ok());
  const GroundBox box = (*terrain)->groundBox();
  const glm::dvec3 middle = 0.5 * (box.low + box.high);
  const double side = box.high.x - box.low.x;
  // Down upon the ground, on a way that shows new ground all the time and never the edge.
  const auto above = [&](double share) {
    const glm::dvec3 at = middle + glm::dvec3(0.3 * side * (share - 0.5), 0.2 * side * (0.5 - share), 0.0);
    return lookAt({at.x, at.y, box.high.z + 0.1 * side}, {at.x + 0.02 * side, at.y + 0.05 * side, 0.0}, 0.9,
                  128, 72);
  };

  auto server = std::make_unique<Program>(serveAt(0));
  const int port = portOf(server->firstLine());
  ASSERT_GT(port, 0);
  View view(urlAt(port));

  // Killed with answers on their way, when the first ground is drawn.
  ASSERT_TRUE(view.framesUntil(
      [&](int64_t) { return above(0.0); },
      [&] { return !view->cut().patches.empty() && view->report().stream.requestsUnderway > 0; }));
  server->signal(SIGKILL);
  EXPECT_EQ(server->wait(), -1);
  EXPECT_FALSE(view->isSettled());

  // Away: the flight goes on over what is here, coarse and whole.
  int64_t flown = 0;
  ASSERT_TRUE(view.framesUntil(
      [&](int64_t i) { return above(std::min(1.0, 0.005 * static_cast<double>(flown = i))); },
      [&] { return flown >= 200 && view->report().stream.isOffline; }));
  EXPECT_FALSE(view->isSettled());
  EXPECT_NE(view->problem(), "");

  // Back at the same port: everything comes.
  server = std::make_unique<Program>(serveAt(port));
  ASSERT_EQ(portOf(server->firstLine()), port);
  const Camera last = above(1.0);
  ASSERT_TRUE(view.framesUntil([&](int64_t) { return last; }, [&] { return view->isSettled(); }));
  EXPECT_FALSE(view->report().stream.isOffline);
  EXPECT_EQ(view->report().stream.tilesLost, 0U);
  EXPECT_GT(view.wholeFrames(), 200);

  // And is the same as from the disk: cut and ground. Of the picture over it, who came over other ground has
  // some finer texels still.
  const auto expected = (*terrain)->selectAndLoad(last, {});
  ASSERT_TRUE(expected.ok());
  EXPECT_EQ(patchesOf(view->cut()), patchesOf(*expected));
  const auto far = view.renderer().drawPicture(view->cut(), view->manifest().frame, last, {});
  ASSERT_TRUE(far.ok()) << far.error().message;
  view->setShowImagery(false);
  const auto farBare = view.renderer().drawPicture(view->cut(), view->manifest().frame, last, {});
  ASSERT_TRUE(farBare.ok()) << farBare.error().message;
  // note: the disk's picture makes a context of its own, which is the current one from then on.
  const auto near = (*terrain)->draw(*expected, last, {});
  ASSERT_TRUE(near.ok()) << near.error().message;
  EXPECT_LT(meanDifference(near->rgba, far->rgba), 2.0);
  ASSERT_TRUE((*terrain)->showImagery({}).ok());
  const auto nearBare = (*terrain)->draw(*expected, last, {});
  ASSERT_TRUE(nearBare.ok()) << nearBare.error().message;
  EXPECT_TRUE(nearBare->rgba == farBare->rgba);
  EXPECT_GT(meanDifference(nearBare->rgba, near->rgba), 4.0) << "the picture over the ground shows nothing";
}

}  // namespace
}  // namespace terrane
