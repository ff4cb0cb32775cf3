#include "terrane/engine/surface.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <thread>

#include "function_source.h"
#include "terrane/bake/build.h"
#include "terrane/engine/elevation_query.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;

/// Rough ground with a lake, coarse all over and twice finer in one part.
class SurfaceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(fs::temp_directory_path() / ("terrane_surface_" + std::to_string(getpid())));
    fs::create_directories(*folder_);
    const auto ground = [](int64_t shift) {
      return [shift](int64_t x, int64_t y) {
        const double u = static_cast<double>(x << shift), v = static_cast<double>(y << shift);
        if (std::hypot(u - 900.0, v - 500.0) < 120.0) return std::nanf("");
        return roughGround(x << shift, y << shift, 3);
      };
    };
    const FunctionSource source({{1, 0, 0, 450, 400, ground(1)}, {2, 300, 250, 620, 610, ground(0)}}, 0.25,
                                0.0);
    BuildOptions options;
    options.output = (*folder_ / "made.terrane").string();
    SilentProgress progress;
    const auto report = buildDataset(source, options, progress);
    ASSERT_TRUE(report.ok()) << report.error().message;
    auto dataset = Dataset::open(options.output);
    ASSERT_TRUE(dataset.ok()) << dataset.error().message;
    dataset_ = new Dataset(std::move(dataset).value());
  }
  static void TearDownTestSuite() {
    delete dataset_;
    fs::remove_all(*folder_);
    delete folder_;
  }
  static fs::path* folder_;
  static Dataset* dataset_;
};
fs::path* SurfaceTest::folder_ = nullptr;
Dataset* SurfaceTest::dataset_ = nullptr;

TEST_F(SurfaceTest, GivesTheSameHeightsAsAQueryTileByTileWhateverTheBudget) {
  ElevationQuery query(*dataset_);
  const Frame& frame = dataset_->manifest().frame;
  for (const uint64_t budget : {uint64_t{1}, uint64_t{64} << 20}) {
    SurfaceTiles tiles(*dataset_, budget);
    Surface surface(tiles);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-40.0, 1070.0);
    int ground = 0, nothing = 0;
    for (int i = 0; i < (budget == 1 ? 200 : 5000); ++i) {
      const glm::dvec2 sample(place(random), place(random));
      const auto a = surface.heightAt(sample);
      const auto b = query.heightAt(frame.localFromSample(sample));
      ASSERT_TRUE(a.ok() && b.ok());
      ASSERT_EQ(a->has_value(), b->has_value()) << sample.x << " " << sample.y;
      if (*a) {
        // Going through metres rounds the place.
        ASSERT_NEAR(**a, **b, 1e-6);
      }
      ++(*a ? ground : nothing);
    }
    EXPECT_GT(ground, 20);
    EXPECT_GT(nothing, 20);
    EXPECT_LE(tiles.statistics().bytes, std::max<uint64_t>(budget, 500000));
  }
}

TEST_F(SurfaceTest, GroundHasItsBorder) {
  SurfaceTiles tiles(*dataset_, uint64_t{64} << 20);
  Surface surface(tiles);
  // Where a cell is ground, so are its corners and edges: around the lake, where levels meet, at the end of
  // the data.
  int checked = 0;
  const auto check = [&](int col, int row) {
    const auto middle = surface.heightAt({col + 0.5, row + 0.5});
    ASSERT_TRUE(middle.ok());
    if (!*middle) return;
    for (const glm::dvec2 at :
         {glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(0, 1), glm::dvec2(1, 1), glm::dvec2(0.3, 0),
          glm::dvec2(0.3, 1), glm::dvec2(0, 0.3), glm::dvec2(1, 0.3), glm::dvec2(1.0 + 1e-9, 1.0 + 1e-9)}) {
      const auto height = surface.heightAt(glm::dvec2(col, row) + at);
      ASSERT_TRUE(height.ok());
      EXPECT_TRUE(*height) << col + at.x << " " << row + at.y;
    }
    ++checked;
  };
  for (int i = 0; i < 700; ++i) {
    check(i, 500);
    check(900, i);
    check(i, 798);
    check(898, i);
    check(i, 249);
    check(918, i + 250);
  }
  EXPECT_GT(checked, 1000);

  // The last row of samples, from end to end.
  const Manifest& manifest = dataset_->manifest();
  const auto south = static_cast<double>(manifest.extentRows - 1),
             east = static_cast<double>(manifest.extentCols - 1);
  for (const auto& [from, to] : {std::pair{glm::dvec2(310.0, south), glm::dvec2(900.0, south)},
                                 std::pair{glm::dvec2(east, 630.0), glm::dvec2(east, 790.0)}}) {
    const auto pieces = surface.along(from, to, 10000);
    ASSERT_TRUE(pieces.ok());
    for (const SurfacePiece& piece : *pieces) {
      EXPECT_TRUE(piece.isGround) << piece.begin;
      const auto height = surface.heightAt(from + (piece.begin + 1e-9) * (to - from));
      ASSERT_TRUE(height.ok() && *height);
      EXPECT_NEAR(piece.beginHeight, **height, 0.01);
    }
  }
  // Beyond it there is none.
  EXPECT_FALSE(surface.heightAt({400.0, south + 1e-3}).value());
  EXPECT_FALSE(surface.heightAt({-1e-3, 100.0}).value());
}

