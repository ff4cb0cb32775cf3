#include "imagery_sampler.h"

#include <cpl_string.h>
#include <gdal_alg.h>

#include <algorithm>
#include <cmath>

#include "input_crs.h"
#include "terrane/base/float4.h"

namespace terrane {

namespace {

constexpr int kSide = kImageryTileSide;
/// Exact transformations are made this many texels apart; between them places are interpolated, which is off
/// by thousandths of a texel.
constexpr int kGridStep = 16;
/// A kernel as wide as this many pixels would be wider than what is gained.
constexpr double kLargestScale = 8.0;
/// Pixels hardly finer than texels need no wider kernel.
constexpr double kSmallestScale = 1.25;
/// Where a block's pixels are more than these, its texels lie on both sides of a seam of the transformation.
constexpr int64_t kMostWindowPixels = 6'000'000;

double cubic(double t) {
  t = std::abs(t);
  if (t < 1.0) return (1.5 * t - 2.5) * t * t + 1.0;
  return t < 2.0 ? ((-0.5 * t + 2.5) * t - 4.0) * t + 2.0 : 0.0;
}

double kernelScale(double pixelsPerTexel) {
  return pixelsPerTexel < kSmallestScale ? 1.0 : std::min(pixelsPerTexel, kLargestScale);
}
int tapCount(double scale) {
  return 2 * static_cast<int>(std::ceil(2.0 * scale));
}

/// Weights of `count` pixels from `first` on for a texel at pixel coordinate `center`; their sum is 1.
void fillWeights(double center, double scale, int first, int count, float* weights) {
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    const double weight = cubic((first + i + 0.5 - center) / scale);
    weights[i] = static_cast<float>(weight);
    sum += weight;
  }
  for (int i = 0; i < count; ++i) weights[i] = static_cast<float>(static_cast<double>(weights[i]) / sum);
}
int firstTap(double center, int count) {
  return static_cast<int>(std::floor(center - 0.5)) - count / 2 + 1;
}

/// A sum of weighted pixels as a texel: back from colours times alpha, overshoot cut off.
void storeTexel(const float* sum, uint8_t* texel) {
  const float alpha = std::clamp(sum[3], 0.0F, 255.0F);
  if (alpha < 0.5F) {
    texel[0] = texel[1] = texel[2] = texel[3] = 0;
    return;
  }
  const float factor = 255.0F / alpha;
  for (int c = 0; c < 3; ++c)
    texel[c] = static_cast<uint8_t>(std::clamp(sum[c] * factor, 0.0F, 255.0F) + 0.5F);
  texel[3] = static_cast<uint8_t>(alpha + 0.5F);
}

}  // namespace

PictureSampler::PictureSampler(const PlacedPicture& picture, const ImageryFrame& frame, int level)
    : picture_(picture),
      frame_(frame),
      texelX_(std::ldexp(frame.frame.spacingX, frame.frame.finestLevel - level)),
      texelY_(std::ldexp(frame.frame.spacingY, frame.frame.finestLevel - level)) {}

PictureSampler::~PictureSampler() {
  if (transformer_ != nullptr) GDALDestroyGenImgProjTransformer(transformer_);
}

Result<std::unique_ptr<PictureSampler>> PictureSampler::open(const PlacedPicture& picture,
                                                             const ImageryFrame& frame, int level) {
  std::unique_ptr<PictureSampler> sampler(new PictureSampler(picture, frame, level));
  TERRANE_ASSIGN(sampler->reader_, PictureReader::open(picture.input));
  if (picture.aligned) return sampler;
  const GdalMessages messages;
  CPLStringList options;
  options.SetNameValue("SRC_SRS", crsWkt(picture.input.raster.crs).c_str());
  options.SetNameValue("DST_SRS", frame.crsWkt.c_str());
  sampler->transformer_ = GDALCreateGenImgProjTransformer2(
      GDALDataset::ToHandle(&sampler->reader_->dataset()), nullptr, options.List());
  if (sampler->transformer_ == nullptr) {
    return makeError("{}: cannot be brought into the dataset's CRS ({}); check --imagery-crs and --crs",
                     picture.input.raster.path, messages.reason("no transformation"));
  }
  return sampler;
}

double PictureSampler::eastingOf(int64_t texel2) const {
  return frame_.frame.originEasting + 0.5 * static_cast<double>(texel2) * texelX_;
}
double PictureSampler::northingOf(int64_t texel2) const {
  return frame_.frame.originNorthing - 0.5 * static_cast<double>(texel2) * texelY_;
}

