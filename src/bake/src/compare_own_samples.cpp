#include "compare_own_samples.h"

#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "input_crs.h"
#include "stored_tiles.h"
#include "terrane/codec/cell_height.h"

namespace terrane {
namespace {

constexpr double kMostSamples = 1e6;
/// Pixels along the side of the squares that are read at a time, so that a square lies in few tiles.
constexpr int kComparedBlock = 256;

/// The surface's height at sample coordinates; nothing where there is no ground.
Result<std::optional<double>> surfaceAt(StoredTiles& tiles, const Manifest& manifest, double x, double y) {
  if (!(x >= 0.0 && y >= 0.0)) return std::optional<double>{};
  const auto col = static_cast<int64_t>(x), row = static_cast<int64_t>(y);
  if (col >= manifest.extentCols - 1 || row >= manifest.extentRows - 1) return std::optional<double>{};
  const TileId id{manifest.frame.finestLevel, static_cast<int32_t>(col / kTileCells),
                  static_cast<int32_t>(row / kTileCells)};
  TERRANE_ASSIGN(const auto stored, tiles.read(id));
  const auto cell = cellHeights(stored->tile.samples, static_cast<int>(col % kTileCells),
                                static_cast<int>(row % kTileCells));
  if (!cell) return std::optional<double>{};
  return std::optional(cell->at(x - static_cast<double>(col), y - static_cast<double>(row)));
}

}  // namespace

Result<OwnSamples> compareOwnSamples(const Dataset& dataset, const InputRaster& raster,
                                     const std::atomic<bool>* cancel, Progress& progress) {
  const Manifest& manifest = dataset.manifest();
  const Frame& frame = manifest.frame;
  const GdalMessages messages;
  OGRSpatialReference target;
  target.importFromWkt(manifest.crsWkt.c_str());
  target.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference source = raster.crs;
  source.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> transform(
      OGRCreateCoordinateTransformation(&source, &target));
  if (!transform)
    return makeError("{}: cannot be related to the dataset's CRS ({})", raster.path,
                     messages.reason("GDAL knows no way"));
  TERRANE_ASSIGN(const GdalDataset file, openRaster(raster.path));
  GDALRasterBand* const band = file->GetRasterBand(1);

  const double all = static_cast<double>(raster.width) * raster.height;
  const int stride = std::max(1, static_cast<int>(std::ceil(std::sqrt(all / kMostSamples))));
  StoredTiles tiles(dataset);
  OwnSamples out;
  double sum = 0.0;
  std::vector<uint8_t> mask(static_cast<size_t>(kComparedBlock) * kComparedBlock);
  std::vector<double> raw(static_cast<size_t>(kComparedBlock) * kComparedBlock), xs, ys, heights;
  const int rows = (raster.height + kComparedBlock - 1) / kComparedBlock,
            columns = (raster.width + kComparedBlock - 1) / kComparedBlock;
  progress.beginStage("own samples", int64_t{rows} * columns, "blocks");
  for (int block = 0; block < rows * columns; ++block) {
    if (cancel != nullptr && *cancel) return makeError("interrupted");
    const int left = block % columns * kComparedBlock, top = block / columns * kComparedBlock;
    const int width = std::min(kComparedBlock, raster.width - left),
              height = std::min(kComparedBlock, raster.height - top);
    const auto read = [&](GDALRasterBand& from, void* to, GDALDataType type) {
      return from.RasterIO(GF_Read, left, top, width, height, to, width, height, type, 0, 0, nullptr) ==
             CE_None;
    };
    if (!read(*band, raw.data(), GDT_Float64) ||
        (raster.mask && !read(*band->GetMaskBand(), mask.data(), GDT_Byte)))
      return makeError("{}: cannot be read at column {}, row {} ({})", raster.path, left, top,
                       messages.reason("GDAL refuses"));
    xs.clear();
    ys.clear();
    heights.clear();
    for (int y = (stride - top % stride) % stride; y < height; y += stride) {
      for (int x = (stride - left % stride) % stride; x < width; x += stride) {
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        const double value = raw[at];
        if (raster.isVoid(value) || (raster.mask && mask[at] == 0)) continue;
        const double col = left + x + 0.5, row = top + y + 0.5;
        const auto& g = raster.geoTransform;
        xs.push_back(g[0] + col * g[1] + row * g[2]);
        ys.push_back(g[3] + col * g[4] + row * g[5]);
        heights.push_back(raster.metersFromRaw(value));
      }
    }
    std::vector<int> known(xs.size(), 0);
    if (!xs.empty())
      transform->Transform(static_cast<int>(xs.size()), xs.data(), ys.data(), nullptr, known.data());
    for (size_t i = 0; i < xs.size(); ++i) {
      if (known[i] == 0) continue;
      TERRANE_ASSIGN(const auto surface,
                     surfaceAt(tiles, manifest, (xs[i] - frame.originEasting) / frame.spacingX,
                               (frame.originNorthing - ys[i]) / frame.spacingY));
      if (!surface) continue;
      const double meters = std::abs(*surface - heights[i]);
      ++out.compared;
      sum += meters;
      if (meters < out.largestMeters) continue;
      out.largestMeters = meters;
      out.largestEasting = xs[i];
      out.largestNorthing = ys[i];
    }
    progress.advance(1);
  }
  if (out.compared > 0) out.meanMeters = sum / static_cast<double>(out.compared);
  return out;
}

}  // namespace terrane
