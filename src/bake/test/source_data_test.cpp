#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "source_support.h"

/// The real rasters that the project is measured on, where they are at hand: each opens, lies where it should
/// and has the heights that its catalogue tells.
namespace terrane {
namespace {

struct Known {
  const char* file;
  bool warped;
  const char* crsName;
  double spacing;  // as the file has it; 0 where warped
  double low;      // of the catalogue, metres
  double high;
  const char* sourceCrs = "";
  std::optional<double> noData = std::nullopt;
};

const Known kKnown[] = {
    {"swellendam/dem_srtm_utm33s.tif", false, "WGS 84 / UTM zone 33S", 81.99, 0, 1699},
    {"swellendam/dem_srtm_4326.tif", true, "WGS 84 / UTM zone 34S", 0, 0, 1699},
    {"zion/dem_srtm_zion.tif", true, "WGS 84 / UTM zone 12N", 0, 1024, 2892},
    {"tell_brak/dem.tif", false, "WGS 84 / UTM zone 37N", 83.67, 307.2, 489.9},
    {"somerset_1m/dtm.tif", false, "OSGB36 / British National Grid", 1.0, 44, 198},
    {"gabilan_mesa_1m/gabilan.bil", false, "WGS 84 / UTM zone 11N", 1.0, 187.9, 307.28},
    {"mt_hood/lf_elev_220_mt_hood_utm.tif", false, "NAD83 / UTM zone 10N", 30, 553, 3421},
    {"bigtujunga/bigtujunga.tif", false, "WGS 84 / UTM zone 11N", 30, 315, 2295},
    {"swiss_alps_n46e008/N46E008.tif", true, "WGS 84 / UTM zone 32N", 0, 187, 4173},
    {"mt_fuji_n35e138/mt_fuji_90m.tif", true, "WGS 84 / UTM zone 54N", 0, -16, 3742},
    {"azores/N38W029.SRTMGL3.hgt.zip", true, "WGS 84 / UTM zone 26N", 0, -8, 2304},
    {"lakemorpho_nh/exampleElev.tif", false, "Albers", 30, 290.7, 714.8},
    {"new_zealand_1km/nz_elev.tif", false, "Transverse Mercator", 1000, 0, 4140.3},
    {"moorea/dem.tif", true, "WGS 84 / UTM zone 6S", 0, -2, 1182},
    {"st_helens/SainteHelens.dem", false, "NAD27 / UTM zone 10N", 30, 682, 2543},
    {"crater_lake/craterlake-elev-16bit-30m.tif", true, "WGS 84 / UTM zone 10N", 0, 1289, 1880, "", -32767.0},
    {"santa_barbara/sba_elev32_wgs84_512x512.tif", true, "WGS 84 / UTM zone 11N", 0, 2.5, 20.7, "EPSG:4326"},
    {"moon_gld100_4096/moon_gld100_4096.tif", false, "1737400", 118.45, -5547, 2549},
};

TEST(SourceData, EveryFileLiesAndStandsAsItsCatalogueTells) {
  const std::filesystem::path data = std::filesystem::path(TERRANE_SOURCE_DIR) / ".." / "shared" / "data";
  int seen = 0;
  for (const auto& known : kKnown) {
    const auto path = data / known.file;
    if (!std::filesystem::exists(path)) continue;
    SCOPED_TRACE(known.file);
    ++seen;
    auto options = test::from({path.string()});
    options.sourceCrs = known.sourceCrs;
    options.noData = known.noData;
    const auto source = test::open(options);
    ASSERT_TRUE(source);
    const SourcePlan& plan = source->plan();
    EXPECT_HAS(plan.crsName, known.crsName);
    EXPECT_EQ(plan.inputs[0].warped, known.warped);
    if (known.spacing > 0) {
      EXPECT_NEAR(plan.frame.spacingX, known.spacing, known.spacing * 1e-3);
    }
    const bool integers = plan.inputs[0].dataType != "Float32";
    EXPECT_EQ(plan.maxErrorMeters == 0.0, integers && !known.warped);

    auto reader = source->openReader();
    ASSERT_TRUE(reader.ok());
    std::vector<float> heights(kTileSampleCount);
    std::vector<uint16_t> ranks(kTileSampleCount);
    double low = 1e9;
    double high = -1e9;
    const int level = plan.frame.finestLevel;
    for (int row = 0; int64_t{row} * kTileCells < plan.extentRows; ++row) {
      for (int col = 0; int64_t{col} * kTileCells < plan.extentCols; ++col) {
        const TileId id{level, col, row};
        if (!id.valid() || !source->mayTouch(id)) continue;
        const auto any = (*reader)->readTile(id, heights, ranks);
        ASSERT_TRUE(any.ok()) << any.error().message;
        for (const float height : heights) {
          if (std::isnan(height)) continue;
          low = std::min<double>(low, height);
          high = std::max<double>(high, height);
        }
      }
    }

    // Cubic kernels overshoot at cliffs, and the samples miss the very peaks.
    const double relief = known.high - known.low;
    EXPECT_NEAR(low, known.low, known.warped ? 0.08 * relief : 0.06) << low;
    EXPECT_NEAR(high, known.high, known.warped ? 0.02 * relief : 0.06) << high;
  }
  if (seen == 0) std::printf("the shared data is absent: nothing was compared with it\n");
}

TEST(SourceData, ACorruptCrsIsSaid) {
  const std::filesystem::path path = std::filesystem::path(TERRANE_SOURCE_DIR) / ".." / "shared" / "data" /
                                     "santa_barbara" / "sba_elev32_wgs84_512x512.tif";
  if (!std::filesystem::exists(path)) {
    std::printf("the shared data is absent: nothing was compared with it\n");
    return;
  }
  EXPECT_HAS(test::openError(test::from({path.string()})), "pass --source-crs");
}

}  // namespace
}  // namespace terrane
