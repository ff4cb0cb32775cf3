#include "terrane/bake/vector_file.h"

#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "input_crs.h"
#include "source_support.h"

namespace terrane::test {
namespace {

/// 40 km of UTM zone 32 in the Alps.
VectorWindow window() {
  OGRSpatialReference utm;
  utm.importFromEPSG(32632);
  return {.crsWkt = crsWkt(utm), .west = 400000.0, .south = 5120000.0, .east = 440000.0, .north = 5160000.0};
}

/// Longitudes and latitudes of places in it.
std::vector<glm::dvec2> degreesOf(const std::vector<glm::dvec2>& places) {
  OGRSpatialReference utm, wgs84;
  utm.importFromEPSG(32632);
  wgs84.importFromEPSG(4326);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> way(OGRCreateCoordinateTransformation(&utm, &wgs84));
  std::vector<glm::dvec2> degrees = places;
  for (glm::dvec2& place : degrees) EXPECT_TRUE(way->Transform(1, &place.x, &place.y));
  return degrees;
}

const std::vector<glm::dvec2> kWay = {{410000.0, 5130000.0}, {412000.0, 5131000.0}, {415000.0, 5129500.0}};

class VectorFileTest : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::vector<VectorLine> read(const std::string& path) {
    auto lines = readVectorLines(path, window());
    EXPECT_TRUE(lines.ok()) << lines.error().message;
    return lines.ok() ? *lines : std::vector<VectorLine>{};
  }
  std::string errorOf(const std::string& path) {
    const auto lines = readVectorLines(path, window());
    EXPECT_FALSE(lines.ok()) << path;
    return lines.ok() ? "" : lines.error().message;
  }
  static void expectWay(const VectorLine& line, double within = 0.01) {
    ASSERT_EQ(line.corners.size(), kWay.size());
    for (size_t i = 0; i < kWay.size(); ++i) {
      EXPECT_NEAR(line.corners[i].x, kWay[i].x, within);
      EXPECT_NEAR(line.corners[i].y, kWay[i].y, within);
    }
  }
  TempFolder folder_;
};

std::string jsonOf(const std::vector<glm::dvec2>& places) {
  std::string text;
  for (const auto& place : places)
    text += fmt::format("{}[{:.9f}, {:.9f}, 700]", text.empty() ? "" : ", ", place.x, place.y);
  return "[" + text + "]";
}

TEST_F(VectorFileTest, GeoJsonIsInDegreesOrAsItSays) {
  const std::string degrees = fmt::format(
      R"({{"type": "Feature", "properties": {{"stroke": "#102030", "stroke-width": 4, "stroke-opacity": "0.5"}},
          "geometry": {{"type": "LineString", "coordinates": {}}}}})",
      jsonOf(degreesOf(kWay)));
  const auto lines = read(write("degrees.geojson", degrees));
  ASSERT_EQ(lines.size(), 1U);
  expectWay(lines[0]);
  EXPECT_EQ(lines[0].stroke, "#102030");
  EXPECT_EQ(lines[0].strokePixels, 4.0);
  EXPECT_EQ(lines[0].strokeOpacity, 0.5);
  EXPECT_FALSE(lines[0].strokeMeters);

  // No degrees, and no word of a CRS: the window's.
  const auto plain =
      read(write("plain.geojson", R"({"type": "LineString", "coordinates": )" + jsonOf(kWay) + "}"));
  ASSERT_EQ(plain.size(), 1U);
  expectWay(plain[0], 0.0);
  EXPECT_TRUE(plain[0].stroke.empty());

  // The old form's word.
  const auto named = read(write(
      "named.geojson",
      fmt::format(
          R"({{"type": "FeatureCollection", "crs": {{"type": "name", "properties": {{"name": "EPSG:32632"}}}}, "features":
          [{{"type": "Feature", "properties": {{"stroke-meters": 12.5}}, "geometry": {{"type": "LineString",
          "coordinates": {}}}}}]}})",
          jsonOf(kWay))));
  ASSERT_EQ(named.size(), 1U);
  expectWay(named[0], 0.0);
  EXPECT_EQ(named[0].strokeMeters, 12.5);
}

