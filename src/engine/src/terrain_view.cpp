#include "terrane/engine/terrain_view.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <unordered_set>
#include <utility>

#include "gathered_sets.h"
#include "studied_ground.h"
#include "terrane/engine/terrain.h"
#include "terrane/lod/mesh_placement.h"
#include "terrane/lod/predict_wishes.h"
#include "tile_uploads.h"
#include "view_ground.h"
#include "view_imagery.h"
#include "view_prefetch.h"

namespace terrane {
namespace {

/// Guessed descendants that are wished for along.
constexpr size_t kMostPredicted = 400;
/// What is ahead, farther ahead and around is looked at so often each.
constexpr double kPrefetchSeconds = 0.15;
constexpr double kLeastAheadSeconds = 0.5, kMostAheadSeconds = 1.5;
constexpr double kAheadChance = 0.5;
constexpr double kFarAheadSeconds = 3.0;
constexpr double kFarAheadChance = 0.25;
constexpr double kAroundChance = 0.1;
/// Around the camera, behind it too, something coarser will do for the moment after a turn.
constexpr double kAroundTauFactor = 2.0;
/// How quickly tau gives way to small caches, and comes back.
constexpr double kMemoryRisePerSecond = 1.0;
constexpr double kMemoryFallPerSecond = 0.1;
/// Ground that is studied may take this share of the room for decoded tiles.
constexpr uint64_t kStudiedShare = 4;
constexpr uint64_t kMostStudied = 128;
/// note: right under the camera no tau is large enough, so this must end.
constexpr double kMostMemoryFactor = 64.0;
constexpr double kRoomBeforeFall = 0.7;

bool isSame(const Camera& a, const Camera& b) {
  return a.eyeLocal == b.eyeLocal && a.right == b.right && a.up == b.up && a.forward == b.forward &&
         a.fovyRadians == b.fovyRadians && a.width == b.width && a.height == b.height;
}
bool isSame(const PatchSelection& a, const PatchSelection& b) {
  return a.surface == b.surface && a.grid.k == b.grid.k && a.tolerancePixels == b.tolerancePixels &&
         a.texelPixels == b.texelPixels && a.cull == b.cull && a.hide == b.hide && a.morph == b.morph &&
         a.metric == b.metric && a.exaggeration == b.exaggeration && a.nearMeters == b.nearMeters &&
         a.levelsBelowData == b.levelsBelowData;
}

StreamOptions streamOptions(const ViewOptions& options) {
  StreamOptions out = options.stream;
  out.inOrder = options.policy != StreamPolicy::Available;
  return out;
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

class TerrainView::State {
 public:
  State(std::unique_ptr<Transport> transport, Workers& workers, TerrainRenderer* renderer,
        const ViewOptions& options)
      : options_(options),
        workers_(workers),
        renderer_(renderer),
        stream_(std::move(transport), workers, streamOptions(options)),
        ground_(stream_),
        sets_(options.policy, options.neededTiles) {
    control_ = FrameControl(
        {.leastTau = options.selection.tolerancePixels, .mostTau = options.selection.tolerancePixels});
  }

  void setRenderer(TerrainRenderer* renderer) {
    renderer_ = renderer;
    tiles_.reset();
    imagery_.reset();
    heldChanges_ = 0;
    cut_ = Cut();
    history_ = MorphHistory();
    lastChosenSeconds_.reset();
    lastCamera_.reset();
    requested_ = true;
  }

  Result<bool> update(const Camera& camera, double nowSeconds) {
    ++frame_;
    stream_.poll(nowSeconds);
    if (stream_.phase() == StreamPhase::Failed) return makeError("{}", stream_.problem());
    if (stream_.phase() == StreamPhase::Opening) return false;
    if (tiles_ == nullptr) TERRANE_TRY(begin(nowSeconds));

    const std::vector<TileKey> news = stream_.takeNews();
    tiles_->arrived(news, frame_);
    TERRANE_ASSIGN(bool tilesCame, uploadTiles());
    tilesCame |= tiles_->takeMeshes();
    TERRANE_ASSIGN(const bool imageryCame, imagery_->upload(options_.uploadBytesAFrame, chosenFrame_));
    adaptToMemory(nowSeconds);

    PatchSelection selection = options_.selection;
    selection.tolerancePixels = control_.tau() * memoryFactor_;
    selection.texelPixels *= memoryFactor_;
    const bool isMoved = !lastCamera_ || !isSame(camera, *lastCamera_) || !isSame(selection, lastSelection_);
    const bool isChanged =
        isMoved || tilesCame || imageryCame || cut_.ramping > 0 || std::exchange(requested_, false);
    // Where nothing changed there is nothing to choose; but what is given up for a while comes again.
    if (isChanged || !news.empty() || nowSeconds >= nextWishSeconds_) choose(camera, selection, nowSeconds);
    lastSeconds_ = nowSeconds;
    report();
    return isChanged;
  }

  ViewOptions options_;
  Workers& workers_;
  TerrainRenderer* renderer_;
  TileStream stream_;
  ViewGround ground_;
  FrameControl control_;
  Cut cut_;
  ViewReport report_;
  bool requested_ = true;

  bool isSettled() const {
    return tiles_ != nullptr && cut_.ramping == 0 && stream_.isIdle() && !tiles_->isShortOfRoom() &&
           !tiles_->isPending(order_) && !tiles_->areMeshesUnderWay() && cut_.meshWishes.empty() &&
           imagery_->isSettled() && sets_.isEmpty();
  }
  void setShowImagery(bool show) {
    options_.showImagery = show;
    if (imagery_ != nullptr) imagery_->setShown(show);
    requested_ = true;
  }
  void studyGround(std::vector<std::vector<glm::dvec2>> lines) {
    studied_.setLines(std::move(lines));
    requested_ = true;
  }
  Status setImageryLayers(const std::vector<std::string>& names) {
    if (stream_.phase() == StreamPhase::Ready) {
      const auto& known = stream_.manifest().imagery;
      for (const std::string& name : names)
        if (std::none_of(known.begin(), known.end(), [&](const auto& layer) { return layer.name == name; }))
          return makeError("{}: has no imagery layer '{}'", stream_.where(), name);
    }
    imageryLayers_ = names;
    if (imagery_ != nullptr) imagery_->setLayers(names);
    requested_ = true;
    return {};
  }

 private:
  Status begin(double nowSeconds) {
    const size_t decodedBytes = kTileSampleCount * (sizeof(float) + sizeof(SampleState)) + 4096;
    const uint64_t geometry = options_.gpuGeometryBytes / TerrainRenderer::geometryBytesPerTile();
    const uint64_t decoded = options_.stream.decodedBytes / decodedBytes;
    const uint64_t lit = options_.gpuTextureBytes / 2 / TerrainRenderer::lightingBytesPerTile();
    const int places = static_cast<int>(std::clamp<uint64_t>(std::min({geometry, decoded, lit}), 1, 2048));
    const bool hasImagery = !stream_.manifest().imagery.empty() && options_.showImagery;
    const uint64_t left = options_.gpuTextureBytes -
                          std::min(options_.gpuTextureBytes,
                                   static_cast<uint64_t>(places) * TerrainRenderer::lightingBytesPerTile());
    const int pictures =
        hasImagery
            ? static_cast<int>(std::clamp<uint64_t>(left / TerrainRenderer::imageryBytesPerTile(), 1, 1024))
            : 0;
    if (renderer_ != nullptr) TERRANE_TRY(renderer_->reserve(places, pictures));
    tiles_ = std::make_unique<TileUploads>(stream_, workers_, renderer_, static_cast<size_t>(places));
    imagery_ = std::make_unique<ViewImagery>(stream_, renderer_, static_cast<size_t>(pictures));
    if (imageryLayers_) imagery_->setLayers(*imageryLayers_);
    imagery_->setShown(hasImagery);
    order_ = {TileId{}};
    // The root may have come with the directory: then it is drawn in this frame already.
    const TileKey root = TileKey::elevation(TileId{});
    if (stream_.elevation(root.tile) != nullptr) return {};
    const StreamWish wish{root, 2.0, 1.0, 1.0, 1.0, 1.0};
    stream_.want({&wish, 1});
    stream_.poll(nowSeconds);
    return {};
  }

  Result<bool> uploadTiles() {
    if (options_.policy == StreamPolicy::Available) {
      TERRANE_ASSIGN(const int count,
                     tiles_->upload(order_, options_.uploadBytesAFrame, frame_, chosenFrame_));
      return count > 0;
    }
    // A set of tiles is drawn from when all of it is here.
    const auto isHere = [&](TileId id) {
      const std::shared_ptr<const Tile> tile = stream_.elevation(id);
      return (tile != nullptr && tile->samples.layerCount == stream_.manifest().scale.layerCount) ||
             stream_.isLost(wholeKey(id));
    };
    if (!sets_.isComplete(isHere)) return false;
    TERRANE_ASSIGN(const int count, tiles_->upload(sets_.take(), UINT64_MAX, frame_, chosenFrame_));
    return count > 0;
  }

  /// Where the caches cannot hold what tau asks for, tau gives way: coarser, but all of it.
  void adaptToMemory(double nowSeconds) {
    const double elapsed = std::clamp(nowSeconds - lastSeconds_, 0.0, 0.1);
    if (tiles_->isShortOfRoom())
      memoryFactor_ = std::min(memoryFactor_ * (1.0 + kMemoryRisePerSecond * elapsed), kMostMemoryFactor);
    else if (memoryFactor_ > 1.0 && static_cast<double>(tiles_->neededSince(chosenFrame_)) <
                                        kRoomBeforeFall * static_cast<double>(tiles_->capacity()))
      memoryFactor_ = std::max(memoryFactor_ / (1.0 + kMemoryFallPerSecond * elapsed), 1.0);
  }

  void choose(const Camera& camera, const PatchSelection& selection, double nowSeconds) {
    const Manifest& manifest = stream_.manifest();
    const double started = seconds();
    // A camera that jumps sees a new picture, not one that changes.
    const double elapsed = lastChosenSeconds_ ? nowSeconds - *lastChosenSeconds_ : 0.0;
    tiles_->beginTurn();
    if (selection.surface == SurfaceKind::Meshes) tiles_->makeRootMeshes();
    cut_ = selectPatches(selection, manifest.frame, manifest.scale, camera, *tiles_, &history_, elapsed);
    report_.selectSeconds = seconds() - started;
    lastChosenSeconds_ = nowSeconds;
    chosenFrame_ = frame_;
    tiles_->need(cut_, frame_);
    tiles_->wishMeshes(cut_.meshWishes);
    imagery_->choose(camera, selection.exaggeration, *tiles_, frame_);
    forecast_.seen(camera, nowSeconds);

    std::vector<StreamWish> wishes;
    order_.clear();
    if (options_.policy == StreamPolicy::Available)
      wishForAvailable(camera, selection, nowSeconds, wishes);
    else
      wishForSet(camera, selection, wishes);
    imagery_->addWishes(wishes);
    studied_.addWishes(stream_, mostStudied(), nowSeconds, wishes);
    if (options_.prefetch && options_.policy == StreamPolicy::Available) addPrefetch(wishes);
    stream_.want(wishes);
    tiles_->keepMeshesWithin(options_.meshBytes);
    if (tiles_->changes() != heldChanges_) {
      heldChanges_ = tiles_->changes();
      stream_.hold(tiles_->tiles());
    }

    lastCamera_ = camera;
    lastSelection_ = selection;
    nextWishSeconds_ = nowSeconds + 0.5;
  }

  size_t mostStudied() const {
    constexpr uint64_t kTileBytes = kTileSampleCount * (sizeof(float) + sizeof(SampleState));
    const uint64_t fit = options_.stream.decodedBytes / kStudiedShare / kTileBytes;
    return static_cast<size_t>(std::clamp<uint64_t>(fit, 1, kMostStudied));
  }

  static StreamWish wishFor(const TileWish& wish, double tau, double chance) {
    return {TileKey::elevation(wish.tile, wish.layer),  static_cast<double>(wish.errorPixels),
            static_cast<double>(wish.errorAfterPixels), tau,
            static_cast<double>(wish.areaPixels),       chance};
  }
  /// A tile with all layers of significance.
  TileKey wholeKey(TileId id) const {
    return TileKey::elevation(id, stream_.manifest().scale.layerCount - 1);
  }

  void wishForAvailable(const Camera& camera, const PatchSelection& selection, double nowSeconds,
                        std::vector<StreamWish>& wishes) {
    const Manifest& manifest = stream_.manifest();
    const double tau = selection.tolerancePixels;
    for (const TileWish& wish : cut_.wishes) {
      wishes.push_back(wishFor(wish, tau, 1.0));
      order_.push_back(wish.tile);
    }
    // note: of a root that is not here yet nothing can be told.
    if (options_.predict && tiles_->has(TileId{})) {
      const auto isStored = [this](TileId id) { return stream_.isStored(TileKey::elevation(id)); };
      for (const TileWish& wish : predictWishes(cut_.wishes, selection, manifest.frame, manifest.scale,
                                                camera, *tiles_, isStored, kMostPredicted)) {
        wishes.push_back(wishFor(wish, tau, 1.0));
        order_.push_back(wish.tile);
      }
    }
    if (options_.prefetch && nowSeconds >= nextPrefetchSeconds_) look(camera, selection, nowSeconds);
  }

  /// What will be wished for: ahead, where the camera will be when answers come; farther ahead, so that much
  /// can come together; and around it, for turns. One of them at a time, as each takes as long as choosing.
  void look(const Camera& camera, const PatchSelection& selection, double nowSeconds) {
    nextPrefetchSeconds_ = nowSeconds + kPrefetchSeconds / kLooks;
    lastLook_ = (lastLook_ + 1) % kLooks;
    std::vector<StreamWish>& out = prefetch_[static_cast<size_t>(lastLook_)];
    out.clear();
    if (lastLook_ == kAhead) {
      ahead_ = forecast_.ahead(
          std::clamp(3.0 * stream_.statistics().latencySeconds, kLeastAheadSeconds, kMostAheadSeconds));
      if (ahead_) prefetchFor(*ahead_, selection, kAheadChance, out);
    } else if (lastLook_ == kFarAhead) {
      farAhead_ = forecast_.ahead(kFarAheadSeconds);
      if (farAhead_) prefetchFor(*farAhead_, selection, kFarAheadChance, out);
    } else {
      PatchSelection around = selection;
      around.cull = false;
      around.tolerancePixels *= kAroundTauFactor;
      prefetchFor(camera, around, kAroundChance, out);
    }
  }

  void prefetchFor(const Camera& camera, PatchSelection selection, double chance,
                   std::vector<StreamWish>& out) {
    const Manifest& manifest = stream_.manifest();
    selection.hide = false;
    const auto wishes = selectPatches(selection, manifest.frame, manifest.scale, camera, *tiles_).wishes;
    for (const TileWish& wish : wishes) out.push_back(wishFor(wish, selection.tolerancePixels, chance));
    // Meshes that are not made there hold back what will be wished for below them.
    if (!options_.predict || selection.surface != SurfaceKind::Meshes || !tiles_->has(TileId{})) return;
    const auto isStored = [this](TileId id) { return stream_.isStored(TileKey::elevation(id)); };
    for (const TileWish& wish : predictWishes(wishes, selection, manifest.frame, manifest.scale, camera,
                                              *tiles_, isStored, kMostPredicted))
      out.push_back(wishFor(wish, selection.tolerancePixels, chance));
  }

  void addPrefetch(std::vector<StreamWish>& wishes) {
    for (const auto& look : prefetch_) wishes.insert(wishes.end(), look.begin(), look.end());
    if (ahead_)
      imagery_->addPrefetch(*ahead_, options_.selection.exaggeration, *tiles_, kAheadChance, wishes);
    if (farAhead_)
      imagery_->addPrefetch(*farAhead_, options_.selection.exaggeration, *tiles_, kFarAheadChance, wishes);
  }

  void wishForSet(const Camera& camera, const PatchSelection& selection, std::vector<StreamWish>& wishes) {
    sets_.begin(camera, selection, *tiles_, [this](TileId id) {
      return stream_.isLost(wholeKey(id)) || !stream_.isStored(wholeKey(id));
    });
    for (const TileId id : sets_.tiles()) {
      wishes.push_back({wholeKey(id), 2.0, 1.0, 1.0, 1.0, 1.0});
      order_.push_back(id);
    }
  }

  void report() {
    report_.stream = stream_.statistics();
    report_.tau = lastSelection_.tolerancePixels;
    report_.memoryFactor = memoryFactor_;
    report_.patches = static_cast<int64_t>(cut_.patches.size());
    report_.triangles = triangleCount(cut_);
    report_.errorPixels = 0.0;
    for (const Patch& patch : cut_.patches)
      report_.errorPixels = std::max(report_.errorPixels, static_cast<double>(patch.errorPixels));
    report_.ramping = cut_.ramping;
    report_.tilesOnGpu = tiles_->size();
    report_.imageryOnGpu = imagery_->onGpu();
    report_.gpuBytes = renderer_ != nullptr ? renderer_->gpuBytes() : 0;
    report_.meshBytes = tiles_->meshBytes();
    report_.tilesUploaded = tiles_->uploaded();
    report_.imageryUploaded = imagery_->uploaded();
    report_.mostFramesUntilUsed = tiles_->mostFramesUntilUsed();
  }

  std::unique_ptr<TileUploads> tiles_;
  std::unique_ptr<ViewImagery> imagery_;
  std::optional<std::vector<std::string>> imageryLayers_;  ///< absent: all
  GatheredSets sets_;
  StudiedGround studied_;
  MorphHistory history_;
  CameraForecast forecast_;
  std::optional<Camera> ahead_, farAhead_;
  enum Look : uint8_t { kAhead, kFarAhead, kAround };
  static constexpr int kLooks = 3;
  std::array<std::vector<StreamWish>, kLooks> prefetch_;
  int lastLook_ = kAround;
  std::vector<TileId> order_;  ///< wished tiles, as the last choice had them
  uint64_t frame_ = 0;
  uint64_t chosenFrame_ = 0;  ///< of the last choice: what it draws from stays
  uint64_t heldChanges_ = 0;  ///< of the tiles that the stream holds
  double memoryFactor_ = 1.0;
  double lastSeconds_ = 0.0;
  double nextWishSeconds_ = 0.0;
  double nextPrefetchSeconds_ = 0.0;
  std::optional<double> lastChosenSeconds_;
  std::optional<Camera> lastCamera_;
  PatchSelection lastSelection_;
};

TerrainView::TerrainView(std::unique_ptr<Transport> transport, Workers& workers, TerrainRenderer* renderer,
                         const ViewOptions& options)
    : state_(std::make_unique<State>(std::move(transport), workers, renderer, options)) {}
TerrainView::~TerrainView() = default;

void TerrainView::setRenderer(TerrainRenderer* renderer) {
  state_->setRenderer(renderer);
}
void TerrainView::open(double nowSeconds) {
  state_->stream_.poll(nowSeconds);
}
Result<bool> TerrainView::update(const Camera& camera, double nowSeconds) {
  return state_->update(camera, nowSeconds);
}
const Cut& TerrainView::cut() const {
  return state_->cut_;
}
void TerrainView::requestRender() {
  state_->requested_ = true;
}
StreamPhase TerrainView::phase() const {
  return state_->stream_.phase();
}
const std::string& TerrainView::problem() const {
  return state_->stream_.problem();
}
const Manifest& TerrainView::manifest() const {
  return state_->stream_.manifest();
}
GroundBox TerrainView::groundBox() const {
  return groundBoxOf(manifest());
}
PatchSelection& TerrainView::selection() {
  return state_->options_.selection;
}
void TerrainView::setFrameControl(const FrameControl::Options& options) {
  state_->control_ = FrameControl(options);
}
void TerrainView::frameTook(double frameSeconds, double elapsedSeconds) {
  state_->control_.frameTook(frameSeconds, elapsedSeconds);
}
void TerrainView::studyGround(std::vector<std::vector<glm::dvec2>> lines) {
  state_->studyGround(std::move(lines));
}
void TerrainView::setShowImagery(bool show) {
  state_->setShowImagery(show);
}
Status TerrainView::setImageryLayers(const std::vector<std::string>& names) {
  return state_->setImageryLayers(names);
}
Surface TerrainView::surface() const {
  return Surface(state_->ground_);
}
std::optional<double> TerrainView::heightAt(glm::dvec2 local) const {
  return heightHere(state_->ground_, local);
}
std::optional<double> TerrainView::errorAt(glm::dvec2 local) const {
  return errorHere(state_->ground_, local);
}
std::optional<glm::dvec3> TerrainView::pick(const Camera& camera, glm::dvec2 pixel) const {
  return pickGround(state_->ground_, camera, state_->options_.selection.exaggeration, pixel);
}
bool TerrainView::isSettled() const {
  return state_->isSettled();
}
const ViewReport& TerrainView::report() const {
  return state_->report_;
}

}  // namespace terrane
