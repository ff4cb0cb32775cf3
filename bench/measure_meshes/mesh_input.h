#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "stored_pyramid.h"

namespace terrane {

/// The bounds at which meshes are measured.
struct MeshSetting {
  const char* name;
  int shares;  ///< the bound is the sample spacing divided by this
};
inline constexpr std::array<MeshSetting, 2> kMeshSettings = {{{"half", 2}, {"quarter", 4}}};

/// A raster, and the datasets that were made of it with a --max-error of each of the bounds.
struct MeshInput {
  std::string name;
  std::string raster;
  std::array<std::string, kMeshSettings.size()> datasets;
  std::array<double, kMeshSettings.size()> buildSeconds{};  ///< CPU time
};

/// Reads {NAME RASTER {DATASET SECONDS}...}... Error: no input, or half of one.
Result<std::vector<MeshInput>> meshInputsFrom(std::span<const std::string> arguments);

/// What a dataset should state: the finest level's sample spacing divided by the setting's shares.
double boundMetersOf(const Manifest& manifest, const MeshSetting& setting);

/// Opens a dataset that must state this setting's bound, or less.
Result<StoredPyramid> openBounded(const std::string& dataset, const MeshSetting& setting);

}  // namespace terrane
