#include "mesh_store.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "terrane/gpu/gl.h"

namespace terrane {
namespace {

/// Patches of random sizes, whose vertices and indices are random numbers.
std::shared_ptr<const MeshLevel> madeLevel(int level, std::mt19937& random) {
  const auto below = [&](uint32_t most) { return static_cast<uint32_t>(random() % most); };
  auto out = std::make_shared<MeshLevel>();
  out->level = level;
  for (int i = 0; i < 20; ++i) {
    MeshLevel::Patch patch;
    patch.firstVertex = static_cast<uint32_t>(out->vertices.size());
    patch.firstIndex = static_cast<uint32_t>(out->indices.size());
    patch.vertexCount = 3 + below(30);
    patch.indexCount = 3 * (1 + below(40));
    for (uint32_t v = 0; v < patch.vertexCount; ++v)
      out->vertices.push_back({below(1U << 18), static_cast<float>(below(1000)), 0.0F});
    for (uint32_t k = 0; k < patch.indexCount; ++k)
      out->indices.push_back(static_cast<uint16_t>(below(patch.vertexCount)));
    out->patches.push_back(patch);
  }
  return out;
}

template <class T>
std::vector<T> contentOf(const gpu::KeptBuffer& buffer) {
  std::vector<T> out(buffer.sizeBytes() / sizeof(T));
  glBindBuffer(GL_COPY_READ_BUFFER, buffer.name());
  glGetBufferSubData(GL_COPY_READ_BUFFER, 0, static_cast<GLsizeiptr>(buffer.sizeBytes()), out.data());
  return out;
}

/// Whatever was drawn before, around how many times the buffers were filled, and how often they grew: all
/// that a frame draws is there, word for word, and no two have a slot in common.
TEST(MeshStore, WhatAFrameDrawsIsThere) {
  auto made = gpu::Context::createHeadless();
  ASSERT_TRUE(made.ok()) << made.error().message;
  const std::unique_ptr<gpu::Context> context = std::move(made).value();
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    MeshStore store(*context, {.vertices = 256, .indices = 1024});
    std::vector<TileId> tiles;
    std::vector<std::shared_ptr<const MeshLevel>> levels;
    for (int i = 0; i < 12; ++i) {
      tiles.push_back({4, i, 3});
      levels.push_back(madeLevel(1, random));
      store.add(tiles.back(), levels.back());
    }
    const size_t firstBytes = 256 * sizeof(PatchVertex);
    bool hasGrown = false;
    for (int frame = 0; frame < 300; ++frame) {
      // Now and then a tile comes anew, and a frame fails.
      if (frame % 17 == 5) {
        const size_t i = random() % tiles.size();
        store.drop(tiles[i]);
        levels[i] = madeLevel(1, random);
        store.add(tiles[i], levels[i]);
      }
      store.beginFrame();
      if (frame % 23 == 7) {
        ASSERT_TRUE(store.place(tiles[random() % tiles.size()], 1, 0).ok());
        ASSERT_FALSE(store.place(tiles[0], 2, 0).ok());
        continue;
      }
      // Few patches that change little by little; later more than there was room for at first.
      struct Drawn {
        size_t tile;
        int patch;
        const MeshStore::Entry* entry;
      };
      std::vector<Drawn> drawn;
      const int share = frame < 200 ? 20 : 3;
      for (size_t i = 0; i < tiles.size(); ++i)
        for (int p = 0; p < 20; ++p) {
          if ((static_cast<int>(i) * 20 + p + frame / 4) % share != 0 && random() % 200 != 0) continue;
          const auto entry = store.place(tiles[i], 1, p);
          ASSERT_TRUE(entry.ok()) << entry.error().message;
          drawn.push_back({i, p, *entry});
        }
      const Status uploaded = store.upload();
      ASSERT_TRUE(uploaded.ok()) << uploaded.error().message;
      hasGrown |= store.vertices().sizeBytes() > firstBytes;

      const auto vertices = contentOf<PatchVertex>(store.vertices());
      const auto indices = contentOf<uint32_t>(store.indices());
      std::set<int> slots;
      for (const Drawn& each : drawn) {
        const MeshLevel& level = *levels[each.tile];
        const MeshLevel::Patch& patch = level.patches[static_cast<size_t>(each.patch)];
        EXPECT_TRUE(slots.insert(each.entry->slot).second);
        EXPECT_LT(each.entry->slot, store.highestSlot());
        for (uint32_t v = 0; v < patch.vertexCount; ++v) {
          const PatchVertex& is = vertices.at(each.entry->firstVertex + v);
          const PatchVertex& from = level.vertices[patch.firstVertex + v];
          ASSERT_EQ(is.place, from.place | static_cast<uint32_t>(each.entry->slot) << 18)
              << "frame " << frame;
          ASSERT_EQ(is.heightMeters, from.heightMeters);
        }
        for (uint32_t k = 0; k < patch.indexCount; ++k)
          ASSERT_EQ(indices.at(each.entry->firstIndex + k),
                    each.entry->firstVertex + level.indices[patch.firstIndex + k]);
      }
    }
    EXPECT_TRUE(hasGrown);
  }
}

}  // namespace
}  // namespace terrane
