#include "terrane/bake/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "source_support.h"
#include "terrane/bake/build.h"

namespace terrane {
namespace {

using test::from;
using test::TempFolder;
using test::writeRaster;

// Builds a dataset and opens it.
std::optional<Dataset> buildAndOpen(const SourceOptions& options, const std::string& output) {
  SilentProgress silent;
  auto source = openSource(options, silent);
  EXPECT_TRUE(source.ok()) << source.error().message;
  if (!source.ok()) return std::nullopt;
  BuildOptions build;
  build.output = output;
  build.overwrite = true;
  auto report = buildDataset(**source, build, silent);
  EXPECT_TRUE(report.ok()) << report.error().message;
  if (!report.ok()) return std::nullopt;
  auto dataset = Dataset::open(output);
  EXPECT_TRUE(dataset.ok()) << dataset.error().message;
  if (!dataset.ok()) return std::nullopt;
  return std::move(dataset).value();
}

ComparisonReport compare(const Dataset& dataset, const std::vector<std::string>& rasters,
                         const CompareOptions& options = {}) {
  SilentProgress silent;
  const auto report = compareWithSource(dataset, rasters, options, silent);
  EXPECT_TRUE(report.ok()) << report.error().message;
  return report.ok() ? *report : ComparisonReport{};
}

double hills(int col, int row) {
  return std::round(800.0 + 200.0 * std::sin(col * 0.03) * std::cos(row * 0.021) + (col * 7 + row * 13) % 5);
}

TEST(Compare, LosslessDatasetsAgreeExactly) {
  TempFolder folder;
  writeRaster(
      folder / "a.tif",
      {.width = 600, .height = 530, .type = GDT_Int16, .noData = -9999.0, .heightAt = [](int c, int r) {
         return c > 200 && c < 240 && r > 100 && r < 400 ? -9999.0 : hills(c, r);
       }});
  const auto dataset = buildAndOpen(from({folder / "a.tif"}), folder / "a.terrane");
  ASSERT_TRUE(dataset);
  const auto report = compare(*dataset, {folder / "a.tif"});
  EXPECT_TRUE(report.agrees());
  EXPECT_EQ(report.largestMeters, 0.0);
  EXPECT_EQ(report.boundMeters, 0.0);
  EXPECT_EQ(report.compared, 600u * 530u - 39u * 299u);
}

TEST(Compare, ScaledFeetAgreeExactly) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 300,
                                 .height = 280,
                                 .type = GDT_Int32,
                                 .scale = 0.1,
                                 .offset = -20.0,
                                 .unit = "ft",
                                 .heightAt = [](int c, int r) { return 32808.4 + c * 3 + r; }});
  const auto dataset = buildAndOpen(from({folder / "a.tif"}), folder / "a.terrane");
  ASSERT_TRUE(dataset);
  const auto report = compare(*dataset, {folder / "a.tif"});
  EXPECT_TRUE(report.agrees());
  EXPECT_EQ(report.compared, 300u * 280u);
}

TEST(Compare, FloatsAndWarpedOnesStayWithinTheirBound) {
  TempFolder folder;
  for (const char* crs : {"", "EPSG:32633"}) {
    writeRaster(
        folder / "a.tif",
        {.width = 500,
         .height = 420,
         .mask = true,
         .heightAt = [](int c, int r) { return 0.37 * hills(c, r); },
         .maskAt = [](int c, int r) { return (c - 250) * (c - 250) + (r - 200) * (r - 200) < 190 * 190; }});
    auto options = from({folder / "a.tif"});
    options.crs = crs;
    const auto dataset = buildAndOpen(options, folder / "a.terrane");
    ASSERT_TRUE(dataset);
    const auto report = compare(*dataset, {folder / "a.tif"});
    EXPECT_TRUE(report.agrees()) << crs << " " << report.largestMeters << " " << report.onlyInSource << " "
                                 << report.onlyInDataset;
    EXPECT_GT(report.largestMeters, 0.5 * report.boundMeters);
    EXPECT_LT(report.meanMeters, report.largestMeters);
    EXPECT_GT(report.compared, 100000u);
    // Between their samples warped ones lose what their noise is.
    ASSERT_EQ(report.ownSamples.has_value(), *crs != 0);
    if (!report.ownSamples) continue;
    EXPECT_GT(report.ownSamples->compared, 100000u);
    EXPECT_GT(report.ownSamples->largestMeters, report.boundMeters);
    EXPECT_LT(report.ownSamples->largestMeters, 0.37 * 5.0);
    EXPECT_LT(report.ownSamples->meanMeters, 0.37);
  }
}

TEST(Compare, KernelsAndSpacingsOfOnesChoiceAreTakenAsInTheBuild) {
  TempFolder folder;
  writeRaster(folder / "utm.tif", {.width = 300, .height = 280, .heightAt = hills});
  writeRaster(folder / "degrees.tif", {.width = 300,
                                       .height = 280,
                                       .crs = "EPSG:4326",
                                       .geoTransform = {8.0, 0.0002, 0.0, 47.0, 0.0, -0.0002},
                                       .heightAt = hills});
  struct Case {
    const char* file;
    const char* resampling;
    std::optional<double> spacing;
  };
  for (const Case& one :
       {Case{"utm.tif", "cubic", 25.0}, Case{"utm.tif", "near", 30.0}, Case{"utm.tif", "bilinear", 10.1},
        Case{"degrees.tif", "bilinear", std::nullopt}, Case{"degrees.tif", "lanczos", std::nullopt},
        Case{"degrees.tif", "near", 41.0}, Case{"degrees.tif", "cubicspline", 77.0}}) {
    SCOPED_TRACE(std::string(one.file) + ", " + one.resampling);
    SourceOptions options = from({folder / one.file});
    options.resampling = one.resampling;
    options.spacing = one.spacing;
    const auto dataset = buildAndOpen(options, folder / "a.terrane");
    ASSERT_TRUE(dataset);
    const auto report = compare(*dataset, {folder / one.file});
    EXPECT_TRUE(report.agrees()) << report.largestMeters << " against " << report.boundMeters;
    EXPECT_TRUE(report.isWarped);
    EXPECT_GT(report.compared, 1000U);
  }
}

