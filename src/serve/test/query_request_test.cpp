#include "query_request.h"

#include <gtest/gtest.h>

namespace terrane::serve {
namespace {

QueryResult<QueryRequest> ask(QueryKind kind, const std::string& query) {
  const auto target = readTarget("/?" + query);
  EXPECT_TRUE(target.ok()) << query;
  return readQuery(kind, *target, {});
}

TEST(QueryRequest, ReadsTheSameFromUrlsAndBodies) {
  for (
      const auto& found :
      {ask(QueryKind::LineOfSight,
           "from=1.5,-2&to=3,4;5e2,6&eye=1.7&target=2&curvature=true&refraction=0.13&crs=dataset"),
       readQueryJson(
           QueryKind::LineOfSight,
           R"({"from":[1.5,-2],"to":[[3,4],[500,6]],"eye":1.7,"target":2,"curvature":true,"refraction":0.13})",
           {})}) {
    ASSERT_TRUE(found.value) << found.refusal.words;
    EXPECT_EQ(found.value->from, glm::dvec2(1.5, -2.0));
    EXPECT_EQ(found.value->points, (std::vector<glm::dvec2>{{3.0, 4.0}, {500.0, 6.0}}));
    EXPECT_EQ(found.value->eyeMeters, 1.7);
    EXPECT_EQ(found.value->targetMeters, 2.0);
    EXPECT_TRUE(found.value->curvature);
    EXPECT_EQ(found.value->refraction, 0.13);
    EXPECT_EQ(found.value->crs, "");
  }
  EXPECT_EQ(ask(QueryKind::Elevation, "points=7,46&crs=OGC:CRS84").value->crs, "EPSG:4326");
  EXPECT_EQ(ask(QueryKind::Elevation, "points=1,2&crs=EPSG:3857").value->crs, "EPSG:3857");
  EXPECT_EQ(ask(QueryKind::Profile, "points=7,46;8,47&samples=17").value->samples, 17U);
}

TEST(QueryRequest, RefusesInWords) {
  const auto refuses = [](QueryKind kind, const std::string& query, int status, const char* words) {
    const auto found = ask(kind, query);
    EXPECT_FALSE(found.value) << query;
    EXPECT_EQ(found.refusal.status, status) << query;
    EXPECT_NE(found.refusal.words.find(words), std::string::npos) << query << ": " << found.refusal.words;
  };
  constexpr auto kElevation = QueryKind::Elevation;
  constexpr auto kProfile = QueryKind::Profile;
  constexpr auto kSight = QueryKind::LineOfSight;
  refuses(kElevation, "", 400, "'points' needs");
  refuses(kElevation, "points=", 400, "'points' needs");
  refuses(kElevation, "points=1", 400, "point 1");
  refuses(kElevation, "points=1,2;x,4", 400, "point 2");
  refuses(kElevation, "points=1,2,3", 400, "point 1");
  refuses(kElevation, "points=nan,2", 400, "point 1");
  refuses(kElevation, "points=1,1e999", 400, "point 1");
  refuses(kElevation, "points=1,2&point=3", 400, "no parameter 'point'");
  for (const char* crs :
       {"EPSG:", "EPSG:12x", "EPSG:1234567", "epsg:4326", "+proj=longlat", "/etc/passwd", "@x"})
    refuses(kElevation, std::string("points=1,2&crs=") + crs, 400, "EPSG:4326");
  refuses(kElevation, "points=1,2&crs=", 400, "EPSG:4326");
  refuses(kElevation, "points=46,91&crs=EPSG:4326", 400, "longitude comes first");
  refuses(kProfile, "points=1,2", 400, "at least 2");
  refuses(kProfile, "points=1,2;3,4&samples=1", 400, "samples");
  refuses(kProfile, "points=1,2;3,4&samples=2.5", 400, "samples");
  refuses(kProfile, "points=1,2;3,4&samples=1e300", 413, "20000");
  refuses(kSight, "to=1,2", 400, "'from'");
  refuses(kSight, "from=1,2;3,4&to=1,2", 400, "'from'");
  refuses(kSight, "from=1,2&to=1,2&eye=-1", 400, "'eye'");
  refuses(kSight, "from=1,2&to=1,2&curvature=yes", 400, "curvature");
  refuses(kSight, "from=1,2&to=1,2&curvature=true&refraction=1", 400, "refraction");
  refuses(kSight, "from=1,2&to=1,2&refraction=0.1", 400, "curvature=true");
  std::string many = "from=1,2&to=";
  for (int i = 0; i < 101; ++i) many += "1,2;";
  refuses(kSight, many, 413, "100");
}

TEST(QueryRequest, RefusesBodiesThatAreNone) {
  std::string many = R"({"points":[)", deep(100000, '[');
  for (int i = 0; i < 10001; ++i) many += (i == 0 ? "[1,2]" : ",[1,2]");
  EXPECT_EQ(readQueryJson(QueryKind::Elevation, many + "]}", {}).refusal.status, 413);
  for (const std::string& body :
       {std::string(), std::string("[]"), std::string("{"), std::string(R"({"points":1})"),
        std::string(R"({"points":[1,2]})"), std::string(R"({"points":[[1,2,3]]})"),
        std::string(R"({"points":[["1",2]]})"), std::string(R"({"points":[[1,1e999]]})"),
        std::string(R"({"points":[[1,2]],"crs":5})"), std::string(R"({"points":[[1,2]],"more":5})"),
        std::string("\xff\xfe"), deep, R"({"points":)" + deep}) {
    const auto found = readQueryJson(QueryKind::Elevation, body, {});
    EXPECT_FALSE(found.value) << body.substr(0, 60);
    EXPECT_EQ(found.refusal.status, 400) << body.substr(0, 60);
    EXPECT_FALSE(found.refusal.words.empty());
  }
}

}  // namespace
}  // namespace terrane::serve
