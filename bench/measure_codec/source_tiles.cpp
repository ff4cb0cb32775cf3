#include "source_tiles.h"

#include <algorithm>
#include <cmath>

#include "terrane/bake/source.h"

namespace terrane {
namespace {

bool sameLattice(const SourcePlan& plan, const Manifest& manifest) {
  const Frame& a = plan.frame;
  const Frame& b = manifest.frame;
  return a.finestLevel == b.finestLevel && a.originEasting == b.originEasting &&
         a.originNorthing == b.originNorthing && a.spacingX == b.spacingX && a.spacingY == b.spacingY &&
         plan.extentCols == manifest.extentCols && plan.extentRows == manifest.extentRows;
}

/// Samples with a height; the last column and row count where no tile follows.
int64_t countOwn(const std::vector<float>& heights, bool lastCol, bool lastRow) {
  const int cols = lastCol ? kTileSamples : kTileCells;
  const int rows = lastRow ? kTileSamples : kTileCells;
  int64_t count = 0;
  for (int y = 0; y < rows; ++y) {
    const auto row = heights.begin() + ptrdiff_t{y} * kTileSamples;
    count += std::count_if(row, row + cols, [](float height) { return !std::isnan(height); });
  }
  return count;
}

}  // namespace

Result<std::vector<SourceTile>> readSourceTiles(const std::string& input, const Manifest& manifest) {
  SourceOptions options;
  options.inputs = {input};
  SilentProgress silent;
  TERRANE_ASSIGN(const std::unique_ptr<Source> source, openSource(options, silent));
  const SourcePlan& plan = source->plan();
  if (!sameLattice(plan, manifest))
    return makeError("{}: the dataset beside it was built from something else; remove it", input);

  TERRANE_ASSIGN(const std::unique_ptr<SourceReader> reader, source->openReader());
  std::vector<SourceTile> tiles;
  std::vector<float> heights(kTileSampleCount);
  std::vector<uint16_t> ranks(kTileSampleCount);
  const auto tileCols = static_cast<int32_t>((plan.extentCols - 2) / kTileCells + 1);
  const auto tileRows = static_cast<int32_t>((plan.extentRows - 2) / kTileCells + 1);
  for (int32_t row = 0; row < tileRows; ++row) {
    for (int32_t col = 0; col < tileCols; ++col) {
      const TileId id{plan.frame.finestLevel, col, row};
      if (!source->mayTouch(id)) continue;
      TERRANE_ASSIGN(const bool any, reader->readTile(id, heights, ranks));
      if (!any) continue;
      tiles.push_back({id, heights, countOwn(heights, col + 1 == tileCols, row + 1 == tileRows)});
    }
  }
  if (tiles.empty()) return makeError("{}: holds no heights", input);
  return tiles;
}

TileContent contentOf(const SourceTile& tile, const ElevationScale& scale, double boundMeters) {
  TileContent content;
  content.cols = content.rows = kTileSamples;
  content.boundMeters = boundMeters;
  content.heights = tile.heights;
  float last = *std::find_if(content.heights.begin(), content.heights.end(),
                             [](float height) { return !std::isnan(height); });
  for (float& height : content.heights) {
    if (std::isnan(height)) height = last;
    last = height;
  }
  content.integers.resize(content.heights.size());
  std::transform(content.heights.begin(), content.heights.end(), content.integers.begin(), [&](float height) {
    return static_cast<int32_t>(boundMeters > 0.0 ? std::llround(height / (2.0 * boundMeters))
                                                  : scale.integerFromHeight(height));
  });
  return content;
}

std::vector<TileContent> voidMasks(const std::vector<SourceTile>& tiles) {
  std::vector<TileContent> masks;
  for (const SourceTile& tile : tiles) {
    TileContent mask;
    mask.cols = mask.rows = kTileSamples;
    mask.heights = tile.heights;
    for (const float height : tile.heights) mask.integers.push_back(std::isnan(height) ? 0 : 1);
    if (mask.range() > 0) masks.push_back(std::move(mask));
  }
  return masks;
}

}  // namespace terrane
