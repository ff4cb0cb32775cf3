#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>

#include "function_source.h"
#include "source_support.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/bake/verify.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"

/// Adding to a dataset gives, byte by byte, what building all of it at once would have given.
namespace terrane::test {
namespace {

namespace fs = std::filesystem;

constexpr int kVoid = -9999;

/// Are two files the same? Says where they begin to differ.
void expectSame(const std::string& one, const std::string& other) {
  const std::string a = readWholeFile(one);
  const std::string b = readWholeFile(other);
  const auto at = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first - a.begin();
  EXPECT_TRUE(a == b) << one << " has " << a.size() << " bytes, " << other << " " << b.size()
                      << "; they differ from byte " << at << ": " << a.substr(static_cast<size_t>(at), 60);
}

/// Integer heights at samples [col, col + width) x [row, row + height) of one lattice of 10 m.
MadeRaster windowOf(int col, int row, int width, int height, const std::function<int(int, int)>& heightAt) {
  MadeRaster made;
  made.width = width;
  made.height = height;
  made.type = GDT_Int16;
  made.geoTransform = {499995.0 + 10.0 * col, 10.0, 0.0, 5000005.0 - 10.0 * row, 0.0, -10.0};
  made.crs = "EPSG:2056";
  made.noData = kVoid;
  made.heightAt = [=](int x, int y) { return static_cast<double>(heightAt(col + x, row + y)); };
  return made;
}

int ground(int x, int y) {
  return static_cast<int>(std::lround(roughGround(x, y, 4)));
}

/// A source whose readers give up after some tiles in all.
class Breaking final : public Source {
 public:
  Breaking(const Source& source, int tiles) : source_(source), left_(tiles) {}
  const SourcePlan& plan() const override { return source_.plan(); }
  std::vector<int> nativeLevels() const override { return source_.nativeLevels(); }
  bool mayTouch(TileId id) const override { return source_.mayTouch(id); }
  const AppendBase* base() const override { return source_.base(); }
  Result<std::unique_ptr<SourceReader>> openReader() const override {
    if (left_.fetch_sub(1) <= 0) return makeError("the disk fell off the table");
    TERRANE_ASSIGN(auto reader, source_.openReader());
    return std::unique_ptr<SourceReader>(new Reader(std::move(reader), left_));
  }

 private:
  class Reader final : public SourceReader {
   public:
    Reader(std::unique_ptr<SourceReader> reader, std::atomic<int>& left)
        : reader_(std::move(reader)), left_(left) {}
    Result<bool> readTile(TileId id, std::span<float> heights, std::span<uint16_t> ranks) override {
      if (left_.fetch_sub(1) <= 0) return makeError("the disk fell off the table");
      return reader_->readTile(id, heights, ranks);
    }

   private:
    std::unique_ptr<SourceReader> reader_;
    std::atomic<int>& left_;
  };
  const Source& source_;
  mutable std::atomic<int> left_;
};

class AppendTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  Result<BuildReport> build(const Source& source, const std::string& name, int threads = 2) {
    BuildOptions options;
    options.output = path(name);
    options.threads = threads;
    SilentProgress progress;
    return buildDataset(source, options, progress);
  }
  Result<BuildReport> buildOf(const std::vector<std::string>& inputs, const std::string& name) {
    return build(*open(from(inputs)), name);
  }
  Result<BuildReport> append(const std::vector<std::string>& inputs, const std::string& name,
                             int threads = 2) {
    SilentProgress progress;
    TERRANE_ASSIGN(const auto source, openAppendedSource(from(inputs), path(name), progress));
    return build(*source, name, threads);
  }
  std::string appendError(const std::vector<std::string>& inputs, const std::string& name) {
    const std::string before = readWholeFile(path(name) + "/manifest.json");
    const auto report = append(inputs, name);
    EXPECT_EQ(readWholeFile(path(name) + "/manifest.json"), before);
    EXPECT_FALSE(fs::exists(path(name) + ".partial"));
    return report.ok() ? "no error" : report.error().message;
  }

