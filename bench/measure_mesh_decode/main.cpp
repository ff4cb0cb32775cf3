#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "measure_drawing.h"
#include "measure_expanding.h"
#include "terrane/measure/bench_result.h"

/// Expanding compact meshes on the CPU and on the GPU beside uploading them expanded, and ways to draw them.
///
/// usage: measure_mesh_decode RESULT.json DATASET...

namespace terrane {
namespace {

constexpr int64_t kMostTriangles = 5'000'000;
constexpr int64_t kDrawnTriangles = 300'000;

/// What the compact form may take of the decoded one's bytes, 32-bit indices.
constexpr double kBytesBar = 0.5;
constexpr double kCpuBar = 30.0;

Result<nlohmann::ordered_json> measureDataset(const gpu::Context& context, const std::string& directory) {
  TERRANE_ASSIGN(const MadeMeshes meshes, makeMeshes(directory, kMostTriangles));
  size_t compactBytes = 0;
  for (const MadeLevel& level : meshes.levels) compactBytes += level.compact.sizeBytes();
  const auto triangles = static_cast<double>(meshes.triangles);
  const double vertexBytes = static_cast<double>(meshes.vertices) * sizeof(PatchVertex);
  const double decodedBytes = vertexBytes + triangles * 3 * sizeof(uint32_t);
  const double decoded16Bytes = vertexBytes + triangles * 3 * sizeof(uint16_t);
  nlohmann::ordered_json row = {
      {"dataset", std::filesystem::path(directory).stem().string()},
      {"triangles", meshes.triangles},
      {"compact_bits", 8.0 * static_cast<double>(compactBytes) / triangles},
      {"decoded_bits", 8.0 * decodedBytes / triangles},
      {"decoded16_bits", 8.0 * decoded16Bytes / triangles},
  };

  TERRANE_ASSIGN(const ExpandingTimes times, measureExpanding(context, meshes));
  const auto rate = [&](const char* name, double seconds) {
    row[std::string(name) + "_mtris"] = triangles / seconds * 1e-6;
    row[std::string(name) + "_gbps"] = decodedBytes / seconds * 1e-9;
  };
  rate("cpu", times.cpu);
  rate("gpu", times.gpu);
  rate("upload", times.upload);
  row["upload16_mtris"] = triangles / times.upload16 * 1e-6;
  row["gpu_vs_upload"] = times.upload / times.gpu;
  row["gpu_vs_cpu"] = times.cpu / times.gpu;

  for (const int width : {640, 1280}) {
    TERRANE_ASSIGN(const DrawingTimes drawn,
                   measureDrawing(context, meshes, kDrawnTriangles, width, width * 9 / 16));
    row["drawn"] = drawn.triangles;
    row[fmt::format("attributes_{}_ms", width)] = drawn.attributes;
    row[fmt::format("packed_{}_ms", width)] = drawn.packed;
  }
  return row;
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 2) return makeError("usage: measure_mesh_decode RESULT.json DATASET...");
  TERRANE_ASSIGN(const std::unique_ptr<gpu::Context> context, gpu::Context::createHeadless());
  std::printf("%s\n\n", context->rendererName().c_str());

  BenchResult result;
  result.bench = "mesh_decode";
  double slowest = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (size_t i = 1; i < arguments.size(); ++i) {
    std::fprintf(stderr, "%s\n", arguments[i].c_str());
    TERRANE_ASSIGN(const nlohmann::ordered_json row, measureDataset(*context, arguments[i]));
    slowest = std::min(slowest, row["cpu_mtris"].get<double>());
    largest = std::max(largest, row["compact_bits"].get<double>() / row["decoded_bits"].get<double>());
    result.rows.push_back(row);
  }
  result.bars.push_back({"expand_mtris_per_core", slowest, "", kCpuBar, Bar::Side::AtLeast});
  result.bars.push_back({"compact_vs_decoded", largest, "", kBytesBar});
  return finishBench(result, arguments[0], {{"renderer", context->rendererName()}});
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_mesh_decode", argc, argv, terrane::run);
}
