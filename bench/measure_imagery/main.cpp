#include <gdal_priv.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "block_texture.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/measure/bench_result.h"

/// What imagery takes, as it is by default and as JPEG: bytes a texel and PSNR beside GDAL's JPEG COG, raw
/// texels and BC1, and the CPU time
/// that bench/imagery.py took. The picture's pixels must be the texels of the layer's finest level.
///
/// usage: measure_imagery RESULT.json {NAME DATASET JPEG-DATASET PICTURE COG CPU-SECONDS JPEG-CPU-SECONDS
/// COG-CPU-SECONDS RESAMPLED-CPU-SECONDS}...

namespace terrane {
namespace {

constexpr double kBar = 1.3;
/// Bytes of all levels over those of the finest one.
constexpr double kPyramid = 4.0 / 3.0;

struct Pixels {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgba;
};

Result<Pixels> readPicture(const std::string& path) {
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!file || file->GetRasterCount() < 3)
    return makeError("{}: cannot be read as a picture of three bands", path);
  Pixels out{file->GetRasterXSize(), file->GetRasterYSize(), {}};
  out.rgba.assign(static_cast<size_t>(4) * static_cast<size_t>(out.width) * static_cast<size_t>(out.height),
                  255);
  if (file->RasterIO(GF_Read, 0, 0, out.width, out.height, out.rgba.data(), out.width, out.height, GDT_Byte,
                     3, nullptr, 4, GSpacing{4} * out.width, 1, nullptr) != CE_None)
    return makeError("{}: cannot be read", path);
  return out;
}

/// The finest level of a dataset's first layer, from the world's corner.
Result<Pixels> readLayer(const Dataset& dataset, int width, int height) {
  Pixels out{width, height, {}};
  out.rgba.resize(static_cast<size_t>(4) * static_cast<size_t>(width) * static_cast<size_t>(height));
  const int finest = dataset.manifest().imagery.front().finestLevel;
  for (const TileId id : dataset.imageryTiles(0)) {
    if (id.level != finest) continue;
    TERRANE_ASSIGN(const auto bytes, dataset.readImagery(0, id));
    if (!bytes) return makeError("{}: no imagery tile {}", dataset.directory(), toString(id));
    TERRANE_ASSIGN(const ImageryTile tile, decodeImagery(*bytes));
    for (int y = 0; y < kImageryTileSide && id.row * kImageryTileSide + y < height; ++y) {
      const int count = std::min(kImageryTileSide, width - id.col * kImageryTileSide);
      if (count <= 0) break;
      const auto to = static_cast<size_t>(4) *
                      (static_cast<size_t>(id.row * kImageryTileSide + y) * static_cast<size_t>(width) +
                       static_cast<size_t>(id.col * kImageryTileSide));
      std::copy_n(tile.rgba.begin() + static_cast<ptrdiff_t>(4) * y * kImageryTileSide, 4 * count,
                  out.rgba.begin() + static_cast<ptrdiff_t>(to));
    }
  }
  return out;
}

double psnr(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); i += 4) {
    for (size_t c = 0; c < 3; ++c) {
      const double difference = static_cast<double>(a[i + c]) - b[i + c];
      sum += difference * difference;
    }
  }
  const double mean = sum / (static_cast<double>(a.size()) * 0.75);
  return 10.0 * std::log10(255.0 * 255.0 / std::max(mean, 1e-9));
}

double twoDigits(double value) {
  return std::round(value * 1000.0) / 1000.0;
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 10 || arguments.size() % 9 != 1)
    return makeError(
        "usage: measure_imagery RESULT.json [NAME DATASET JPEG-DATASET PICTURE COG CPU JPEG-CPU COG-CPU "
        "RESAMPLED-CPU]...");
  BenchResult result;
  result.bench = "imagery";
  double ours = 0.0, cogs = 0.0;
  for (size_t i = 1; i < arguments.size(); i += 9) {
    const std::string& name = arguments[i];
    TERRANE_ASSIGN(const Dataset dataset, Dataset::open(arguments[i + 1]));
    TERRANE_ASSIGN(const Dataset asJpeg, Dataset::open(arguments[i + 2]));
    TERRANE_ASSIGN(const Pixels source, readPicture(arguments[i + 3]));
    TERRANE_ASSIGN(const Pixels cog, readPicture(arguments[i + 4]));
    TERRANE_ASSIGN(const Pixels layer, readLayer(dataset, source.width, source.height));
    TERRANE_ASSIGN(const Pixels jpegLayer, readLayer(asJpeg, source.width, source.height));
    const double texels = static_cast<double>(source.width) * source.height;
    const double cpu = std::stod(arguments[i + 5]);
    const double jpegCpu = std::stod(arguments[i + 6]);
    const double cogCpu = std::stod(arguments[i + 7]);
    const double resampled = std::stod(arguments[i + 8]);
    ours += cpu;
    cogs += cogCpu;
    const auto add = [&](const char* what, double bytes, double quality, double seconds) {
      result.rows.push_back({{"picture", name},
                             {"code", what},
                             {"bytes_per_texel", twoDigits(bytes / texels)},
                             {"psnr_db", twoDigits(quality)},
                             {"cpu_ns_per_texel", twoDigits(seconds / texels * 1e9)}});
    };
    const auto sizeOf = [](const std::string& path) {
      std::error_code ignored;
      return static_cast<double>(std::filesystem::file_size(path, ignored));
    };
    const auto layerBytes = [](const Manifest& manifest) {
      double bytes = 0.0;
      for (const ArchiveRecord& archive : manifest.archives)
        if (archive.name == manifest.imagery.at(0).archive) bytes = static_cast<double>(archive.bytes);
      return bytes;
    };
    add("terrane", layerBytes(dataset.manifest()), psnr(source.rgba, layer.rgba), cpu);
    add("terrane, JPEG", layerBytes(asJpeg.manifest()), psnr(source.rgba, jpegLayer.rgba), jpegCpu);
    add("terrane, half a pixel off", 0.0, 0.0, resampled);
    add("GDAL COG, JPEG", sizeOf(arguments[i + 4]), psnr(source.rgba, cog.rgba), cogCpu);
    add("raw", 3.0 * kPyramid * texels, 99.0, 0.0);
    add("BC1", 0.5 * kPyramid * texels,
        psnr(source.rgba, throughBc1(source.rgba, source.width, source.height)), 0.0);
  }
  result.bars.push_back({"imagery_cpu_vs_cog", ours / cogs, "", kBar});
  return finishBench(result, arguments[0]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_imagery", argc, argv, terrane::run);
}