  /// Builds x/a.terrane of `before`, without which it then adds `added`, and y/a.terrane of both.
  BuildReport sameAsWhole(const std::vector<MadeRaster>& before, const std::vector<MadeRaster>& added) {
    fs::remove_all(path("x"));
    fs::remove_all(path("y"));
    fs::create_directories(path("x"));
    fs::create_directories(path("y"));
    std::vector<std::string> old, fresh;
    for (size_t i = 0; i < before.size(); ++i) {
      old.push_back(path("old" + std::to_string(i) + ".tif"));
      writeRaster(old.back(), before[i]);
    }
    for (size_t i = 0; i < added.size(); ++i) {
      fresh.push_back(path("new" + std::to_string(i) + ".tif"));
      writeRaster(fresh.back(), added[i]);
    }
    std::vector<std::string> all = old;
    all.insert(all.end(), fresh.begin(), fresh.end());
    const auto whole = buildOf(all, "y/a.terrane");
    EXPECT_TRUE(whole.ok()) << whole.error().message;
    const auto first = buildOf(old, "x/a.terrane");
    EXPECT_TRUE(first.ok()) << first.error().message;
    for (const std::string& file : old) fs::remove(file);
    const auto report = append(fresh, "x/a.terrane");
    EXPECT_TRUE(report.ok()) << report.error().message;
    for (const char* file : {"/elevation.pmtiles", "/manifest.json"})
      expectSame(path("x/a.terrane") + file, path("y/a.terrane") + file);
    EXPECT_FALSE(fs::exists(path("x/a.terrane.partial")));
    return report.ok() ? *report : BuildReport{};
  }

