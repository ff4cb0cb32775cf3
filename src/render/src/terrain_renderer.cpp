#include "terrane/render/terrain_renderer.h"

#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "frame_block.h"
#include "frustum_lines.h"
#include "mesh_drawer.h"
#include "mesh_store.h"
#include "patch_drawer.h"
#include "patch_instances.h"
#include "picture_stages.h"
#include "sample_plan.h"
#include "shader_library.h"
#include "terrane/gpu/timer.h"
#include "tile_store.h"

namespace terrane {

namespace {

constexpr int kSceneUnit = 0;

struct Programs {
  gpu::Program shade;
  gpu::Program position;
  gpu::Program meshShade;
  gpu::Program meshPosition;
  gpu::Program meshLine;
  gpu::Program sky;
  gpu::Program present;
  gpu::Program line;
};

Result<Programs> makePrograms(const gpu::Context& context) {
  const ProgramRecipes recipes;
  TERRANE_ASSIGN(gpu::Program shade, makeProgram(context, recipes.shade));
  TERRANE_ASSIGN(gpu::Program position, makeProgram(context, recipes.position));
  TERRANE_ASSIGN(gpu::Program meshShade, makeProgram(context, recipes.meshShade));
  TERRANE_ASSIGN(gpu::Program meshPosition, makeProgram(context, recipes.meshPosition));
  TERRANE_ASSIGN(gpu::Program meshLine, makeProgram(context, recipes.meshLine));
  TERRANE_ASSIGN(gpu::Program sky, makeProgram(context, recipes.sky));
  TERRANE_ASSIGN(gpu::Program present, makeProgram(context, recipes.present));
  TERRANE_ASSIGN(gpu::Program line, makeProgram(context, recipes.line));
  for (const gpu::Program* program : {&shade, &position, &meshShade, &meshPosition, &meshLine})
    TileStore::setSamplers(*program);
  for (const gpu::Program* program : {&shade, &meshShade}) ImageryStore::setSamplers(*program);
  for (const gpu::Program* program : {&meshShade, &meshPosition, &meshLine})
    MeshDrawer::setSamplers(*program);
  return Programs{std::move(shade),    std::move(position), std::move(meshShade), std::move(meshPosition),
                  std::move(meshLine), std::move(sky),      std::move(present),   std::move(line)};
}

/// The pictures that a frame passes through before it is finished; kept while the size stays the same.
struct SceneTargets {
  SamplePlan plan;
  gpu::Framebuffer scene;                      ///< linear light, perhaps multi-sampled
  std::unique_ptr<gpu::Framebuffer> resolved;  ///< one sample; only where the scene has more
  const gpu::Framebuffer& finished() const { return resolved ? *resolved : scene; }
};

Result<SceneTargets> makeSceneTargets(const gpu::Context& context, const SamplePlan& plan, int width,
                                      int height) {
  gpu::FramebufferSpec spec{.width = width * plan.shrink,
                            .height = height * plan.shrink,
                            .samples = plan.multisamples,
                            .color = gpu::kRgba16F,
                            .depth = true};
  TERRANE_ASSIGN(gpu::Framebuffer scene, gpu::Framebuffer::create(context, spec));
  SceneTargets out{plan, std::move(scene), nullptr};
  if (plan.multisamples > 1) {
    spec.samples = 1;
    spec.depth = false;
    TERRANE_ASSIGN(gpu::Framebuffer resolved, gpu::Framebuffer::create(context, spec));
    out.resolved = std::make_unique<gpu::Framebuffer>(std::move(resolved));
  }
  return out;
}

/// Depth tests keep what is nearer, whichever way depth runs.
void beginDepth(const gpu::Context& context, const DepthRange& depth) {
  if (depth.reversed) context.setClipDepthZeroToOne(true);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(depth.reversed ? GL_GREATER : GL_LESS);
  glClearDepthf(static_cast<float>(depth.clearDepth()));
}

void endDepth(const gpu::Context& context, const DepthRange& depth) {
  if (depth.reversed) context.setClipDepthZeroToOne(false);
  glDisable(GL_DEPTH_TEST);
}

}  // namespace

struct TerrainRenderer::Parts {
  Parts(gpu::Context& owner, Programs made)
      : context(owner),
        programs(std::move(made)),
        tiles(owner),
        imagery(owner),
        meshes(owner),
        meshDrawer(owner),
        stages(owner),
        timer(owner) {}

