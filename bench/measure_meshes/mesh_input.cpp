#include "mesh_input.h"

#include <cstdlib>

namespace terrane {

Result<std::vector<MeshInput>> meshInputsFrom(std::span<const std::string> arguments) {
  constexpr size_t kArguments = 2 + 2 * kMeshSettings.size();
  if (arguments.empty() || arguments.size() % kArguments != 0)
    return makeError("inputs are {{NAME RASTER {{DATASET SECONDS}} {{DATASET SECONDS}}}}...");
  std::vector<MeshInput> inputs;
  for (; !arguments.empty(); arguments = arguments.subspan(kArguments)) {
    MeshInput input;
    input.name = arguments[0];
    input.raster = arguments[1];
    for (size_t i = 0; i < kMeshSettings.size(); ++i) {
      input.datasets[i] = arguments[2 + 2 * i];
      input.buildSeconds[i] = std::atof(arguments[3 + 2 * i].c_str());
    }
    inputs.push_back(input);
  }
  return inputs;
}

double boundMetersOf(const Manifest& manifest, const MeshSetting& setting) {
  return manifest.frame.spacingXMeters() / setting.shares;
}

Result<StoredPyramid> openBounded(const std::string& dataset, const MeshSetting& setting) {
  TERRANE_ASSIGN(StoredPyramid pyramid, StoredPyramid::open(dataset));
  const double stated = pyramid.manifest().maxErrorMeters;
  const double bound = boundMetersOf(pyramid.manifest(), setting);
  if (stated > bound * (1.0 + 1e-9))
    return makeError("{}: states a bound of {} m, not {} m", dataset, stated, bound);
  return pyramid;
}

}  // namespace terrane