TEST_F(VectorFileTest, EveryKindOfGeometryGivesItsLines) {
  const std::string ring = "[[410000, 5130000], [411000, 5130000], [411000, 5131000], [410000, 5130000]]";
  const std::string hole = "[[410600, 5130200], [410800, 5130200], [410800, 5130400], [410600, 5130200]]";
  const auto lines = read(write("all.geojson", R"({"type": "GeometryCollection", "geometries": [
    {"type": "Point", "coordinates": [420000, 5130000]},
    {"type": "MultiPoint", "coordinates": [[420000, 5131000], [420000, 5132000]]},
    {"type": "MultiLineString", "coordinates": [[[420000, 5133000], [421000, 5133000]], [[420000, 5134000], [421000, 5134000]]]},
    {"type": "Polygon", "coordinates": [)" + ring + ", " +
                                                   hole + R"(]},
    {"type": "MultiPolygon", "coordinates": [[)" + ring +
                                                   R"(]]}]})"));
  std::vector<size_t> corners;
  for (const VectorLine& line : lines) corners.push_back(line.corners.size());
  EXPECT_EQ(corners, (std::vector<size_t>{1, 1, 1, 2, 2, 4, 4, 4}));
}

TEST_F(VectorFileTest, GpxHasTracksRoutesAndWaypoints) {
  const auto degrees = degreesOf(kWay);
  std::string points[3];
  const char* kinds[] = {"wpt", "rtept", "trkpt"};
  for (int k = 0; k < 3; ++k) {
    for (const auto& place : degrees)
      points[k] += fmt::format("<{} lat=\"{:.9f}\" lon=\"{:.9f}\"/>", kinds[k], place.y, place.x);
  }
  const auto lines = read(write("way.gpx", R"(<?xml version="1.0"?><gpx version="1.1" creator="t"
    xmlns="http://www.topografix.com/GPX/1/1">)" +
                                               points[0] + "<rte>" + points[1] + "</rte><trk><trkseg>" +
                                               points[2] + "</trkseg></trk></gpx>"));
  ASSERT_EQ(lines.size(), 5U);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(lines[static_cast<size_t>(i)].corners.size(), 1U);
  expectWay(lines[3]);
  expectWay(lines[4]);
}

TEST_F(VectorFileTest, KmlBringsItsStyle) {
  std::string places;
  for (const auto& place : degreesOf(kWay)) places += fmt::format("{:.9f},{:.9f},0 ", place.x, place.y);
  const auto lines =
      read(write("way.kml", R"(<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2">
    <Document><Placemark><Style><LineStyle><color>80302010</color><width>6</width></LineStyle></Style>
    <LineString><coordinates>)" +
                                places + "</coordinates></LineString></Placemark></Document></kml>"));
  ASSERT_EQ(lines.size(), 1U);
  expectWay(lines[0]);
  EXPECT_EQ(lines[0].stroke, "#102030");
  EXPECT_NEAR(lines[0].strokeOpacity.value_or(0.0), 128 / 255.0, 1e-9);
  EXPECT_EQ(lines[0].strokePixels, 6.0);
}

TEST_F(VectorFileTest, OfALargeFileOnlyWhatComesIntoTheWindowIsRead) {
  GDALAllRegister();
  const std::string path = folder_ / "roads.gpkg";
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GPKG");
  GDALDataset* dataset = driver->Create(path.c_str(), 0, 0, 0, GDT_Unknown, nullptr);
  ASSERT_NE(dataset, nullptr);
  OGRSpatialReference laea;
  laea.importFromEPSG(3035);
  OGRSpatialReference utm;
  utm.importFromEPSG(32632);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  laea.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> way(OGRCreateCoordinateTransformation(&utm, &laea));
  for (const char* name : {"roads", "paths"}) {
    OGRLayer* layer = dataset->CreateLayer(name, &laea, wkbLineString, nullptr);
    for (int i = 0; i < 40; ++i) {
      const double place[2] = {380000.0 + 10000.0 * (i % 8), 5100000.0 + 20000.0 * (i / 8)};
      double x[2] = {place[0], place[0] + 3000.0};
      double y[2] = {place[1], place[1] + 3000.0};
      ASSERT_TRUE(way->Transform(2, x, y));
      OGRLineString line;
      line.addPoint(x[0], y[0]);
      line.addPoint(x[1], y[1]);
      OGRFeature feature(layer->GetLayerDefn());
      feature.SetGeometry(&line);
      ASSERT_EQ(layer->CreateFeature(&feature), OGRERR_NONE);
    }
  }
  GDALClose(dataset);
  const auto lines = read(path);
  // Columns at 400, 410, 420, 430, 440 km and rows at 5120, 5140, 5160 km touch it, in both layers.
  EXPECT_EQ(lines.size(), 2U * 5U * 3U);
  for (const VectorLine& line : lines) {
    EXPECT_GE(line.corners[1].x, window().west);
    EXPECT_LE(line.corners[0].x, window().east + 0.01);
  }
}

TEST_F(VectorFileTest, SaysWhatIsWrongWithAFile) {
  EXPECT_HAS(errorOf(folder_ / "nosuch.gpx"), "does it exist");
  EXPECT_HAS(errorOf(write("words.txt", "LINESTRING (1 2, 3 4)")), "not a vector file");
  EXPECT_HAS(errorOf(write("cut.geojson", R"({"type": "LineString", "coordinates": [[1, 2], [3)")),
             "cut.geojson");
  EXPECT_HAS(errorOf(write("empty.geojson", R"({"type": "FeatureCollection", "features": []})")), "no lines");
  const std::string afar =
      errorOf(write("afar.geojson", R"({"type": "LineString", "coordinates": [[17, 46], [18, 46]]})"));
  EXPECT_HAS(afar, "nothing of it lies on the dataset");
  EXPECT_HAS(afar, "17 to 18");
}

TEST_F(VectorFileTest, WhatMeansSomethingElseIsNoStyle) {
  const auto lines = read(write("thin.geojson", R"({"type": "Feature", "properties": {"stroke-width": -1,
      "stroke-opacity": "low", "color": "dull"}, "geometry": {"type": "LineString", "coordinates": )" +
                                                    jsonOf(kWay) + "}}"));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_FALSE(lines[0].strokePixels || lines[0].strokeOpacity || lines[0].strokeMeters);
  EXPECT_EQ(lines[0].stroke, "dull");
}