  gpu::Context& context;
  Programs programs;
  TileStore tiles;
  ImageryStore imagery;
  MeshStore meshes;
  PatchDrawer patches;
  MeshDrawer meshDrawer;
  PictureStages stages;
  gpu::Buffer frameBlock{GL_UNIFORM_BUFFER};
  gpu::Buffer lineVertices{GL_ARRAY_BUFFER};
  gpu::VertexArray lines;
  gpu::VertexArray nothing;
  gpu::Timer timer;
  std::optional<SceneTargets> targets;
  std::optional<gpu::Framebuffer> picture;
  std::optional<gpu::Framebuffer> positions;

  /// Uploads what the frame draws, and the block that both kinds of drawing share. Gives patches, triangles
  /// and tiles.
  Result<DrawStatistics> prepare(const Cut& cut, const Frame& frame, const Camera& camera,
                                 double exaggeration, FrameBlock& block) {
    const LatticePoint anchor = anchorNear(Lattice(cut.latticeDepth), frame, camera.eyeLocal);
    DrawStatistics out;
    imagery.beginPages();
    if (cut.surface == SurfaceKind::Meshes) {
      TERRANE_TRY(meshDrawer.setCut(cut, frame, anchor, tiles, imagery, meshes));
      out.patches = meshDrawer.patchCount();
      out.triangles = meshDrawer.triangleCount();
      out.tiles = meshDrawer.tileCount();
    } else {
      TERRANE_ASSIGN(const PatchInstances instances, makePatchInstances(cut, frame, anchor, tiles, &imagery));
      patches.setInstances(cut.grid, instances);
      out.patches = instances.patchCount();
      out.triangles = out.patches * cut.grid.trianglesPerPatch();
      out.tiles = instances.tileCount;
    }
    TERRANE_TRY(imagery.finishPages());
    placeLattice(block, frame, camera, exaggeration, cut.latticeDepth, anchor, cut.grid.cellsPerSide());
    tiles.refreshBorders();
    tiles.bind();
    imagery.bind();
    bindBlock(block);
    return out;
  }

  void bindBlock(const FrameBlock& block) {
    frameBlock.upload(&block, sizeof(block));
    glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, frameBlock.name());
  }

  /// Draws the ground, shaded. Returns the number of draw calls.
  int drawGround(const Cut& cut, const RenderStyle& style) {
    if (cut.surface == SurfaceKind::Patches) {
      programs.shade.use();
      return patches.draw(programs.shade);
    }
    programs.meshShade.use();
    programs.meshShade.setFloat("uNearer", 1.0F);
    int calls = meshDrawer.draw(programs.meshShade, meshes);
    if (style.outline != OutlineMode::Wireframe) return calls;
    // Lines, a hair nearer than the triangles.
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    glDepthMask(GL_FALSE);
    programs.meshLine.use();
    programs.meshLine.setFloat("uNearer", 0.9995F);
    meshDrawer.drawLines(meshes);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    return calls + 1;
  }

  /// Draws the places under the pixels of `positions`. Returns the number of draw calls.
  int drawPlaces(const Cut& cut, const DepthRange& depth) {
    positions->bind();
    beginDepth(context, depth);
    glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    int calls = 0;
    if (cut.surface == SurfaceKind::Patches) {
      programs.position.use();
      calls = patches.draw(programs.position);
    } else {
      programs.meshPosition.use();
      programs.meshPosition.setFloat("uNearer", 1.0F);
      calls = meshDrawer.drawPlaces(programs.meshPosition, meshes);
    }
    endDepth(context, depth);
    return calls;
  }
  Status makePositions(const Camera& camera) {
    return makeTarget(
        positions, {.width = camera.width, .height = camera.height, .color = gpu::kRgba32F, .depth = true});
  }

