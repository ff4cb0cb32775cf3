#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <random>
#include <set>

#include "function_source.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/engine/surface.h"

/// Rays against the surface, and surfaces of which only some tiles are here, by brute force.
namespace terrane {
namespace {

/// A surface of which some tiles are not here.
class PartOfSurface final : public SurfaceSource {
 public:
  PartOfSurface(SurfaceTiles& all, std::function<bool(TileId)> isHere)
      : all_(all), isHere_(std::move(isHere)) {}
  const Manifest& manifest() const override { return all_.manifest(); }
  Result<std::shared_ptr<const Tile>> get(TileId id, const Tile* parent) override {
    if (!isHere_(id)) return std::shared_ptr<const Tile>();
    return all_.get(id, parent);
  }

 private:
  SurfaceTiles& all_;
  std::function<bool(TileId)> isHere_;
};

class SurfaceRaysTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory();
    const auto ground = [](int64_t x, int64_t y) {
      const double u = static_cast<double>(x), v = static_cast<double>(y);
      if (std::hypot(u - 700.0, v - 400.0) < 90.0) return std::nanf("");
      return roughGround(x, y, 5);
    };
    const FunctionSource source({{2, 0, 0, 1000, 900, ground}}, 0.25, 0.5);
    BuildOptions options;
    options.output = folder_->file("made.terrane");
    SilentProgress progress;
    const auto report = buildDataset(source, options, progress);
    ASSERT_TRUE(report.ok()) << report.error().message;
    auto dataset = Dataset::open(options.output);
    ASSERT_TRUE(dataset.ok()) << dataset.error().message;
    dataset_ = new Dataset(std::move(dataset).value());
    tiles_ = new SurfaceTiles(*dataset_, uint64_t{64} << 20);
  }
  static void TearDownTestSuite() {
    delete tiles_;
    delete dataset_;
    delete folder_;
  }
  /// Rays of all kinds that come from above the ground, or not.
  static std::pair<glm::dvec3, glm::dvec3> ray(std::mt19937& random, int i) {
    const Manifest& manifest = dataset_->manifest();
    std::uniform_real_distribution<double> place(-60.0, 1080.0);
    std::uniform_real_distribution<double> height(manifest.minHeight - 20.0, manifest.maxHeight + 60.0);
    glm::dvec3 from(place(random), place(random), height(random)),
        to(place(random), place(random), height(random));
    if (i % 4 != 0) from.z = manifest.maxHeight + 50.0;
    if (i % 7 == 1) to = {from.x, from.y, manifest.minHeight - 50.0};  // straight down
    if (i % 7 == 2) from = glm::round(from), to.y = from.y;            // along lines of the lattice
    if (i % 7 == 3) from = glm::round(from), to = from + glm::dvec3(200.0, 200.0, to.z - from.z);
    return {from, to};
  }
  static TemporaryDirectory* folder_;
  static Dataset* dataset_;
  static SurfaceTiles* tiles_;
};
TemporaryDirectory* SurfaceRaysTest::folder_ = nullptr;
Dataset* SurfaceRaysTest::dataset_ = nullptr;
SurfaceTiles* SurfaceRaysTest::tiles_ = nullptr;

