#include "terrane/codec/compact_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "random_mesh_levels.h"
#include "rounds.h"

namespace terrane {
namespace {

template <class T>
bool sameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Expanding gives the very meshes that were made.
void expectSame(const MeshLevel& meshes) {
  const CompactLevel compact = compactOf(meshes);
  const auto expanded = expandMeshes(compact);
  ASSERT_TRUE(expanded.ok()) << "level " << meshes.level << ": " << expanded.error().message;
  EXPECT_TRUE(sameBytes(expanded->vertices, meshes.vertices));
  EXPECT_TRUE(sameBytes(expanded->indices, meshes.indices));
  ASSERT_EQ(expanded->patches.size(), meshes.patches.size());
  for (size_t i = 0; i < meshes.patches.size(); ++i) {
    const MeshLevel::Patch &is = expanded->patches[i], &was = meshes.patches[i];
    ASSERT_EQ(is.firstVertex, was.firstVertex);
    ASSERT_EQ(is.vertexCount, was.vertexCount);
    ASSERT_EQ(is.firstIndex, was.firstIndex);
    ASSERT_EQ(is.indexCount, was.indexCount);
  }
}

TEST(CompactMesh, ExpandsToTheVeryMeshesOfAllLevels) {
  int64_t triangles = 0, replacing = 0, extras = 0;
  for (unsigned seed = 0; seed < rounds(12U); ++seed) {
    SCOPED_TRACE(seed);
    RandomMeshes options = randomMeshesOf(seed);
    options.lastKept = 10;
    visitRandomMeshes(seed, options, [&](const MeshLevel& meshes) {
      expectSame(meshes);
      const Status valid = validateCompactLevel(compactOf(meshes));
      EXPECT_TRUE(valid.ok()) << valid.error().message;
      triangles += static_cast<int64_t>(meshes.indices.size() / 3);
      for (const MeshLevel::Patch& patch : meshes.patches)
        replacing += int64_t{patch.indexCount / 3} - patch.bisectedCount;
      extras += static_cast<int64_t>(meshes.extras.size());
    });
  }
  // All kinds of triangles were among them.
  EXPECT_GT(triangles, rounds(1'000'000));
  EXPECT_GT(extras, rounds(1000));
  EXPECT_GT(replacing, rounds(1000));
}

TEST(CompactMesh, ExpandsAMillionSmallPatches) {
  size_t patches = 0;
  for (unsigned seed = 100; patches < rounds(size_t{1'000'000}); ++seed) {
    SCOPED_TRACE(seed);
    RandomMeshes options = randomMeshesOf(seed);
    options.firstKept = 8;
    options.lastKept = seed % 4 == 0 ? kDeepestVertexLevel : 12;
    visitRandomMeshes(seed, options, [&](const MeshLevel& meshes) {
      expectSame(meshes);
      patches += meshes.patches.size();
    });
  }
}

/// A few levels to do harm to.
std::vector<CompactLevel> someLevels(unsigned seed, double boundSpacings = 0.0) {
  std::vector<CompactLevel> out;
  RandomMeshes options = randomMeshesOf(seed);
  if (boundSpacings > 0.0) options.boundSpacings = boundSpacings;
  options.firstKept = 1;
  options.lastKept = 4;
  visitRandomMeshes(seed, options, [&](const MeshLevel& meshes) {
    if (out.size() < 6) out.push_back(compactOf(meshes));
  });
  return out;
}

TEST(CompactMesh, EveryTruncatedLengthIsAnError) {
  // Not many triangles, so that there are not too many lengths.
  std::vector<CompactLevel> levels = someLevels(5);
  for (CompactLevel& level : someLevels(2, 30.0))
    if (level.words.size() < 30'000) levels.push_back(std::move(level));
  ASSERT_GT(levels.size(), 6U);
  for (const CompactLevel& whole : levels) {
    CompactLevel part = whole;
    while (!part.words.empty()) {
      part.words.pop_back();
      ASSERT_FALSE(validateCompactLevel(part).ok()) << part.words.size() << " of " << whole.words.size();
      ASSERT_TRUE(part.words.size() % 16 != 0 || !expandMeshes(part).ok());
    }
    CompactLevel longer = whole;
    longer.words.push_back(0);
    EXPECT_FALSE(validateCompactLevel(longer).ok());
  }
}

/// What holds of whatever is not refused: nothing points out of its patch.
void expectWithinRanges(const ExpandedMeshes& meshes) {
  for (const MeshLevel::Patch& patch : meshes.patches) {
    ASSERT_LE(size_t{patch.firstVertex} + patch.vertexCount, meshes.vertices.size());
    ASSERT_LE(size_t{patch.firstIndex} + patch.indexCount, meshes.indices.size());
    for (uint32_t i = 0; i < patch.indexCount; ++i)
      ASSERT_LT(meshes.indices[patch.firstIndex + i], patch.vertexCount);
    for (uint32_t i = 0; i < patch.vertexCount; ++i) {
      const PatchVertex& v = meshes.vertices[patch.firstVertex + i];
      ASSERT_TRUE(v.x() <= kTileCells && v.y() <= kTileCells && v.place >> 18 == 0);
      ASSERT_TRUE(std::isfinite(v.heightMeters) && std::isfinite(v.coarseMeters));
    }
  }
}

TEST(CompactMesh, FlippedBitsAreRefusedOrStayWithinRanges) {
  std::mt19937 random(7);
  int refused = 0, taken = 0;
  for (const unsigned seed : {5U, 2U, 3U}) {
    for (const CompactLevel& whole : someLevels(seed)) {
      const size_t heads = size_t{1} + static_cast<size_t>(patchCount(whole.level()));
      for (int turn = 0; turn < rounds(150); ++turn) {
        CompactLevel harmed = whole;
        const int flips = 1 + static_cast<int>(random() % 3);
        for (int i = 0; i < flips; ++i) {
          // Where the structure is, more often than among the heights.
          const size_t near = turn % 4 == 0 ? heads : turn % 4 == 1 ? heads + 300 : whole.words.size();
          harmed.words[random() % std::min(near, whole.words.size())] ^= 1U << random() % 32;
        }
        const auto expanded = expandMeshes(harmed);
        ASSERT_EQ(expanded.ok(), validateCompactLevel(harmed).ok());
        ++(expanded.ok() ? taken : refused);
        if (expanded.ok()) expectWithinRanges(*expanded);
      }
      // What went wrong left nothing behind.
      ASSERT_TRUE(validateCompactLevel(whole).ok());
    }
  }
  EXPECT_GT(refused, rounds(500));
  EXPECT_GT(taken, rounds(50));
}

TEST(CompactMesh, RandomWordsAreRefused) {
  std::mt19937 random(8);
  for (int turn = 0; turn < 20000; ++turn) {
    CompactLevel words;
    const size_t length = random() % 60;
    for (size_t i = 0; i < length; ++i)
      words.words.push_back(static_cast<uint32_t>(random()) >> random() % 32);
    if (!words.words.empty()) words.words[0] %= 32;
    if (length > 1) words.words[1] = 1U + static_cast<uint32_t>(patchCount(words.level()));
    EXPECT_FALSE(validateCompactLevel(words).ok());
  }
}

TEST(CompactMesh, TellsWhereAPatchIs) {
  const CompactLevel level = someLevels(2)[2];
  const auto expanded = expandMeshes(level);
  ASSERT_TRUE(expanded.ok());
  size_t end = 1 + expanded->patches.size();
  for (int i = 0; i < patchCount(level.level()); ++i) {
    const CompactPatch patch = compactPatch(level, i);
    const MeshLevel::Patch& meshes = expanded->patches[static_cast<size_t>(i)];
    EXPECT_EQ(patch.vertexCount, meshes.vertexCount);
    EXPECT_EQ(3 * patch.triangleCount, meshes.indexCount);
    EXPECT_EQ(patch.firstWord, end);
    end += patch.wordCount;
    const auto [a, b, c] = patch.corners;
    EXPECT_GT((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 0);
  }
  EXPECT_EQ(end, level.words.size());
}

}  // namespace
}  // namespace terrane
