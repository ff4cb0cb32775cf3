#include "measure_drawing.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <map>

#include "draw_shaders.h"
#include "terrane/gpu/buffer.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/vertex_array.h"

namespace terrane {

namespace {

constexpr int kTurns = 15;
constexpr int kBinding = 0;
/// As in ground.glsl.
constexpr size_t kMostTiles = 512;
struct DrawBlock {
  glm::mat4 clipFromLocal;
  glm::vec4 tiles[kMostTiles];
  glm::vec4 samples;
};
static_assert(sizeof(DrawBlock) == 64 + 16 * kMostTiles + 16);

/// A frame's worth of triangles in both forms.
struct FrameMeshes {
  DrawBlock block{};
  std::vector<PatchVertex> vertices;
  std::vector<uint32_t> indices;
  std::vector<uint32_t> packed;        ///< three a triangle
  std::vector<size_t> firstOfTile{0};  ///< in `packed`, and the end
};

/// The levels to draw: those of the finest tiles' first mesh level that has enough triangles, from the middle
/// on.
std::vector<const MadeLevel*> levelsToDraw(const MadeMeshes& meshes, int64_t triangles) {
  std::map<int, int64_t> counts;
  const auto isFinest = [&](const MadeLevel& level) {
    return level.tile.level == meshes.manifest.frame.finestLevel;
  };
  for (const MadeLevel& level : meshes.levels)
    if (isFinest(level)) counts[level.meshes.level] += static_cast<int64_t>(level.meshes.indices.size() / 3);
  int chosen = -1;
  for (const auto& [level, count] : counts) {
    if (chosen >= 0 && counts[chosen] >= triangles) break;
    chosen = level;
  }
  std::vector<const MadeLevel*> out;
  glm::dvec2 middle(0.0);
  for (const MadeLevel& level : meshes.levels) {
    if (!isFinest(level) || level.meshes.level != chosen) continue;
    out.push_back(&level);
    middle += glm::dvec2(level.tile.col, level.tile.row);
  }
  middle /= static_cast<double>(out.size());
  const auto distance = [&](const MadeLevel* level) {
    return std::max(std::abs(level->tile.col - middle.x), std::abs(level->tile.row - middle.y));
  };
  std::stable_sort(out.begin(), out.end(),
                   [&](const MadeLevel* a, const MadeLevel* b) { return distance(a) < distance(b); });
  out.resize(std::min(out.size(), kMostTiles));
  return out;
}

uint32_t packedVertex(const PatchVertex& v, float low, float step) {
  const float code = std::clamp(std::round((v.heightMeters - low) / step), 0.0F, 4095.0F);
  return static_cast<uint32_t>(v.x()) | static_cast<uint32_t>(v.y()) << 10 |
         static_cast<uint32_t>(code) << 20;
}

FrameMeshes frameOf(const MadeMeshes& meshes, int64_t triangles, double aspect) {
  FrameMeshes out;
  const Frame& frame = meshes.manifest.frame;
  const auto spacing = static_cast<float>(frame.spacingXMeters());
  out.block.samples.x = spacing;
  glm::vec3 low(std::numeric_limits<float>::infinity()), high(-std::numeric_limits<float>::infinity());
  TileId origin{};
  for (const MadeLevel* level : levelsToDraw(meshes, triangles)) {
    const size_t slot = out.firstOfTile.size() - 1;
    if (slot == 0) origin = level->tile;
    const std::vector<PatchVertex>& vertices = level->meshes.vertices;
    const auto [least, most] = std::minmax_element(
        vertices.begin(), vertices.end(),
        [](const PatchVertex& a, const PatchVertex& b) { return a.heightMeters < b.heightMeters; });
    const float base = least->heightMeters;
    const float step = std::max(1e-3F, (most->heightMeters - base) / 4095.0F);
    const float side = spacing * static_cast<float>(kTileCells);
    const glm::vec4 tile(static_cast<float>(level->tile.col - origin.col) * side,
                         -static_cast<float>(level->tile.row - origin.row) * side, base, step);
    out.block.tiles[slot] = tile;
    low = glm::min(low, glm::vec3(tile.x, tile.y - side, base));
    high = glm::max(high, glm::vec3(tile.x + side, tile.y, most->heightMeters));

    for (const MeshLevel::Patch& patch : level->meshes.patches) {
      if (static_cast<int64_t>(out.indices.size() / 3) >= triangles) break;
      const auto firstVertex = static_cast<uint32_t>(out.vertices.size());
      for (uint32_t i = 0; i < patch.vertexCount; ++i) {
        PatchVertex vertex = vertices[patch.firstVertex + i];
        vertex.place |= static_cast<uint32_t>(slot) << 18;
        out.vertices.push_back(vertex);
      }
      for (uint32_t i = 0; i < patch.indexCount; ++i) {
        const uint32_t index = level->meshes.indices[patch.firstIndex + i];
        out.indices.push_back(firstVertex + index);
        out.packed.push_back(packedVertex(vertices[patch.firstVertex + index], base, step));
      }
    }
    out.firstOfTile.push_back(out.packed.size());
    if (static_cast<int64_t>(out.indices.size() / 3) >= triangles) break;
  }

  // From the south, at a slope, all of it in view.
  const glm::vec3 middle = 0.5F * (low + high);
  const float reach = std::max(high.x - low.x, high.y - low.y);
  const glm::vec3 eye = middle + reach * glm::vec3(0.0F, -0.8F, 0.75F);
  const glm::mat4 clipFromView =
      glm::perspective(0.9F, static_cast<float>(aspect), 0.05F * reach, 4.0F * reach);
  out.block.clipFromLocal = clipFromView * glm::lookAt(eye, middle, glm::vec3(0.0F, 0.0F, 1.0F));
  return out;
}

Result<gpu::Program> programOf(const gpu::Context& context, const std::string& vertexFile) {
  const auto file = [](std::string_view name) {
    const auto& all = drawShaderFiles();
    return *std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.name == name; });
  };
  TERRANE_ASSIGN(gpu::Program program,
                 gpu::Program::create(context, {.name = vertexFile,
                                                .vertex = {file("ground.glsl"), file(vertexFile)},
                                                .fragment = {file("ground.frag")},
                                                .captured = {}}));
  program.bindBlock("DrawBlock", kBinding);
  return program;
}

