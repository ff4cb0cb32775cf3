#include "terrane/engine/terrain.h"

#include <algorithm>
#include <chrono>
#include <unordered_set>
#include <utility>

#include "terrane/engine/imagery_pool.h"
#include "terrane/gpu/context.h"
#include "terrane/lod/mesh_placement.h"
#include "terrane/render/terrain_renderer.h"
#include "terrane/stream/open_dataset.h"

namespace terrane {

namespace {

/// Tiles on the GPU beyond those of the current frame that are kept for the next ones.
constexpr size_t kSpareGpuTiles = 256;
/// Tiles that are decoded between two selections: enough to keep all cores busy, few enough that the most
/// urgent ones come first.
constexpr size_t kLoadBatch = 64;

class Stopwatch {
 public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

struct Terrain::State {
  Dataset dataset;
  TerrainOptions options;
  TilePool pool;
  ImageryPool imagery;
  // note: the renderer must go before its context.
  std::unique_ptr<gpu::Context> context;
  std::unique_ptr<TerrainRenderer> renderer;
  std::unordered_set<TileId, TileIdHash> onGpu;
  std::unordered_set<TileId, TileIdHash> imageryOnGpu;
  FrameReport report;

  State(Dataset opened, const TerrainOptions& wanted)
      : dataset(std::move(opened)), options(wanted), pool(dataset), imagery(dataset, allLayers()) {}