TEST(Compare, APlaneLosesNothingBetweenItsSamples) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 400, .height = 300, .heightAt = [](int c, int r) {
                                   return 100.0 + 2.0 * c + 3.0 * r;
                                 }});
  auto options = from({folder / "a.tif"});
  options.crs = "EPSG:32633";
  const auto dataset = buildAndOpen(options, folder / "a.terrane");
  ASSERT_TRUE(dataset);
  const auto report = compare(*dataset, {folder / "a.tif"});
  EXPECT_TRUE(report.agrees());
  ASSERT_TRUE(report.ownSamples);
  EXPECT_GT(report.ownSamples->compared, 100000u);
  EXPECT_LT(report.ownSamples->meanMeters, 2.0 * report.boundMeters);
}

TEST(Compare, SeesWhatHasChanged) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 300, .height = 280, .type = GDT_Int16, .heightAt = hills});
  const auto dataset = buildAndOpen(from({folder / "a.tif"}), folder / "a.terrane");
  ASSERT_TRUE(dataset);

  // One height five metres higher, and where; one sample gone.
  writeRaster(folder / "a.tif",
              {.width = 300, .height = 280, .type = GDT_Int16, .heightAt = [](int c, int r) {
                 return hills(c, r) + (c == 256 && r == 70 ? 5 : 0);
               }});
  auto report = compare(*dataset, {folder / "a.tif"});
  EXPECT_FALSE(report.agrees());
  EXPECT_EQ(report.largestMeters, 5.0);
  EXPECT_EQ(report.largestEasting, 500000.0 + 2560.0);
  EXPECT_EQ(report.largestNorthing, 5000000.0 - 700.0);
  EXPECT_EQ(report.compared, 300u * 280u);
  writeRaster(folder / "a.tif",
              {.width = 300, .height = 280, .type = GDT_Int16, .heightAt = [](int c, int r) {
                 return c == 299 && r == 279 ? -5.0 : hills(c, r);
               }});
  CompareOptions options;
  options.noData = -5.0;
  report = compare(*dataset, {folder / "a.tif"}, options);
  EXPECT_FALSE(report.agrees());
  EXPECT_TRUE(report.withinBound());
  EXPECT_EQ(report.onlyInDataset, 1u);

  SilentProgress silent;
  writeRaster(folder / "b.tif", {});
  const auto other = compareWithSource(*dataset, {folder / "a.tif", folder / "b.tif"}, {}, silent);
  ASSERT_FALSE(other.ok());
  EXPECT_HAS(other.error().message, "b.tif: not among the inputs");
}

TEST(Compare, MosaicsLieOnEachOtherAsInTheBuild) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 400, .height = 300, .type = GDT_Int16, .heightAt = hills});
  writeRaster(folder / "b.tif",
              {.width = 300,
               .height = 300,
               .type = GDT_Int16,
               .geoTransform = {501995.0, 10.0, 0.0, 5001005.0, 0.0, -10.0},
               .noData = 0.0,
               .heightAt = [](int c, int r) { return c % 50 == 7 ? 0.0 : 3000.0 + c - r; }});
  const std::vector<std::string> both = {folder / "a.tif", folder / "b.tif"};
  const auto dataset = buildAndOpen(from(both), folder / "a.terrane");
  ASSERT_TRUE(dataset);
  EXPECT_TRUE(compare(*dataset, both).agrees());
  EXPECT_FALSE(compare(*dataset, {folder / "b.tif", folder / "a.tif"}).agrees());
}

TEST(Compare, CoarserInputsAgreeOnTheirOwnSamples) {
  TempFolder folder;
  writeRaster(folder / "fine.tif", {.width = 300, .height = 300, .type = GDT_Int16, .heightAt = hills});
  writeRaster(folder / "coarse.tif",
              {.width = 200,
               .height = 180,
               .type = GDT_Int16,
               .geoTransform = {499980.0 - 2000.0, 40.0, 0.0, 5000020.0 + 2000.0, 0.0, -40.0},
               .heightAt = [](int c, int r) { return 1000.0 + c + r; }});
  for (const auto& order : {std::vector<std::string>{folder / "coarse.tif", folder / "fine.tif"},
                            std::vector<std::string>{folder / "fine.tif", folder / "coarse.tif"}}) {
    const auto dataset = buildAndOpen(from(order), folder / "a.terrane");
    ASSERT_TRUE(dataset);
    const auto report = compare(*dataset, order);
    EXPECT_TRUE(report.agrees()) << report.largestMeters << " " << report.onlyInSource << " "
                                 << report.onlyInDataset;
    EXPECT_GT(report.interpolated, 0u);
  }
}

}  // namespace
}  // namespace terrane