TEST_F(VectorFileTest, WhatIsStraightInDegreesIsBentInTheWindow) {
  // A parallel that crosses all of the window, without a corner in it.
  const auto lines =
      read(write("parallel.geojson", R"({"type": "LineString", "coordinates": [[-5, 46.4], [22, 46.4]]})"));
  ASSERT_EQ(lines.size(), 1U);
  OGRSpatialReference utm, wgs84;
  utm.importFromEPSG(32632);
  wgs84.importFromEPSG(4326);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> way(OGRCreateCoordinateTransformation(&wgs84, &utm));
  const auto& corners = lines[0].corners;
  EXPECT_LT(corners.size(), 4000U);
  int seen = 0;
  for (double longitude = 7.7; longitude < 8.2; longitude += 0.0013, ++seen) {
    double x = longitude, y = 46.4;
    ASSERT_TRUE(way->Transform(1, &x, &y));
    const auto after =
        std::find_if(corners.begin(), corners.end(), [&](const glm::dvec2& at) { return at.x > x; });
    ASSERT_TRUE(after != corners.begin() && after != corners.end());
    const glm::dvec2 a = after[-1], b = *after;
    EXPECT_NEAR(a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x), y, 0.6);
  }
  EXPECT_GT(seen, 300);
}

}  // namespace
}  // namespace terrane::test