  std::vector<size_t> allLayers() const {
    std::vector<size_t> out;
    for (size_t i = 0; i < dataset.manifest().imagery.size(); ++i) out.push_back(i);
    return out;
  }
};

Terrain::Terrain(std::unique_ptr<State> state) : state_(std::move(state)) {}
Terrain::~Terrain() = default;

Result<std::unique_ptr<Terrain>> Terrain::open(const std::string& directoryOrUrl,
                                               const TerrainOptions& options) {
  TERRANE_ASSIGN(Dataset dataset, openDataset(directoryOrUrl));
  return over(std::move(dataset), options);
}
std::unique_ptr<Terrain> Terrain::over(Dataset dataset, const TerrainOptions& options) {
  return std::unique_ptr<Terrain>(new Terrain(std::make_unique<State>(std::move(dataset), options)));
}

const Dataset& Terrain::dataset() const {
  return state_->dataset;
}
TilePool& Terrain::tiles() {
  return state_->pool;
}
const FrameReport& Terrain::report() const {
  return state_->report;
}
std::string Terrain::rendererName() const {
  return state_->context ? state_->context->rendererName() : std::string();
}

GroundBox Terrain::groundBox() const {
  return groundBoxOf(state_->dataset.manifest());
}

GroundBox groundBoxOf(const Manifest& manifest) {
  const glm::dvec2 southEast = manifest.frame.localFromSample(
      {static_cast<double>(manifest.extentCols - 1), static_cast<double>(manifest.extentRows - 1)});
  return {{0.0, southEast.y, manifest.minHeight}, {southEast.x, 0.0, manifest.maxHeight}};
}

Cut Terrain::select(const Camera& camera, const PatchSelection& selection) {
  const Stopwatch watch;
  const Manifest& manifest = state_->dataset.manifest();
  Cut cut = selectPatches(selection, manifest.frame, manifest.scale, camera, state_->pool);
  while (!cut.meshWishes.empty()) {
    state_->pool.makeMeshes(cut.meshWishes);
    cut = selectPatches(selection, manifest.frame, manifest.scale, camera, state_->pool);
  }
  state_->report.selectMilliseconds = watch.milliseconds();
  return cut;
}

Result<Cut> Terrain::selectAndLoad(const Camera& camera, const PatchSelection& selection, size_t maxTiles) {
  double loading = 0.0;
  Cut cut = select(camera, selection);
  while (!cut.wishes.empty() && maxTiles > 0) {
    std::vector<TileId> batch;
    for (const TileWish& wish : cut.wishes)
      if (batch.size() < std::min(kLoadBatch, maxTiles)) batch.push_back(wish.tile);
    maxTiles -= batch.size();
    const Stopwatch watch;
    TERRANE_TRY(state_->pool.load(batch));
    loading += watch.milliseconds();
    cut = select(camera, selection);
  }
  state_->report.loadMilliseconds = loading;
  return cut;
}

Status Terrain::startDrawing() {
  State& state = *state_;
  if (state.renderer) return {};
  TERRANE_ASSIGN(state.context, gpu::Context::createHeadless(
                                    {.api = state.options.openGlEs ? gpu::Api::OpenGlEs : gpu::Api::OpenGl,
                                     .forceSoftware = state.options.forceSoftware}));
  TERRANE_ASSIGN(state.renderer, TerrainRenderer::create(*state.context));
  return {};
}

Status Terrain::setLines(std::span<const GroundLine> lines) {
  TERRANE_TRY(startDrawing());
  return state_->renderer->setLines(lines);
}
Status Terrain::setPass(const std::string& name, std::string_view fragment, glm::dvec3 originLocal) {
  TERRANE_TRY(startDrawing());
  return state_->renderer->setPass(name, fragment, originLocal);
}

Status Terrain::prepareDrawing(const Cut& cut) {
  TERRANE_TRY(startDrawing());
  State& state = *state_;

  // What the frame reads: heights, shading, and the shading tile's parent that it blends with.
  std::unordered_set<TileId, TileIdHash> needed, read;
  int deepest = 0;
  float error = 0.0F;
  for (const Patch& patch : cut.patches) {
    needed.insert(patch.tile);
    needed.insert(patch.shadingTile);
    deepest = std::max(deepest, patch.tile.level);
    error = std::max(error, patch.errorPixels);
  }
  read = needed;
  for (const TileId id : read)
    if (!id.isRoot()) needed.insert(id.parent());

  if (state.onGpu.size() > needed.size() + kSpareGpuTiles) {
    for (auto at = state.onGpu.begin(); at != state.onGpu.end();) {
      if (needed.count(*at) != 0) {
        ++at;
        continue;
      }
      state.renderer->dropTile(*at);
      at = state.onGpu.erase(at);
    }
  }
  for (const TileId id : needed) {
    if (!state.onGpu.insert(id).second) continue;
    TERRANE_TRY(state.renderer->uploadTile(id, state.pool.findOrImply(id)));
  }
  if (cut.surface == SurfaceKind::Meshes) {
    for (const Patch& patch : cut.patches) {
      const int level = patch.triangle.diamond.level - 2 * patch.tile.level;
      if (!state.renderer->hasMeshes(patch.tile, level))
        state.renderer->addMeshes(patch.tile, state.pool.meshes().get(patch.tile, level));
    }
  }

  state.report.patches = static_cast<int64_t>(cut.patches.size());
  state.report.triangles = triangleCount(cut);
  state.report.tiles = static_cast<int64_t>(read.size());
  state.report.deepestLevel = deepest;
  state.report.errorPixels = static_cast<double>(error);
  state.report.bytesRead = state.pool.bytesRead();
  state.report.residentBytes = state.pool.residentBytes();
  state.report.gpuBytes = state.renderer->gpuBytes();
  return {};
}

Status Terrain::showImagery(const std::vector<std::string>& names) {
  const auto& known = state_->dataset.manifest().imagery;
  std::vector<size_t> layers;
  for (const std::string& name : names) {
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const ImageryLayerRecord& layer) { return layer.name == name; });
    if (found == known.end())
      return makeError("{}: has no imagery layer '{}'; terrane info lists those it has",
                       state_->dataset.directory(), name);
    layers.push_back(static_cast<size_t>(found - known.begin()));
  }
  std::sort(layers.begin(), layers.end());
  for (const TileId id : state_->imageryOnGpu) state_->renderer->dropImagery(id);
  state_->imageryOnGpu.clear();
  state_->imagery = ImageryPool(state_->dataset, layers);
  return {};
}

Status Terrain::prepareImagery(const Camera& camera, const RenderStyle& style) {
  State& state = *state_;
  const bool wanted = style.mode == ColorMode::Shaded && !state.imagery.empty();
  const std::vector<TileId> needed =
      wanted ? state.imagery.tilesFor(camera, style.exaggeration, state.pool) : std::vector<TileId>();
  TERRANE_TRY(state.imagery.load(needed));

  // note: what stays from other frames would need its ancestors; so only this frame's tiles stay.
  const std::unordered_set<TileId, TileIdHash> keep(needed.begin(), needed.end());
  for (auto at = state.imageryOnGpu.begin(); at != state.imageryOnGpu.end();) {
    if (keep.count(*at) == 0) state.renderer->dropImagery(*at);
    at = keep.count(*at) != 0 ? std::next(at) : state.imageryOnGpu.erase(at);
  }
  for (const TileId id : needed) {
    if (!state.imageryOnGpu.insert(id).second) continue;
    TERRANE_TRY(state.renderer->uploadImagery(id, state.imagery.bordered(id)));
  }
  state.report.imageryTiles = static_cast<int64_t>(needed.size());
  state.report.imageryBytes = state.imagery.bytesRead();
  state.report.bytesRead = state.pool.bytesRead() + state.imagery.bytesRead();
  state.report.gpuBytes = state.renderer->gpuBytes();
  return {};
}

Result<Picture> Terrain::draw(const Cut& cut, const Camera& camera, const RenderStyle& style) {
  const Stopwatch watch;
  TERRANE_TRY(prepareDrawing(cut));
  TERRANE_TRY(prepareImagery(camera, style));
  const Frame& frame = state_->dataset.manifest().frame;
  TERRANE_ASSIGN(TerrainRenderer::Picture drawn, state_->renderer->drawPicture(cut, frame, camera, style));
  state_->report.drawCalls = drawn.statistics.drawCalls;
  state_->report.drawMilliseconds = watch.milliseconds();
  return Picture{camera.width, camera.height, std::move(drawn.rgba)};
}

Result<PositionPicture> Terrain::drawPositions(const Cut& cut, const Camera& camera, double exaggeration) {
  const Stopwatch watch;
  TERRANE_TRY(prepareDrawing(cut));
  const Frame& frame = state_->dataset.manifest().frame;
  TERRANE_ASSIGN(std::vector<glm::dvec3> local,
                 state_->renderer->drawPositions(cut, frame, camera, exaggeration));
  state_->report.drawMilliseconds = watch.milliseconds();
  return PositionPicture{camera.width, camera.height, std::move(local)};
}

}  // namespace terrane