TEST_F(SurfaceRaysTest, FirstHitIsTheFirstOfAllPiecesExactly) {
  Surface surface(*tiles_);
  std::mt19937 random(11);
  int hits = 0, misses = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto [from, to] = ray(random, i);
    const auto hit = surface.firstHit(from, to);
    ASSERT_TRUE(hit.ok()) << hit.error().message;
    // Every triangle on the way, none passed over.
    const auto pieces = surface.along(glm::dvec2(from), glm::dvec2(to), 1000000);
    ASSERT_TRUE(pieces.ok());
    std::optional<double> first;
    for (const SurfacePiece& piece : *pieces) {
      if (!piece.isGround) continue;
      const double a = from.z + piece.begin * (to.z - from.z) - piece.beginHeight;
      const double b = from.z + piece.end * (to.z - from.z) - piece.endHeight;
      if ((a < 0.0 && b >= 0.0) || (a > 0.0 && b <= 0.0)) {
        first = piece.begin + a / (a - b) * (piece.end - piece.begin);
        break;
      }
    }
    ASSERT_EQ(hit->has_value(), first.has_value()) << i;
    if (!first) {
      ++misses;
      continue;
    }
    ++hits;
    ASSERT_NEAR((*hit)->share, *first, 1e-9) << i;
    const auto ground = surface.heightAt(glm::dvec2(from + (*hit)->share * (to - from)));
    ASSERT_TRUE(ground.ok());
    if (*ground) {
      ASSERT_NEAR((*hit)->height, **ground, 1e-5) << i;
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(misses, 200);
}

TEST_F(SurfaceRaysTest, WhateverIsHereARayIsStoppedWhereDenseSamplingStopsIt) {
  std::mt19937 random(12);
  int hits = 0;
  for (int round = 0; round < 12; ++round) {
    // A random part of the pyramid, parents with their children.
    std::set<TileId> here = {TileId{}};
    const std::function<void(TileId)> grow = [&](TileId id) {
      for (int quadrant = 0; quadrant < 4; ++quadrant)
        if (random() % 3 != 0 && id.level < 2) here.insert(id.child(quadrant)), grow(id.child(quadrant));
    };
    grow(TileId{});
    PartOfSurface part(*tiles_, [&](TileId id) { return here.count(id) != 0; });
    Surface surface(part);
    for (int i = 0; i < 60; ++i) {
      const auto [from, to] = ray(random, 4 * i + 1);
      const auto hit = surface.firstHit(from, to);
      ASSERT_TRUE(hit.ok()) << hit.error().message;
      const double until = *hit ? (*hit)->share : 1.0;
      // Nowhere before does it change sides; only out of a void may it come below the ground.
      constexpr int kSteps = 20000;
      int side = 0;
      for (int k = 0; k < kSteps; ++k) {
        const double t = until * k / kSteps;
        const glm::dvec3 at = from + t * (to - from);
        const auto ground = surface.heightAt(glm::dvec2(at));
        ASSERT_TRUE(ground.ok());
        const double above = *ground ? at.z - **ground : 0.0;
        if (side != 0 && std::abs(above) > 1e-6) {
          ASSERT_GT(side * above, 0.0) << round << " " << i << " at " << t << " of " << until;
        }
        side = !*ground ? 0 : above > 1e-6 ? 1 : above < -1e-6 ? -1 : side;
      }
      hits += hit->has_value();
    }
  }
  EXPECT_GT(hits, 300);
}

TEST_F(SurfaceRaysTest, TheStatedErrorIsABoundWhateverIsHere) {
  Surface all(*tiles_);
  std::mt19937 random(13);
  std::uniform_real_distribution<double> place(0.0, 1000.0);
  const double exact = dataset_->manifest().maxErrorMeters;
  for (int level = 0; level <= dataset_->manifest().frame.finestLevel; ++level) {
    PartOfSurface part(*tiles_, [&](TileId id) { return id.level <= level; });
    Surface surface(part);
    double most = 0.0, mostStated = 0.0;
    int count = 0;
    for (int i = 0; i < 20000; ++i) {
      // At samples the source's own heights are known: within the dataset's bound of the finest surface.
      const glm::dvec2 sample(std::round(place(random)), std::round(place(random)));
      const auto height = surface.heightAt(sample), stated = surface.errorAt(sample),
                 finest = all.heightAt(sample);
      ASSERT_TRUE(height.ok() && stated.ok() && finest.ok());
      ASSERT_EQ(height->has_value(), stated->has_value());
      if (!*height || !*finest) continue;
      const double source =
          static_cast<double>(roughGround(static_cast<int64_t>(sample.x), static_cast<int64_t>(sample.y), 5));
      ASSERT_LE(std::abs(**height - source), **stated + 1e-6) << level;
      most = std::max(most, std::abs(**height - source));
      mostStated = std::max(mostStated, **stated);
      ++count;
    }
    EXPECT_GT(count, 10000);
    // It is no wild claim either.
    EXPECT_LT(mostStated, level == 2 ? exact + 1e-9 : 20.0 * most) << level;
  }
}

TEST_F(SurfaceRaysTest, NothingIsHereIsAnAnswerToo) {
  PartOfSurface none(*tiles_, [](TileId) { return false; });
  Surface surface(none);
  EXPECT_FALSE(surface.heightAt({10.0, 10.0})->has_value());
  EXPECT_FALSE(surface.errorAt({10.0, 10.0})->has_value());
  EXPECT_FALSE(surface.firstHit({10.0, 10.0, 9000.0}, {500.0, 500.0, -9000.0})->has_value());
  const auto pieces = surface.along({10.0, 10.0}, {500.0, 500.0}, 100);
  ASSERT_TRUE(pieces.ok());
  ASSERT_EQ(pieces->size(), 1U);
  EXPECT_FALSE(pieces->front().isGround);
}

}  // namespace
}  // namespace terrane