  void drawSky(const DepthRange& depth) const {
    // Behind everything: where depth is still what it was cleared to.
    glDepthFunc(depth.reversed ? GL_GEQUAL : GL_LEQUAL);
    glDepthMask(GL_FALSE);
    programs.sky.use();
    nothing.bind();
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  void drawFrustum(const FrustumOverlay& overlay, const Camera& camera, const DepthRange& depth, int shrink) {
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    // Faint where the ground hides it, full where it does not.
    for (const bool hidden : {true, false}) {
      const auto vertices = makeFrustumLines(overlay, camera, depth, camera.width * shrink,
                                             camera.height * shrink, 2.0 * shrink, hidden ? 0.3F : 1.0F);
      if (vertices.empty()) continue;
      lineVertices.upload(vertices.data(), vertices.size() * sizeof(LineVertex));
      lines.setAttribute(
          lineVertices,
          {.location = 0, .components = 4, .offsetBytes = 0, .strideBytes = sizeof(LineVertex)});
      lines.setAttribute(
          lineVertices,
          {.location = 1, .components = 2, .offsetBytes = 16, .strideBytes = sizeof(LineVertex)});
      lines.setAttribute(
          lineVertices,
          {.location = 2, .components = 4, .offsetBytes = 24, .strideBytes = sizeof(LineVertex)});
      if (hidden)
        glDisable(GL_DEPTH_TEST);
      else
        glEnable(GL_DEPTH_TEST);
      programs.line.use();
      glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size()));
    }
    glDisable(GL_BLEND);
  }

  void present(const gpu::Texture& from, int shrink, const gpu::Framebuffer& target) const {
    target.bind();
    glDisable(GL_DEPTH_TEST);
    from.bindToUnit(kSceneUnit);
    programs.present.setSampler("uScene", kSceneUnit);
    programs.present.setInt("uShrink", shrink);
    nothing.bind();
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glBindVertexArray(0);
  }

  Status makeTargets(const Camera& camera, int samples) {
    const SamplePlan plan =
        planSamples(context.limits(), context.workarounds(), samples, camera.width, camera.height);
    const bool fits = targets && targets->plan.multisamples == plan.multisamples &&
                      targets->plan.shrink == plan.shrink &&
                      targets->scene.spec().width == camera.width * plan.shrink &&
                      targets->scene.spec().height == camera.height * plan.shrink;
    if (fits) return {};
    targets.reset();
    TERRANE_ASSIGN(SceneTargets made, makeSceneTargets(context, plan, camera.width, camera.height));
    targets.emplace(std::move(made));
    return {};
  }

  /// Makes `kept` a framebuffer of that size and format, unless it is one already.
  Status makeTarget(std::optional<gpu::Framebuffer>& kept, const gpu::FramebufferSpec& spec) const {
    if (kept && kept->spec().width == spec.width && kept->spec().height == spec.height) return {};
    kept.reset();
    TERRANE_ASSIGN(gpu::Framebuffer made, gpu::Framebuffer::create(context, spec));
    kept.emplace(std::move(made));
    return {};
  }
};

TerrainRenderer::TerrainRenderer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
TerrainRenderer::~TerrainRenderer() = default;

Result<std::unique_ptr<TerrainRenderer>> TerrainRenderer::create(gpu::Context& context) {
  TERRANE_ASSIGN(Programs programs, makePrograms(context));
  auto parts = std::make_unique<Parts>(context, std::move(programs));
  return std::unique_ptr<TerrainRenderer>(new TerrainRenderer(std::move(parts)));
}

Status TerrainRenderer::reserve(int tiles, int imageryTiles) {
  TERRANE_TRY(parts_->tiles.reserve(tiles));
  return parts_->imagery.reserve(imageryTiles);
}
size_t TerrainRenderer::geometryBytesPerTile() {
  return kTileSampleCount * sizeof(float) + Coverage::kBytes;
}
size_t TerrainRenderer::lightingBytesPerTile() {
  return size_t{kAtlasWidth} * kAtlasHeight * sizeof(PackedGradient);
}
size_t TerrainRenderer::imageryBytesPerTile() {
  return size_t{4} * kImageryUploadSide * kImageryUploadSide;
}

