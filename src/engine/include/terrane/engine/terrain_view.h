#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrane/engine/frame_control.h"
#include "terrane/engine/surface.h"
#include "terrane/lod/select_patches.h"
#include "terrane/render/terrain_renderer.h"
#include "terrane/stream/tile_stream.h"
#include "terrane/tiling/overview.h"

namespace terrane {

/// Which of the tiles that have come are drawn.
enum class StreamPolicy : uint8_t {
  Available,    ///< each as soon as it can be: the finest conforming cut of what is here
  Progressive,  ///< level by level: a set of tiles when all of it is here (Terrender, paper 000, 4.3.3)
  AllAtOnce,    ///< all that the camera needs when all of it is here (the same, without progressive increase)
};

struct ViewOptions {
  PatchSelection selection;  ///< tolerancePixels is tau, where frame control does not change it
  StreamOptions stream;
  uint64_t meshBytes = 192U << 20;         ///< of meshes; what is in use stays whatever this says
  uint64_t gpuGeometryBytes = 256U << 20;  ///< heights and masks on the GPU
  uint64_t gpuTextureBytes = 512U << 20;   ///< lighting and imagery on the GPU
  uint64_t uploadBytesAFrame = 8U << 20;   ///< at least one tile
  bool showImagery = true;
  bool prefetch = true;  ///< what a turn, or the way ahead, will need
  bool predict = true;   ///< whole chains of descendants in one round trip
  StreamPolicy policy = StreamPolicy::Available;
  /// Only for the other policies: the tiles that a camera needs with everything known. (Terrender's client
  /// holds the errors of the whole terrain; ours come with the tiles.)
  std::function<std::vector<TileId>(const Camera&, const PatchSelection&)> neededTiles;
};

/// What a frame of a view was made of. Sums are since the view was made.
struct ViewReport {
  StreamStatistics stream;
  double tau = 1.0;           ///< that was selected with, memory's share included
  double memoryFactor = 1.0;  ///< by how much tau is larger since the caches are small
  int64_t patches = 0;
  int64_t triangles = 0;
  double errorPixels = 0.0;  ///< bound over all patches in view
  int ramping = 0;           ///< diamonds that are fading in
  uint64_t tilesOnGpu = 0;
  uint64_t imageryOnGpu = 0;
  uint64_t gpuBytes = 0;   ///< reserved
  uint64_t meshBytes = 0;  ///< of meshes in memory
  uint64_t tilesUploaded = 0;
  uint64_t imageryUploaded = 0;
  int mostFramesUntilUsed = 0;  ///< between a wished tile being decoded and it being drawn from
  double selectSeconds = 0.0;   ///< choosing, this frame
};

/// A dataset that streams in, seen by one camera: closes the loop between what is wished for (lod), what is
/// here (stream) and what is on the GPU (render). A frame never waits for anything. One thread, that of the
/// renderer's context.
class TerrainView {
 public:
  /// All three must outlive the view, or a renderer the next setRenderer(). Without a `renderer` nothing is
  /// uploaded, and all that is decoded counts as drawable: for measuring without drawing.
  TerrainView(std::unique_ptr<Transport> transport, Workers& workers, TerrainRenderer* renderer,
              const ViewOptions& options = {});
  ~TerrainView();
  TerrainView(const TerrainView&) = delete;
  TerrainView& operator=(const TerrainView&) = delete;

  /// Draws with another renderer from now on. What is decoded stays; what was on the old one's GPU is
  /// uploaded again as it is needed.
  void setRenderer(TerrainRenderer* renderer);
  /// Asks for what the dataset begins with, as the first update() does: for callers that have something else
  /// to do until then. The clock is update()'s.
  void open(double nowSeconds);

  /// Takes in what has come, chooses what to draw and asks for what is missing. Returns whether the picture
  /// is another one than after the last call: camera, data, fading, tau, requestRender(). `nowSeconds` must
  /// not run backwards. Error: the dataset cannot be opened, or the GPU cannot hold what it should.
  Result<bool> update(const Camera& camera, double nowSeconds);
  /// What to draw. Empty before the first tile is here.
  const Cut& cut() const;
  /// The next update() returns true.
  void requestRender();

  StreamPhase phase() const;
  /// What went wrong last, in words; empty if nothing did.
  const std::string& problem() const;
  /// Only when phase() is Ready.
  const Manifest& manifest() const;
  GroundBox groundBox() const;

  /// For settings that change while flying: K, tau, exaggeration, metric.
  PatchSelection& selection();
  /// Lets tau follow the frame time; frames are told by frameTook().
  void setFrameControl(const FrameControl::Options& options);
  void frameTook(double frameSeconds, double elapsedSeconds);
  void setShowImagery(bool show);
  /// Which of the dataset's imagery layers are shown, by their names; at first all. What is on the GPU is
  /// composed anew, and seen as it was until then. Error: there is no such layer; before the view is Ready
  /// nobody knows, and those that turn out not to exist are passed over.
  Status setImageryLayers(const std::vector<std::string>& names);

  /// Lines in local metres along which the ground shall be here as finely as it is stored, or as some hundred
  /// tiles allow, so that questions about it are answered as well as the dataset can: a profile, a line of
  /// sight. Fetched after what is in view. Replaces the lines of the call before; none: nothing more.
  void studyGround(std::vector<std::vector<glm::dvec2>> lines);

  /// The finest ground that has come, to ask questions of until the next update(); only when Ready. Heights
  /// are not exaggerated.
  Surface surface() const;
  /// The height there, local metres, or nothing: no ground, or nothing is here yet.
  std::optional<double> heightAt(glm::dvec2 local) const;
  /// How far that height may be off the full-resolution source, metres: a bound.
  std::optional<double> errorAt(glm::dvec2 local) const;
  /// The ground under a pixel of a camera's picture (pixel coordinates, centres at .5), local metres, height
  /// not exaggerated: where the pixel's ray first meets the finest ground that has come, exactly. Drawn
  /// ground is within tau pixels of it. Nothing: it meets none. Well below a millisecond.
  std::optional<glm::dvec3> pick(const Camera& camera, glm::dvec2 pixel) const;

  /// Everything that this camera wishes for, as far as it can be had, is drawn, and nothing fades in.
  bool isSettled() const;
  const ViewReport& report() const;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace terrane
