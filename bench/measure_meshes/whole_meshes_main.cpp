#include <algorithm>
#include <cstdio>

#include "mesh_input.h"
#include "paper_form.h"
#include "terrane/measure/bench_result.h"

/// What whole datasets take, all levels, against raw samples of 16 bits: ours, and in the form of Dick,
/// Schneider and Westermann (2009); and how fast they are made.
///
/// usage: measure_whole_meshes RESULT.json {NAME RASTER {DATASET SECONDS} {DATASET SECONDS}}...
///
/// Each raster comes with two datasets made of it with a --max-error of a half and of a quarter of its sample
/// spacing, and the CPU seconds that building each took.

namespace terrane {
namespace {

/// What the paper reports (section 8.1), for Utah at 5 m and for the USA at 10 m.
struct Reported {
  double utah;
  double usa;
};
constexpr std::array<Reported, kMeshSettings.size()> kReported = {{{13.0, 85.0}, {5.0, 32.0}}};
/// 11 G samples in 30 minutes on one core.
constexpr double kReportedMillionsASecond = 6.0;

double samplesOf(const Manifest& manifest) {
  double samples = 0.0;
  for (const InputRecord& input : manifest.inputs) samples += static_cast<double>(input.width) * input.height;
  return samples;
}

Result<nlohmann::ordered_json> measureSetting(const MeshInput& input, size_t setting) {
  const std::string& dataset = input.datasets[setting];
  TERRANE_ASSIGN(const StoredPyramid pyramid, openBounded(dataset, kMeshSettings[setting]));
  const Manifest& manifest = pyramid.manifest();
  HeightGrid grid;
  {
    TERRANE_ASSIGN(const std::vector<SourceTile> source, readSourceTiles(input.raster, manifest));
    grid = gridOf(source, manifest);
  }
  TERRANE_ASSIGN(const PaperForm paper, encodePaperForm(std::move(grid), manifest.frame.spacingXMeters(),
                                                        kMeshSettings[setting].shares));
  double paperBytes = 0.0;
  double paperSeconds = 0.0;
  for (const PaperLevel& level : paper.levels) {
    paperBytes += static_cast<double>(level.bits) / 8.0;
    paperSeconds += level.seconds;
  }

  const double samples = samplesOf(manifest);
  const double raw = 2.0 * samples;
  const auto ours = static_cast<double>(pyramid.bytes());
  return nlohmann::ordered_json{{"file", input.name},
                                {"bound", kMeshSettings[setting].name},
                                {"samples", static_cast<int64_t>(samples)},
                                {"raw_mb", raw / 1e6},
                                {"ours_mb", ours / 1e6},
                                {"paper_form_mb", paperBytes / 1e6},
                                {"ours_to_1", raw / ours},
                                {"paper_form_to_1", raw / paperBytes},
                                {"vs_paper_form", ours / paperBytes},
                                {"paper_utah_to_1", kReported[setting].utah},
                                {"paper_usa_to_1", kReported[setting].usa},
                                {"build_msps", samples / input.buildSeconds[setting] / 1e6},
                                {"paper_form_msps", samples / paperSeconds / 1e6},
                                {"paper_msps", kReportedMillionsASecond}};
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.empty()) return makeError("usage: measure_whole_meshes RESULT.json INPUT...");
  TERRANE_ASSIGN(const std::vector<MeshInput> inputs, meshInputsFrom(std::span(arguments).subspan(1)));
  BenchResult result;
  result.bench = "meshes_whole";
  double worst = 0.0;
  for (const MeshInput& input : inputs) {
    for (size_t setting = 0; setting < kMeshSettings.size(); ++setting) {
      TERRANE_ASSIGN(const auto row, measureSetting(input, setting));
      std::fprintf(stderr, "%s, %s\n", input.name.c_str(), kMeshSettings[setting].name);
      worst = std::max(worst, row["vs_paper_form"].get<double>());
      result.rows.push_back(row);
    }
  }
  result.bars = {{"vs_paper_form", worst, "", 0.25}};
  return finishBench(result, arguments[0]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_whole_meshes", argc, argv, terrane::run);
}