Status TerrainRenderer::uploadTile(TileId id, const Tile& tile,
                                   std::shared_ptr<const PreparedTile> prepared) {
  return parts_->tiles.upload(id, tile.samples, *prepared);
}
Status TerrainRenderer::uploadTile(TileId id, const Tile& tile) {
  return uploadTile(id, tile, prepareTile(tile.samples));
}
bool TerrainRenderer::hasTile(TileId id) const {
  return parts_->tiles.find(id) != nullptr;
}
void TerrainRenderer::dropTile(TileId id) {
  parts_->tiles.drop(id);
  parts_->meshes.drop(id);
}
void TerrainRenderer::addMeshes(TileId id, std::shared_ptr<const MeshLevel> meshes) {
  parts_->meshes.add(id, std::move(meshes));
}
bool TerrainRenderer::hasMeshes(TileId id, int level) const {
  return parts_->meshes.has(id, level);
}
void TerrainRenderer::dropMeshes(TileId id, int level) {
  parts_->meshes.drop(id, level);
}
size_t TerrainRenderer::tileCount() const {
  return parts_->tiles.tileCount();
}
size_t TerrainRenderer::gpuBytes() const {
  return parts_->tiles.gpuBytes() + parts_->imagery.gpuBytes() + parts_->meshes.gpuBytes() +
         parts_->stages.lines.gpuBytes();
}

Status TerrainRenderer::uploadImagery(TileId id, std::span<const uint8_t> rgba) {
  return parts_->imagery.upload(id, rgba);
}
void TerrainRenderer::updateImagery(TileId id, int x, int y, int width, int height,
                                    std::span<const uint8_t> rgba) {
  parts_->imagery.update(id, {x, y, width, height}, rgba);
}
bool TerrainRenderer::hasImagery(TileId id) const {
  return parts_->imagery.has(id);
}
void TerrainRenderer::dropImagery(TileId id) {
  parts_->imagery.drop(id);
}

Status TerrainRenderer::setLines(std::span<const GroundLine> lines) {
  return setPreparedLines(*prepareLines(lines));
}
Status TerrainRenderer::setPreparedLines(const PreparedLines& lines) {
  return parts_->stages.lines.set(lines);
}
Status TerrainRenderer::setPass(const std::string& name, std::string_view fragment, glm::dvec3 originLocal) {
  return parts_->stages.passes.set(name, fragment, originLocal);
}
void TerrainRenderer::movePass(const std::string& name, glm::dvec3 originLocal) {
  parts_->stages.passes.move(name, originLocal);
}
void TerrainRenderer::removePass(const std::string& name) {
  parts_->stages.passes.remove(name);
}
Status TerrainRenderer::setPassUniform(const std::string& name, const std::string& uniform,
                                       std::span<const float> values) {
  return parts_->stages.passes.setUniform(name, uniform, values);
}

