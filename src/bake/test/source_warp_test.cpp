#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "input_crs.h"
#include "source_support.h"
#include "warp.h"

namespace terrane {
namespace {

using test::TempFolder;
using test::writeRaster;

// A whole lattice, warped in windows of one size that begin somewhere.
std::vector<float> warpInWindows(const InputRaster& raster, GDALDataset& dataset, const std::string& wkt,
                                 const WarpPlan& plan, const WarpKernel& kernel, int cols, int rows,
                                 int width, int height, int shift) {
  const std::array<double, 6> g = {plan.west, plan.spacing, 0.0, plan.north, 0.0, -plan.spacing};
  auto warper = Warper::open(raster, dataset, wkt, g, kernel);
  EXPECT_TRUE(warper.ok());
  std::vector<float> all(static_cast<size_t>(cols) * static_cast<size_t>(rows), -1e9F);
  std::vector<float> window;
  for (int top = -shift; top < rows; top += height) {
    for (int left = -shift; left < cols; left += width) {
      const int x0 = std::max(0, left), x1 = std::min(cols, left + width);
      const int y0 = std::max(0, top), y1 = std::min(rows, top + height);
      if (x0 >= x1 || y0 >= y1) continue;
      window.resize(static_cast<size_t>(x1 - x0) * static_cast<size_t>(y1 - y0));
      const auto status = (*warper)->read(x0, y0, x1 - x0, y1 - y0, window);
      EXPECT_TRUE(status.ok()) << status.error().message;
      for (int y = y0; y < y1; ++y) {
        std::memcpy(&all[static_cast<size_t>(y) * static_cast<size_t>(cols) + static_cast<size_t>(x0)],
                    &window[static_cast<size_t>(y - y0) * static_cast<size_t>(x1 - x0)],
                    static_cast<size_t>(x1 - x0) * sizeof(float));
      }
    }
  }
  return all;
}

TEST(Warp, WindowsAgreeBitForBit) {
  TempFolder folder;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-30.0, 30.0);
  std::uniform_int_distribution<int> hole(0, 60);
  struct Case {
    const char* crs;
    std::array<double, 6> g;
    const char* target;
    GDALDataType type;
    bool mask;
    const char* resampling = "cubic";
    double coarser = 1.0;  // than GDAL suggests
  };
  const Case cases[] = {
      {"EPSG:4326", {8.0, 0.00083333, 0.0, 47.0, 0.0, -0.00083333}, "EPSG:32632", GDT_Int16, false},
      {"EPSG:4326", {8.0, 0.00083333, 0.0, 47.0, 0.0, -0.00083333}, "EPSG:32632", GDT_Float32, false},
      {"EPSG:4326", {8.0, 0.00083333, 0.0, 70.0, 0.0, -0.00083333}, "EPSG:3857", GDT_Float32, true},
      {"EPSG:32632", {499995.0, 9.0, 3.0, 5000005.0, 3.0, -9.0}, "EPSG:32632", GDT_Float32, false},
      // Datums whose transformation is chosen by place.
      {"EPSG:4267", {-110.0, 0.02, 0.0, 45.0, 0.0, -0.02}, "EPSG:5070", GDT_Float32, false},
      // Other kernels, and wider ones.
      {"EPSG:32632",
       {499995.0, 9.0, 3.0, 5000005.0, 3.0, -9.0},
       "EPSG:32632",
       GDT_Float32,
       false,
       "near",
       1.5},
      {"EPSG:32632",
       {499995.0, 9.0, 0.0, 5000005.0, 0.0, -9.0},
       "EPSG:32632",
       GDT_Int16,
       false,
       "cubic",
       2.7},
      {"EPSG:4326", {8.0, 0.0008, 0.0, 47.0, 0.0, -0.0008}, "EPSG:32632", GDT_Float32, true, "bilinear", 3.1},
      {"EPSG:4326",
       {8.0, 0.0008, 0.0, 47.0, 0.0, -0.0008},
       "EPSG:32632",
       GDT_Int16,
       false,
       "cubicspline",
       1.0},
      {"EPSG:4267", {-110.0, 0.02, 0.0, 45.0, 0.0, -0.02}, "EPSG:5070", GDT_Float32, false, "lanczos", 2.0},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(std::string(one.crs) + " to " + one.target + ", " + one.resampling);
    writeRaster(
        folder / "a.tif",
        {.width = 400,
         .height = 300,
         .type = one.type,
         .crs = one.crs,
         .geoTransform = one.g,
         .noData = one.mask ? std::nullopt : std::optional<double>(-9999.0),
         .mask = one.mask,
         .heightAt =
             [&](int c, int r) {
               // Whole stretches without holes: there GDAL could take another path.
               if (c > 200 && hole(random) == 0 && !one.mask) return -9999.0;
               return std::round(1000.0 + 300.0 * std::sin(c * 0.05) * std::cos(r * 0.04) + noise(random));
             },
         .maskAt = [&](int c, int) { return c < 200 || hole(random) != 0; }});
    const auto raster = describeRaster({folder / "a.tif", false}, std::nullopt);
    ASSERT_TRUE(raster.ok()) << raster.error().message;
    const auto target = crsFromUser(one.target, "--crs");
    ASSERT_TRUE(target.ok());
    const std::string wkt = crsWkt(*target);
    const auto dataset = openRaster(raster->path);
    ASSERT_TRUE(dataset.ok());
    auto plan = planWarp(*raster, **dataset, wkt);
    ASSERT_TRUE(plan.ok()) << plan.error().message;
    plan->spacing *= one.coarser;
    const WarpKernel kernel{one.resampling, 1.0 / one.coarser, 1.0 / one.coarser};
    const int cols = static_cast<int>((plan->east - plan->west) / plan->spacing) + 1;
    const int rows = static_cast<int>((plan->north - plan->south) / plan->spacing) + 1;
    const auto inTiles = warpInWindows(*raster, **dataset, wkt, *plan, kernel, cols, rows, 257, 257, 0);
    const auto inStrips = warpInWindows(*raster, **dataset, wkt, *plan, kernel, cols, rows, 5000, 31, 3);
    const auto inBits = warpInWindows(*raster, **dataset, wkt, *plan, kernel, cols, rows, 61, 83, 11);
    EXPECT_EQ(std::memcmp(inTiles.data(), inStrips.data(), inTiles.size() * sizeof(float)), 0);
    EXPECT_EQ(std::memcmp(inTiles.data(), inBits.data(), inTiles.size() * sizeof(float)), 0);

    // It must be a picture of the ground, with holes.
    int64_t ground = 0;
    int64_t holes = 0;
    for (const float height : inTiles) (std::isnan(height) ? holes : ground) += 1;
    EXPECT_GT(ground, cols * rows / 2);
    EXPECT_GT(holes, 50.0 / (one.coarser * one.coarser));
  }
}

TEST(Warp, TheSpacingReadsWell) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 400,
                                 .height = 300,
                                 .crs = "EPSG:4326",
                                 .geoTransform = {8.0, 0.00083333, 0.0, 47.0, 0.0, -0.00083333}});
  const auto source = test::open(test::from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  const double spacing = source->plan().frame.spacingX;
  EXPECT_EQ(spacing, source->plan().frame.spacingY);
  EXPECT_NEAR(spacing * 100.0, std::round(spacing * 100.0), 1e-9);
  EXPECT_GT(spacing, 63.0);  // x spacing
  EXPECT_LT(spacing, 93.0);  // y spacing
  EXPECT_EQ(source->plan().crsName, "WGS 84 / UTM zone 32N");
}

}  // namespace
}  // namespace terrane