Status PictureSampler::read(TileId id, ImageryTile& out) {
  std::fill(out.rgba.begin(), out.rgba.end(), uint8_t{0});
  if (picture_.aligned) return readAligned(id, out);
  const auto whole = readWarped(id, {0, 0, kSide}, out);
  if (!whole.ok()) return whole.error();
  if (*whole) return {};
  // At a seam of the transformation, block by block; those that still lie on both sides stay empty.
  constexpr int kBlock = 32;
  for (int y = 0; y < kSide; y += kBlock) {
    for (int x = 0; x < kSide; x += kBlock) {
      if (const auto done = readWarped(id, {x, y, kBlock}, out); !done.ok()) return done.error();
    }
  }
  return {};
}

Status PictureSampler::readWindow(const Window& window) {
  TERRANE_TRY(reader_->read(window.col, window.row, window.cols, window.rows, rgba_));
  pixels_.resize(rgba_.size());
  for (size_t i = 0; i < rgba_.size(); ++i) pixels_[i] = static_cast<float>(rgba_[i]);
  if (picture_.input.alpha.band == 0 && !picture_.input.mask && !picture_.input.channels.front().noData &&
      picture_.input.palette.empty() && picture_.input.bytes)
    return {};
  for (size_t i = 0; i < pixels_.size(); i += 4) {
    if (rgba_[i + 3] == 255) continue;
    for (size_t c = 0; c < 3; ++c) pixels_[i + c] *= pixels_[i + 3] * (1.0F / 255.0F);
  }
  return {};
}

PictureSampler::Taps PictureSampler::makeTaps(const std::vector<double>& centers, double scale, int origin) {
  Taps taps;
  taps.count = tapCount(scale);
  taps.weights.resize(centers.size() * static_cast<size_t>(taps.count));
  for (size_t i = 0; i < centers.size(); ++i) {
    const int first = firstTap(centers[i], taps.count);
    fillWeights(centers[i], scale, first, taps.count, &taps.weights[i * static_cast<size_t>(taps.count)]);
    taps.first.push_back(first - origin);
  }
  return taps;
}