Result<DrawStatistics> TerrainRenderer::draw(const Cut& cut, const Frame& frame, const Camera& camera,
                                             const RenderStyle& style, const gpu::Framebuffer& target) {
  Parts& parts = *parts_;
  TERRANE_CHECK(target.spec().width == camera.width && target.spec().height == camera.height,
                "a camera of {} x {}, a picture of {} x {}", camera.width, camera.height, target.spec().width,
                target.spec().height);
  TERRANE_CHECK(style.exaggeration > 0.0, "exaggeration {}", style.exaggeration);
  TERRANE_TRY(parts.makeTargets(camera, style.samples));
  const SceneTargets& targets = *parts.targets;
  const DepthRange depth = chooseDepthRange(parts.context, frame, camera);
  FrameBlock block = makeFrameBlock(frame, camera, style, depth, targets.plan.shrink);
  // note: meshes have no grid whose lines the fragments could tell; theirs are drawn as lines.
  if (cut.surface == SurfaceKind::Meshes && style.outline == OutlineMode::Wireframe)
    block.style.y = static_cast<int32_t>(OutlineMode::None);
  TERRANE_ASSIGN(DrawStatistics statistics, parts.prepare(cut, frame, camera, style.exaggeration, block));

  // The ground, then the sky behind it, then lines over both.
  parts.timer.begin();
  targets.scene.bind();
  beginDepth(parts.context, depth);
  glClearColor(0.0F, 0.0F, 0.0F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const bool perSample = targets.plan.multisamples > 1;
  if (perSample) parts.context.setSampleShading(true);
  statistics.drawCalls = parts.drawGround(cut, style);
  if (perSample) parts.context.setSampleShading(false);
  parts.drawSky(depth);
  if (style.frustum) parts.drawFrustum(*style.frustum, camera, depth, targets.plan.shrink);
  endDepth(parts.context, depth);
  if (targets.resolved) targets.scene.resolveInto(*targets.resolved);
  const gpu::Texture* finished = &targets.finished().color();
  int shrink = targets.plan.shrink;
  if (!parts.stages.isEmpty()) {
    // Stages see the picture's own pixels, and the place under each.
    TERRANE_TRY(parts.makePositions(camera));
    block.pixel.z = static_cast<float>(camera.width);
    block.pixel.w = static_cast<float>(camera.height);
    parts.bindBlock(block);
    statistics.drawCalls += parts.drawPlaces(cut, depth);
    TERRANE_ASSIGN(finished,
                   parts.stages.run(*finished, shrink, parts.positions->color(), camera, style.exaggeration));
    shrink = 1;
  }
  parts.present(*finished, shrink, target);
  parts.timer.end();
  TERRANE_TRY(parts.context.checkFrame("drawing a picture"));

  statistics.samples = targets.plan.samples();
  return statistics;
}

Result<TerrainRenderer::Picture> TerrainRenderer::drawPicture(const Cut& cut, const Frame& frame,
                                                              const Camera& camera,
                                                              const RenderStyle& style) {
  TERRANE_TRY(parts_->makeTarget(parts_->picture, {.width = camera.width, .height = camera.height}));
  Picture out;
  TERRANE_ASSIGN(out.statistics, draw(cut, frame, camera, style, *parts_->picture));
  out.rgba = parts_->picture->readRgba8();
  out.statistics.gpuSeconds = parts_->timer.seconds();
  return out;
}

Result<std::vector<glm::dvec3>> TerrainRenderer::drawPositions(const Cut& cut, const Frame& frame,
                                                               const Camera& camera, double exaggeration) {
  Parts& parts = *parts_;
  TERRANE_CHECK(exaggeration > 0.0, "exaggeration {}", exaggeration);
  TERRANE_TRY(parts.makePositions(camera));
  const DepthRange depth = chooseDepthRange(parts.context, frame, camera);
  RenderStyle style;
  style.exaggeration = exaggeration;
  FrameBlock block = makeFrameBlock(frame, camera, style, depth, 1);
  TERRANE_TRY(parts.prepare(cut, frame, camera, exaggeration, block));

  parts.drawPlaces(cut, depth);
  const std::vector<float> fromEye = parts.positions->readRgba32F();
  TERRANE_TRY(parts.context.checkErrors("drawing the position buffer"));

  // Ground has a normal, the sky 0. Rasterisers interpolate with errors of their own: put back on the pixel's
  // ray, only the depth's is left. Where the place is off the ray by more than that, a triangle is seen
  // edge-on and only its place is on the surface.
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  constexpr double kOffRayPixels = 0.02;
  std::vector<glm::dvec3> out(fromEye.size() / 4, glm::dvec3(kNothing));
  for (size_t i = 0; i < out.size(); ++i) {
    if (fromEye[4 * i + 3] == 0.0F) continue;
    const glm::dvec3 offset(fromEye[4 * i], fromEye[4 * i + 1], fromEye[4 * i + 2]);
    const size_t width = static_cast<size_t>(camera.width);
    const glm::dvec2 pixel{static_cast<double>(i % width) + 0.5, static_cast<double>(i / width) + 0.5};
    const glm::dvec3 onRay = camera.rayThroughPixel(pixel) * glm::dot(offset, camera.forward);
    const double tolerance = kOffRayPixels / camera.pixelsPerTangent() * glm::dot(offset, camera.forward);
    const glm::dvec3 place = camera.eyeLocal + (glm::length(onRay - offset) <= tolerance ? onRay : offset);
    out[i] = {place.x, place.y, place.z / exaggeration};
  }
  return out;
}

}  // namespace terrane