  TempFolder folder_;
};

TEST_F(AppendTest, TwoHalvesAreTheWhole) {
  // The second half grows the dataset to the east; the halves share a column, or leave one out between them.
  for (const int gap : {0, 1, -1, 40}) {
    const BuildReport report =
        sameAsWhole({windowOf(0, 0, 1100, 1000, ground)}, {windowOf(1100 + gap, 0, 900 - gap, 1000, ground)});
    EXPECT_GT(report.tilesCopied, 5U);
    EXPECT_LT(report.tilesCopied, report.tiles);
  }
  // And to the south, where tiles begin exactly at the seam.
  sameAsWhole({windowOf(0, 0, 1100, 513, ground)}, {windowOf(0, 512, 1100, 500, ground)});
}

TEST_F(AppendTest, AnUpdateInTheMiddleLeavesTheRestAsItIs) {
  const auto higher = [](int x, int y) { return ground(x, y) + 3; };
  const BuildReport report =
      sameAsWhole({windowOf(0, 0, 2000, 2000, ground)}, {windowOf(1300, 1290, 200, 60, higher)});
  EXPECT_GT(report.tilesCopied * 10, report.tiles * 7) << report.tilesCopied << " of " << report.tiles;
}

TEST_F(AppendTest, TheSameHeightsAgainChangeNothing) {
  const BuildReport report =
      sameAsWhole({windowOf(0, 0, 1000, 700, ground)}, {windowOf(300, 290, 200, 260, ground)});
  EXPECT_EQ(report.tilesCopied, report.tiles);
}

TEST_F(AppendTest, AFileThatIsThereAlreadyIsToldOf) {
  writeRaster(path("a.tif"), windowOf(0, 0, 300, 300, ground));
  writeRaster(path("b.tif"), windowOf(200, 0, 300, 300, ground));
  ASSERT_TRUE(buildOf({path("a.tif")}, "a.terrane").ok());
  fs::copy_file(path("a.tif"), path("copy.tif"));
  ListeningProgress listening;
  ASSERT_TRUE(openAppendedSource(from({path("copy.tif"), path("b.tif")}), path("a.terrane"), listening).ok());
  ASSERT_EQ(listening.warnings.size(), 1U) << listening.all();
  EXPECT_HAS(listening.all(), "copy.tif: is in the dataset already, as a.tif");
}

TEST_F(AppendTest, HolesAreFilled) {
  const auto hole = [](int x, int y) { return std::hypot(x - 700, y - 600) < 150 ? kVoid : ground(x, y); };
  const auto lone = [](int x, int y) { return noiseAt(x, y, 8) < 0.002 ? ground(x, y) : kVoid; };
  const auto islands = [](int x, int y) { return noiseAt(x / 40, y / 40, 9) < 0.3 ? kVoid : ground(x, y); };
  const auto filling = [](int x, int y) { return std::hypot(x - 700, y - 600) < 160 ? 100 : kVoid; };
  sameAsWhole({windowOf(0, 0, 1300, 1100, hole)}, {windowOf(500, 400, 400, 400, filling)});
  sameAsWhole({windowOf(0, 0, 1300, 1100, islands)}, {windowOf(500, 400, 400, 400, filling)});
  // Samples that stand alone are no ground, but are there.
  sameAsWhole({windowOf(0, 0, 1300, 1100, lone)}, {windowOf(500, 400, 400, 400, filling)});
  sameAsWhole({windowOf(0, 0, 1300, 1100, hole)}, {windowOf(0, 0, 1300, 1100, lone)});
}

TEST_F(AppendTest, GroundThatWasLeftToInterpolationComesBack) {
  // Flat and evenly sloped ground, of which hardly a tile is stored.
  const auto sea = [](int x, int y) { return x > 1200 && y > 900 ? ground(x, y) : 0; };
  const auto slope = [](int x, int y) { return 2 * x + 4 * y; };
  for (const auto& smooth : {std::function<int(int, int)>(sea), std::function<int(int, int)>(slope)}) {
    sameAsWhole({windowOf(0, 0, 1500, 1100, smooth)}, {windowOf(20, 30, 100, 100, ground)});
    sameAsWhole({windowOf(0, 0, 1500, 1100, ground)}, {windowOf(20, 30, 900, 900, smooth)});
  }
}

TEST_F(AppendTest, TheHeightRangeMayGrow) {
  // A little, upwards; and far beyond what the range codes reach.
  int highest = ground(0, 0);
  for (int y = 0; y < 1100; ++y)
    for (int x = 0; x < 1500; ++x) highest = std::max(highest, ground(x, y));
  const int little = highest + 3;
  for (const int peak : {little, 30000, -30000}) {
    const auto mountain = [=](int, int) { return peak; };
    const BuildReport report =
        sameAsWhole({windowOf(0, 0, 1500, 1100, ground)}, {windowOf(1400, 1000, 20, 20, mountain)});
    if (peak == little) {
      EXPECT_GT(report.tilesCopied * 2, report.tiles);
    }
  }
}

TEST_F(AppendTest, SeveralOneAfterAnotherWithStepAndOffset) {
  auto first = windowOf(0, 0, 1100, 800, ground);
  first.scale = 0.1;
  first.offset = 1000.0;
  auto second = first;
  second.geoTransform[0] += 4000.0;
  auto third = windowOf(100, 100, 90, 90, [](int, int) { return 7; });
  third.scale = first.scale;
  third.offset = first.offset;
  third.geoTransform[3] -= 10.0 * (third.height - 1);  // runs north
  third.geoTransform[3] -= 10.0;
  third.geoTransform[5] = 10.0;
  sameAsWhole({first}, {second, third});
  sameAsWhole({first, second}, {third});
}

TEST_F(AppendTest, GoesOnAfterItWasKilled) {
  writeRaster(path("a.tif"), windowOf(0, 0, 1000, 1000, ground));
  writeRaster(path("b.tif"), windowOf(600, 700, 200, 200, [](int, int) { return 44; }));
  fs::create_directories(path("whole"));
  ASSERT_TRUE(buildOf({path("a.tif"), path("b.tif")}, "whole/a.terrane").ok());
  ASSERT_TRUE(buildOf({path("a.tif")}, "a.terrane").ok());
  const std::string before = readWholeFile(path("a.terrane/manifest.json"));
  std::string plan;
  {
    SilentProgress progress;
    const auto source = openAppendedSource(from({path("b.tif")}), path("a.terrane"), progress);
    ASSERT_TRUE(source.ok()) << source.error().message;
    const auto failed = build(Breaking(**source, 9), "a.terrane");
    ASSERT_FALSE(failed.ok());
    EXPECT_HAS(failed.error().message, "the disk fell off the table");
    EXPECT_EQ(readWholeFile(path("a.terrane/manifest.json")), before);
    plan = readWholeFile(path("a.terrane.partial/plan"));
    EXPECT_HAS(plan, "append " + sha256(before));
  }
  const auto report = append({path("b.tif")}, "a.terrane", 3);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GE(report->stages[0].jobsResumed, 6);
  const auto expectWhole = [&] {
    for (const char* file : {"/elevation.pmtiles", "/manifest.json"})
      expectSame(path("a.terrane") + file, path("whole/a.terrane") + file);
    EXPECT_FALSE(fs::exists(path("a.terrane.partial")));
  };
  expectWhole();

  // As it looks right after the last rename: the same command finds that it is done, and adds nothing twice.
  fs::create_directories(path("a.terrane.partial/dataset"));
  std::ofstream(path("a.terrane.partial/plan"))
      << plan << "committed " << sha256(readWholeFile(path("a.terrane/manifest.json"))) << "\n";
  const auto again = append({path("b.tif")}, "a.terrane");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_TRUE(again->stages.empty());
  expectWhole();

  // Work upon a dataset that has been replaced since is of no use.
  ASSERT_TRUE(buildOf({path("a.tif")}, "c.terrane").ok());
  {
    SilentProgress progress;
    const auto source = openAppendedSource(from({path("b.tif")}), path("c.terrane"), progress);
    ASSERT_FALSE(build(Breaking(**source, 9), "c.terrane").ok());
    writeRaster(path("d.tif"), windowOf(0, 0, 1000, 1000, [](int x, int y) { return ground(x, y) + 1; }));
    fs::rename(path("c.terrane.partial"), path("aside"));
    fs::remove_all(path("c.terrane"));
    ASSERT_TRUE(buildOf({path("d.tif")}, "c.terrane").ok());
    const auto late = build(**source, "c.terrane");
    ASSERT_FALSE(late.ok());
    EXPECT_HAS(late.error().message, "was replaced");
    fs::rename(path("aside"), path("c.terrane.partial"));
  }
  const auto afresh = append({path("b.tif")}, "c.terrane");
  ASSERT_TRUE(afresh.ok()) << afresh.error().message;
  EXPECT_EQ(afresh->stages[0].jobsResumed, 0);
}

TEST_F(AppendTest, SaysWhyAWholeBuildIsNeeded) {
  writeRaster(path("base.tif"), windowOf(0, 0, 600, 500, ground));
  ASSERT_TRUE(buildOf({path("base.tif")}, "base.terrane").ok());
  const auto refused = [&](const MadeRaster& made) {
    writeRaster(path("new.tif"), made);
    const std::string message = appendError({path("new.tif")}, "base.terrane");
    EXPECT_HAS(message, "new.tif");
    EXPECT_HAS(message, "build the dataset anew");
    return message;
  };
  EXPECT_HAS(refused(windowOf(-1, 0, 50, 50, ground)), "western edge");
  EXPECT_HAS(refused(windowOf(0, -1, 50, 50, ground)), "northern edge");
  EXPECT_HAS(refused(windowOf(1000, 0, 50, 50, ground)), "1025 x 1025");
  EXPECT_HAS(refused(windowOf(0, 1000, 50, 50, ground)), "1025 x 1025");
  auto made = windowOf(5, 5, 50, 50, ground);
  made.type = GDT_Float32;
  EXPECT_HAS(refused(made), "not integers");
  made = windowOf(5, 5, 50, 50, ground);
  made.scale = 0.5;
  EXPECT_HAS(refused(made), "steps of 0.5 m");
  made = windowOf(5, 5, 50, 50, ground);
  made.offset = 3.0;
  EXPECT_HAS(refused(made), "from 3 m");
  made = windowOf(5, 5, 50, 50, ground);
  made.crs = "EPSG:32633";
  EXPECT_HAS(refused(made), "CRS");
  made = windowOf(5, 5, 50, 50, ground);
  made.geoTransform[0] += 4.0;
  EXPECT_HAS(refused(made), "between");
  made = windowOf(5, 5, 50, 50, ground);
  made.geoTransform[1] = 20.0;
  made.geoTransform[5] = -20.0;
  EXPECT_HAS(refused(made), "20 x 20 apart");
  made = windowOf(5, 5, 50, 50, ground);
  made.geoTransform[2] = made.geoTransform[4] = 5.0;
  EXPECT_HAS(refused(made), "turned");

  // The last sample of the world is still in it.
  writeRaster(path("edge.tif"), windowOf(1000, 1000, 25, 25, ground));
  const auto edge = append({path("edge.tif")}, "base.terrane");
  EXPECT_TRUE(edge.ok()) << edge.error().message;

  // Datasets that cannot be added to.
  writeRaster(path("float.tif"), made = MadeRaster{});
  ASSERT_TRUE(buildOf({path("float.tif")}, "bounded.terrane").ok());
  EXPECT_HAS(appendError({path("base.tif")}, "bounded.terrane"), "within 0.05 m");
  made = windowOf(0, 0, 100, 100, ground);
  made.geoTransform[1] = 20.0;
  made.geoTransform[5] = -20.0;
  made.geoTransform[0] -= 5.0;
  made.geoTransform[3] += 5.0;
  writeRaster(path("coarse.tif"), made);
  ASSERT_TRUE(buildOf({path("coarse.tif"), path("base.tif")}, "mixed.terrane").ok());
  EXPECT_HAS(appendError({path("base.tif")}, "mixed.terrane"), "coarse.tif is coarser");
  EXPECT_HAS(appendError({path("base.tif")}, "nowhere.terrane"), "does not exist");
  EXPECT_HAS(appendError({path("missing.tif")}, "base.terrane"), "missing.tif");

  {
    auto picture = windowOf(0, 0, 100, 100, [](int x, int y) { return (x + y) % 256; });
    picture.type = GDT_Byte;
    picture.noData = {};
    picture.bands = 3;
    writeRaster(path("photo.tif"), picture);
    BuildOptions options;
    options.output = path("photo.terrane");
    options.imagery.layers.emplace_back().inputs = {path("photo.tif")};
    SilentProgress progress;
    const auto report = buildDataset(*open(from({path("base.tif")})), options, progress);
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_HAS(appendError({path("base.tif")}, "photo.terrane"), "imagery");
  }

  // A fault in the old archive does not get the new one's blessing.
  std::fstream archive(path("base.terrane/elevation.pmtiles"),
                       std::ios::in | std::ios::out | std::ios::binary);
  archive.seekp(-5, std::ios::end);
  archive.put('\x55');
  archive.close();
  EXPECT_HAS(appendError({path("base.tif")}, "base.terrane"), "elevation.pmtiles");
}

}  // namespace
}  // namespace terrane::test