/// Columns and rows apart: first every row of the window on the tile's columns, then every column.
Status PictureSampler::readAligned(TileId id, ImageryTile& out) {
  const InputRaster& raster = picture_.input.raster;
  const auto& g = raster.geoTransform;
  std::vector<double> xs, ys;
  for (int i = 0; i < kSide; ++i) {
    xs.push_back((eastingOf(2 * (int64_t{id.col} * kSide + i) + 1) - g[0]) / g[1]);
    ys.push_back((northingOf(2 * (int64_t{id.row} * kSide + i) + 1) - g[3]) / g[5]);
  }
  // The texels whose middles lie on the picture.
  const auto inside = [](const std::vector<double>& at, int size, int& first, int& end) {
    constexpr double kHair = 1e-6;
    first = 0;
    end = kSide;
    const auto isIn = [&](int i) {
      return at[static_cast<size_t>(i)] >= -kHair && at[static_cast<size_t>(i)] <= size + kHair;
    };
    while (first < end && !isIn(first)) ++first;
    while (end > first && !isIn(end - 1)) --end;
  };
  int firstX, endX, firstY, endY;
  inside(xs, raster.width, firstX, endX);
  inside(ys, raster.height, firstY, endY);
  if (firstX >= endX || firstY >= endY) return {};
  xs = {xs.begin() + firstX, xs.begin() + endX};
  ys = {ys.begin() + firstY, ys.begin() + endY};
  const double scaleX = kernelScale(texelX_ / std::abs(g[1]));
  const double scaleY = kernelScale(texelY_ / std::abs(g[5]));
  const auto cols = static_cast<size_t>(endX - firstX);
  const auto rows = static_cast<size_t>(endY - firstY);

  const auto span = [](const std::vector<double>& at, double scale, int size, int& first, int& end) {
    const int count = tapCount(scale);
    const auto [low, high] = std::minmax(at.front(), at.back());
    first = std::clamp(firstTap(low, count), 0, size - 1);
    end = std::clamp(firstTap(high, count) + count, first + 1, size);
  };
  int firstCol, endCol, firstRow, endRow;
  span(xs, scaleX, raster.width, firstCol, endCol);
  span(ys, scaleY, raster.height, firstRow, endRow);

  // Where texels are pixels, nothing is to be computed.
  constexpr double kAlike = 1e-3;
  const auto isPixel = [](const std::vector<double>& at) {
    return at.size() > 1 && std::abs(at.front() - std::floor(at.front()) - 0.5) < kAlike &&
           std::abs(at.back() - at.front() - static_cast<double>(at.size() - 1)) < kAlike;
  };
  if (isPixel(xs) && isPixel(ys)) {
    const Window window{static_cast<int>(std::floor(xs.front())), static_cast<int>(std::floor(ys.front())),
                        static_cast<int>(cols), static_cast<int>(rows)};
    if (window.col >= 0 && window.row >= 0 && window.col + window.cols <= raster.width &&
        window.row + window.rows <= raster.height) {
      TERRANE_TRY(reader_->read(window.col, window.row, window.cols, window.rows, rgba_));
      for (size_t y = 0; y < rows; ++y) {
        std::copy_n(rgba_.begin() + static_cast<ptrdiff_t>(4 * y * cols), 4 * cols,
                    out.rgba.begin() + static_cast<ptrdiff_t>(4 * ((static_cast<size_t>(firstY) + y) * kSide +
                                                                   static_cast<size_t>(firstX))));
      }
      return {};
    }
  }

  const Window window{firstCol, firstRow, endCol - firstCol, endRow - firstRow};
  TERRANE_TRY(readWindow(window));
  const Taps across = makeTaps(xs, scaleX, window.col);
  const Taps down = makeTaps(ys, scaleY, window.row);
  lines_.resize(static_cast<size_t>(window.rows) * cols * 4);
  for (int row = 0; row < window.rows; ++row) {
    const float* line = &pixels_[static_cast<size_t>(row) * static_cast<size_t>(window.cols) * 4];
    float* to = &lines_[static_cast<size_t>(row) * cols * 4];
    for (size_t x = 0; x < cols; ++x) {
      const float* weights = &across.weights[x * static_cast<size_t>(across.count)];
      const int first = across.first[x];
      Float4 sum = Float4::all(0.0F);
      if (first >= 0 && first + across.count <= window.cols) {
        for (int i = 0; i < across.count; ++i)
          sum = sum + Float4::all(weights[i]) * Float4::load(line + 4 * (first + i));
      } else {
        for (int i = 0; i < across.count; ++i)
          sum = sum +
                Float4::all(weights[i]) * Float4::load(line + 4 * std::clamp(first + i, 0, window.cols - 1));
      }
      sum.store(to + 4 * x);
    }
  }
  std::vector<float> sums(cols * 4);
  for (size_t y = 0; y < rows; ++y) {
    std::fill(sums.begin(), sums.end(), 0.0F);
    for (int i = 0; i < down.count; ++i) {
      const float weight = down.weights[y * static_cast<size_t>(down.count) + static_cast<size_t>(i)];
      const auto row = static_cast<size_t>(std::clamp(down.first[y] + i, 0, window.rows - 1));
      const float* line = &lines_[row * cols * 4];
      for (size_t x = 0; x < sums.size(); ++x) sums[x] += weight * line[x];
    }
    uint8_t* to = &out.rgba[4 * ((static_cast<size_t>(firstY) + y) * kSide + static_cast<size_t>(firstX))];
    for (size_t x = 0; x < cols; ++x) storeTexel(&sums[4 * x], to + 4 * x);
  }
  return {};
}