/// How many pixels of two pictures differ by more than rounded heights explain, and how many show ground.
struct Difference {
  int64_t ground = 0;
  int64_t differing = 0;
};
Difference compare(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  Difference out;
  for (size_t i = 0; i < a.size(); i += 4) {
    out.ground += a[i + 3] != 0 ? 1 : 0;
    out.differing += a[i + 3] != b[i + 3] || std::abs(a[i] - b[i]) > 24 ? 1 : 0;
  }
  return out;
}

}  // namespace

Result<DrawingTimes> measureDrawing(const gpu::Context& context, const MadeMeshes& meshes, int64_t triangles,
                                    int width, int height) {
  TERRANE_ASSIGN(const gpu::Program attributes, programOf(context, "mesh_attributes.vert"));
  TERRANE_ASSIGN(const gpu::Program packed, programOf(context, "mesh_packed.vert"));
  TERRANE_ASSIGN(const gpu::Framebuffer picture,
                 gpu::Framebuffer::create(context, {.width = width, .height = height, .depth = true}));
  const FrameMeshes frame = frameOf(meshes, triangles, static_cast<double>(width) / height);

  gpu::Buffer block(GL_UNIFORM_BUFFER), vertices(GL_ARRAY_BUFFER), indices(GL_ELEMENT_ARRAY_BUFFER);
  gpu::Buffer packedIndices(GL_ELEMENT_ARRAY_BUFFER);
  const gpu::VertexArray withAttributes, without;
  block.upload(&frame.block, sizeof(frame.block));
  glBindBufferBase(GL_UNIFORM_BUFFER, kBinding, block.name());
  vertices.upload(frame.vertices.data(), frame.vertices.size() * sizeof(PatchVertex));
  withAttributes.setAttribute(
      vertices,
      {.location = 0, .components = 1, .type = GL_UNSIGNED_INT, .strideBytes = sizeof(PatchVertex)});
  withAttributes.setAttribute(vertices, {.location = 1,
                                         .components = 2,
                                         .type = GL_FLOAT,
                                         .offsetBytes = sizeof(uint32_t),
                                         .strideBytes = sizeof(PatchVertex)});
  withAttributes.setIndices(indices);
  indices.upload(frame.indices.data(), frame.indices.size() * sizeof(uint32_t));
  without.setIndices(packedIndices);
  packedIndices.upload(frame.packed.data(), frame.packed.size() * sizeof(uint32_t));

  const auto begin = [&] {
    picture.bind();
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
    glClearDepth(1.0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  };
  const auto drawAttributes = [&] {
    begin();
    attributes.use();
    withAttributes.bind();
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(frame.indices.size()), GL_UNSIGNED_INT, nullptr);
    glFinish();
  };
  const auto drawPacked = [&] {
    begin();
    packed.use();
    without.bind();
    for (size_t i = 0; i + 1 < frame.firstOfTile.size(); ++i) {
      packed.setInt("tile", static_cast<int>(i));
      const size_t first = frame.firstOfTile[i];
      glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(frame.firstOfTile[i + 1] - first), GL_UNSIGNED_INT,
                     reinterpret_cast<const void*>(first * sizeof(uint32_t)));
    }
    glFinish();
  };

  // The same pictures, but for what rounded heights do to them.
  drawAttributes();
  const std::vector<uint8_t> first = picture.readRgba8();
  drawPacked();
  const Difference difference = compare(first, picture.readRgba8());
  TERRANE_TRY(context.checkErrors("drawing meshes"));
  if (difference.ground * 10 < int64_t{width} * height || difference.differing * 20 > difference.ground)
    return makeError("two ways to draw {} triangles differ in {} of {} pixels", frame.indices.size() / 3,
                     difference.differing, difference.ground);

  std::vector<double> attributesSeconds, packedSeconds;
  for (int turn = 0; turn < kTurns; ++turn) {
    attributesSeconds.push_back(secondsOf(drawAttributes));
    packedSeconds.push_back(secondsOf(drawPacked));
  }
  return DrawingTimes{static_cast<int64_t>(frame.indices.size() / 3), 1e3 * medianOf(attributesSeconds),
                      1e3 * medianOf(packedSeconds)};
}

}  // namespace terrane
