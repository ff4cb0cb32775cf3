#include "quantized_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "right_triangles.h"

namespace terrane::serve {
namespace {

/// Heights that are rough in some places and level in others.
std::vector<float> madeHeights(int cells, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> noise(-1.0F, 1.0F);
  std::vector<float> out;
  for (int row = 0; row <= cells; ++row)
    for (int col = 0; col <= cells; ++col)
      out.push_back(20.0F * std::sin(0.1F * static_cast<float>(col)) +
                    (col > row ? 3.0F * noise(random) : 0.0F));
  return out;
}

TEST(RightTriangles, CoverTheSquareOnceWithoutTVertices) {
  for (const int cells : {2, 8, 64}) {
    for (const double bound : {0.0, 0.5, 5.0, 1e9}) {
      const std::vector<float> heights = madeHeights(cells, 1);
      const RightTriangles mesh = rightTriangles(heights, cells, bound);
      int64_t area = 0;
      std::map<std::pair<uint32_t, uint32_t>, int> edges;
      for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const auto& a = mesh.vertices[mesh.indices[i]];
        const auto& b = mesh.vertices[mesh.indices[i + 1]];
        const auto& c = mesh.vertices[mesh.indices[i + 2]];
        // Counter-clockwise from above, where rows go south.
        const int twice = (c.col - a.col) * (b.row - a.row) - (b.col - a.col) * (c.row - a.row);
        ASSERT_GT(twice, 0);
        area += twice;
        for (size_t k = 0; k < 3; ++k) ++edges[{mesh.indices[i + k], mesh.indices[i + (k + 1) % 3]}];
      }
      EXPECT_EQ(area, int64_t{2} * cells * cells);
      // Each edge once, and the other way in the neighbour, or on the border.
      for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        const auto& a = mesh.vertices[edge.first];
        const auto& b = mesh.vertices[edge.second];
        const bool isBorder = (a.col == b.col && (a.col == 0 || a.col == cells)) ||
                              (a.row == b.row && (a.row == 0 || a.row == cells));
        EXPECT_EQ(edges.count({edge.second, edge.first}), isBorder ? 0U : 1U);
      }
      // In the order of their first use.
      uint32_t next = 0;
      for (const uint32_t index : mesh.indices) {
        ASSERT_LE(index, next);
        if (index == next) ++next;
      }
      EXPECT_EQ(next, mesh.vertices.size());
    }
  }
}

TEST(RightTriangles, AreAsManyAsTheBoundNeeds) {
  constexpr int kCells = 64;
  const std::vector<float> heights = madeHeights(kCells, 2);
  EXPECT_EQ(rightTriangles(heights, kCells, 1e9).indices.size(), 6U);
  const std::vector<float> level(heights.size(), 7.0F);
  EXPECT_EQ(rightTriangles(level, kCells, 0.0).indices.size(), 6U);
  // One bump: all around it is fine, and nothing else.
  std::vector<float> bump = level;
  bump[33 * 65 + 17] = 8.0F;
  const RightTriangles around = rightTriangles(bump, kCells, 0.5);
  EXPECT_LT(around.vertices.size(), 60U);
  bool hasBump = false;
  for (const auto& vertex : around.vertices) hasBump = hasBump || (vertex.col == 17 && vertex.row == 33);
  EXPECT_TRUE(hasBump);
  size_t before = SIZE_MAX;
  for (const double bound : {0.0, 0.5, 1.0, 2.0, 4.0}) {
    const size_t count = rightTriangles(heights, kCells, bound).indices.size();
    EXPECT_LT(count, before);
    before = count;
  }
}

TEST(QuantizedMesh, ReadsAddressesOfTwiceAsManyColumns) {
  EXPECT_TRUE(readTerrainAddress("0", "1", "0"));
  EXPECT_FALSE(readTerrainAddress("0", "2", "0"));
  EXPECT_FALSE(readTerrainAddress("0", "0", "1"));
  const auto address = readTerrainAddress("12", "8191", "4095");
  ASSERT_TRUE(address);
  EXPECT_EQ(address->x, 8191);
  EXPECT_EQ(address->y, 4095);
  for (const char* bad : {"", "-1", "x", "99999999999"})
    EXPECT_FALSE(readTerrainAddress("12", bad, "0")) << bad;
  EXPECT_FALSE(readTerrainAddress("25", "0", "0"));
}

TEST(QuantizedMesh, TheLayerSaysWhichTilesThereAre) {
  XyzExtent extent{8.0, 46.0, 9.0, 47.0, 1000.0};
  Manifest manifest;
  const auto layer = nlohmann::json::parse(terrainLayerJson(manifest, extent, "/{z}/{x}/{y}.terrain"));
  EXPECT_EQ(layer["format"], "quantized-mesh-1.0");
  EXPECT_EQ(layer["scheme"], "tms");
  EXPECT_EQ(layer["maxzoom"], deepestTerrainLevel(extent));
  ASSERT_EQ(layer["available"].size(), layer["maxzoom"].get<size_t>() + 1);
  // CesiumJS begins with both tiles of the root.
  EXPECT_EQ(layer["available"][0][0]["endX"], 1);
  // At level 5 a tile is 5.625 degrees: column 33 from 180 W, row 24 from the south pole.
  EXPECT_EQ(layer["available"][5][0],
            (nlohmann::json{{"startX", 33}, {"startY", 24}, {"endX", 33}, {"endY", 24}}));
  // Across the 180th meridian there are two ranges.
  extent.west = 177.0;
  extent.east = -179.0;
  const auto fiji = nlohmann::json::parse(terrainLayerJson(manifest, extent, ""));
  ASSERT_EQ(fiji["available"][5].size(), 2U);
  EXPECT_EQ(fiji["available"][5][0]["endX"], 63);
  EXPECT_EQ(fiji["available"][5][1]["startX"], 0);
}

}  // namespace
}  // namespace terrane::serve
