#include "paper_form.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "cpu_time.h"
#include "terrane/base/parallel.h"

namespace terrane {
namespace {

constexpr int kPaperCells = 512;
constexpr double kQuantizationShare = 0.25;

/// Meshes all tiles of one level, each by one of many threads; keeps them if asked to.
Result<PaperLevel> meshLevel(const HeightGrid& grid, int cells, double boundMeters,
                             std::vector<StripMesh>* kept) {
  const int side = cells + 1;
  const int64_t tileCols = std::max<int64_t>(1, (grid.cols - 2) / cells + 1);
  const int64_t tileRows = std::max<int64_t>(1, (grid.rows - 2) / cells + 1);
  StripMeshOptions options;
  options.boundMeters = boundMeters;
  options.quantizationMeters = kQuantizationShare * boundMeters;

  PaperLevel level;
  std::mutex mutex;
  std::optional<Error> error;
  parallelFor(tileCols * tileRows, 0, [&](int64_t index) {
    std::vector<float> heights(static_cast<size_t>(side) * static_cast<size_t>(side));
    const double begin = threadSeconds();
    if (!grid.cut(index % tileCols * cells, index / tileCols * cells, side, heights)) return;
    auto mesh = encodeStripMesh(heights, side, options);
    const double seconds = threadSeconds() - begin;
    const std::lock_guard lock(mutex);
    if (!mesh.ok()) {
      error = mesh.error();
      return;
    }
    ++level.tiles;
    level.triangles += mesh->triangleCount;
    level.bits += mesh->bitCount();
    level.seconds += seconds;
    if (kept != nullptr) kept->push_back(std::move(*mesh));
  });
  if (error) return *error;
  return level;
}

}  // namespace

Result<PaperForm> encodePaperForm(HeightGrid grid, double spacingMeters, int shares) {
  PaperForm form;
  const auto add = [&](int cells, double spacings) -> Status {
    std::vector<StripMesh>* const kept = form.levels.empty() ? &form.finest : nullptr;
    TERRANE_ASSIGN(PaperLevel level, meshLevel(grid, cells, spacings * spacingMeters, kept));
    level.spacings = spacings;
    form.levels.push_back(level);
    return {};
  };

  // The extra levels, then the finest one itself and all above it.
  for (int share = shares; share > 1; share /= 2) TERRANE_TRY(add(kPaperCells / share, 1.0 / share));
  for (double spacings = 1.0;; spacings *= 2.0) {
    TERRANE_TRY(add(kPaperCells, spacings));
    if (std::max(grid.cols, grid.rows) <= kPaperCells + 1) return form;
    const double begin = threadSeconds();
    grid = meansOf(grid);
    form.levels.back().seconds += threadSeconds() - begin;
  }
}

Result<double> measurePaperDecoding(const std::vector<StripMesh>& meshes) {
  std::vector<uint32_t> vertices;
  std::vector<double> seconds;
  for (int turn = 0; turn < kTurns; ++turn) {
    TERRANE_ASSIGN(const double once, secondsOf([&]() -> Status {
                     for (const StripMesh& mesh : meshes) {
                       TERRANE_ASSIGN(const size_t triangles, decodeStripMesh(mesh, vertices));
                       if (triangles != mesh.triangleCount) return makeError("a strip decodes to less");
                     }
                     return {};
                   }));
    seconds.push_back(once);
  }
  return median(seconds);
}

}  // namespace terrane