/// False: the block lies on both sides of a seam, and nothing was done.
Result<bool> PictureSampler::readWarped(TileId id, Block block, ImageryTile& out) {
  const InputRaster& raster = picture_.input.raster;
  const int cells = block.side / kGridStep;
  const auto points = static_cast<size_t>((cells + 1) * (cells + 1));
  std::vector<double> xs, ys, zs(points, 0.0);
  std::vector<int> good(points, 0);
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      xs.push_back(eastingOf(2 * (int64_t{id.col} * kSide + block.x0 + i * kGridStep)));
      ys.push_back(northingOf(2 * (int64_t{id.row} * kSide + block.y0 + j * kGridStep)));
    }
  }
  {
    const GdalMessages messages;
    GDALGenImgProjTransform(transformer_, TRUE, static_cast<int>(points), xs.data(), ys.data(), zs.data(),
                            good.data());
  }
  double west = raster.width, east = 0.0, north = raster.height, south = 0.0;
  for (size_t i = 0; i < points; ++i) {
    good[i] = good[i] != 0 && std::isfinite(xs[i]) && std::isfinite(ys[i]);
    if (good[i] == 0) continue;
    west = std::min(west, xs[i]);
    east = std::max(east, xs[i]);
    north = std::min(north, ys[i]);
    south = std::max(south, ys[i]);
  }
  if (east <= 0.0 || south <= 0.0 || west >= raster.width || north >= raster.height) return true;

  // How many pixels a texel is wide and high, over the block.
  double wide = 0.0, high = 0.0;
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const auto a = static_cast<size_t>(j * (cells + 1) + i);
      const size_t b = a + 1, c = a + static_cast<size_t>(cells) + 1;
      if (good[a] == 0 || good[b] == 0 || good[c] == 0) continue;
      wide = std::max(wide, std::max(std::abs(xs[b] - xs[a]), std::abs(xs[c] - xs[a])) / kGridStep);
      high = std::max(high, std::max(std::abs(ys[b] - ys[a]), std::abs(ys[c] - ys[a])) / kGridStep);
    }
  }
  const double scaleX = kernelScale(wide);
  const double scaleY = kernelScale(high);
  const int tapsX = tapCount(scaleX);
  const int tapsY = tapCount(scaleY);
  Window window{};
  window.col = std::clamp(firstTap(std::max(west, 0.0), tapsX), 0, raster.width - 1);
  window.row = std::clamp(firstTap(std::max(north, 0.0), tapsY), 0, raster.height - 1);
  window.cols = std::clamp(firstTap(std::min(east, double(raster.width)), tapsX) + tapsX, window.col + 1,
                           raster.width) -
                window.col;
  window.rows = std::clamp(firstTap(std::min(south, double(raster.height)), tapsY) + tapsY, window.row + 1,
                           raster.height) -
                window.row;
  if (int64_t{window.cols} * window.rows > kMostWindowPixels) return false;
  TERRANE_TRY(readWindow(window));

  std::vector<float> weightsX(static_cast<size_t>(tapsX));
  std::vector<float> weightsY(static_cast<size_t>(tapsY));
  for (int y = 0; y < block.side; ++y) {
    for (int x = 0; x < block.side; ++x) {
      const auto corner = static_cast<size_t>(y / kGridStep * (cells + 1) + x / kGridStep);
      const std::array<size_t, 4> at = {corner, corner + 1, corner + static_cast<size_t>(cells) + 1,
                                        corner + static_cast<size_t>(cells) + 2};
      if (good[at[0]] == 0 || good[at[1]] == 0 || good[at[2]] == 0 || good[at[3]] == 0) continue;
      const double u = (x % kGridStep + 0.5) / kGridStep;
      const double v = (y % kGridStep + 0.5) / kGridStep;
      const auto between = [&](const std::vector<double>& p) {
        return (1.0 - v) * ((1.0 - u) * p[at[0]] + u * p[at[1]]) + v * ((1.0 - u) * p[at[2]] + u * p[at[3]]);
      };
      const double col = between(xs);
      const double row = between(ys);
      if (!(col >= 0.0 && row >= 0.0 && col <= raster.width && row <= raster.height)) continue;
      const int firstX = firstTap(col, tapsX);
      const int firstY = firstTap(row, tapsY);
      fillWeights(col, scaleX, firstX, tapsX, weightsX.data());
      fillWeights(row, scaleY, firstY, tapsY, weightsY.data());
      Float4 sum = Float4::all(0.0F);
      for (int j = 0; j < tapsY; ++j) {
        const auto line = static_cast<size_t>(std::clamp(firstY + j - window.row, 0, window.rows - 1)) *
                          static_cast<size_t>(window.cols);
        Float4 across = Float4::all(0.0F);
        for (int i = 0; i < tapsX; ++i) {
          const auto pixel =
              line + static_cast<size_t>(std::clamp(firstX + i - window.col, 0, window.cols - 1));
          across = across + Float4::all(weightsX[static_cast<size_t>(i)]) * Float4::load(&pixels_[4 * pixel]);
        }
        sum = sum + Float4::all(weightsY[static_cast<size_t>(j)]) * across;
      }
      std::array<float, 4> texel;
      sum.store(texel.data());
      storeTexel(
          texel.data(),
          &out.rgba[4 * (static_cast<size_t>(block.y0 + y) * kSide + static_cast<size_t>(block.x0 + x))]);
    }
  }
  return true;
}

}  // namespace terrane