TEST_F(SurfaceTest, PiecesOfALineAreTheSurfaceExactly) {
  SurfaceTiles tiles(*dataset_, uint64_t{64} << 20);
  Surface surface(tiles);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> place(-60.0, 1090.0);
  size_t pieces = 0;
  for (int i = 0; i < 300; ++i) {
    glm::dvec2 from(place(random), place(random)), to(place(random), place(random));
    // Some lie along the lattice's lines and diagonals, from sample to sample, or are no lines at all.
    if (i % 6 == 1) from = glm::round(from), to = glm::dvec2(from.x, std::round(to.y));
    if (i % 6 == 2)
      from = glm::round(from),
      to = from + glm::dvec2(1.0, i % 4 < 2 ? 1.0 : -1.0) * std::round(place(random) / 3.0);
    if (i % 6 == 3) to = glm::dvec2(to.x, from.y);
    if (i % 6 == 4) from = glm::round(from), to = glm::round(to);
    if (i % 60 == 5) to = from;
    const auto found = surface.along(from, to, 100000);
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_EQ(found->front().begin, 0.0);
    ASSERT_EQ(found->back().end, 1.0);
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    double end = 0.0;
    for (const SurfacePiece& piece : *found) {
      ASSERT_EQ(piece.begin, end) << "line " << i;
      ASSERT_LE(piece.begin, piece.end);
      end = piece.end;
      // note: where a line runs along an edge between void and ground, either may be told.
      if ((piece.end - piece.begin) * length < 1e-6 || i % 6 == 1 || i % 6 == 4 || i % 6 == 2) continue;
      for (const double share : {0.01, 0.5, 0.77, 0.99}) {
        const double t = piece.begin + share * (piece.end - piece.begin);
        const auto height = surface.heightAt(from + t * (to - from));
        ASSERT_TRUE(height.ok());
        ASSERT_EQ(height->has_value(), piece.isGround) << "line " << i << " at " << t;
        if (piece.isGround) {
          ASSERT_NEAR(**height, piece.beginHeight + share * (piece.endHeight - piece.beginHeight), 1e-6)
              << "line " << i;
        }
      }
    }
    // Lines on the lattice's own lines: wherever both say ground, the height is the same.
    for (const SurfacePiece& piece : *found) {
      if (!piece.isGround) continue;
      const double t = 0.5 * (piece.begin + piece.end);
      const auto height = surface.heightAt(from + t * (to - from));
      if (height.ok() && *height) {
        ASSERT_NEAR(**height, 0.5 * (piece.beginHeight + piece.endHeight), 1e-6) << "line " << i;
      }
    }
    pieces += found->size();
  }
  EXPECT_GT(pieces, 50000U);
}

TEST_F(SurfaceTest, RefusesALineOfTooManyPieces) {
  SurfaceTiles tiles(*dataset_, uint64_t{64} << 20);
  Surface surface(tiles);
  const auto found = surface.along({10.0, 20.0}, {800.0, 700.0}, 100);
  ASSERT_FALSE(found.ok());
  EXPECT_NE(found.error().message.find("100"), std::string::npos);
}

TEST_F(SurfaceTest, ManyThreadsAgree) {
  SurfaceTiles tiles(*dataset_, uint64_t{2} << 20);
  std::vector<std::vector<double>> heights(4);
  std::vector<std::thread> threads;
  for (auto& mine : heights) {
    threads.emplace_back([&mine, &tiles] {
      Surface surface(tiles);
      std::mt19937 random(9);
      std::uniform_real_distribution<double> place(0.0, 900.0);
      for (int i = 0; i < 300; ++i) {
        const auto height = surface.heightAt({place(random), place(random)});
        mine.push_back(height.ok() ? height->value_or(-1.0) : -2.0);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& mine : heights) EXPECT_EQ(mine, heights[0]);
  EXPECT_LE(tiles.statistics().bytes, uint64_t{2} << 20);
}

}  // namespace
}  // namespace terrane
