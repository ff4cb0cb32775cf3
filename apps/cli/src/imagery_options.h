#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terrane/bake/imagery.h"
#include "terrane/base/result.h"

namespace terrane::cli {

/// What the command line says of imagery, as it was written.
struct ImageryArguments {
  std::vector<std::string> imagery;  ///< [NAME=]FILE...: a name begins a layer, what follows belongs to it
  std::vector<std::string> bands, stretch, noData, crs, attribution;  ///< [NAME=]VALUE
  std::string format = "webp";
  std::optional<int> quality;  ///< nothing: the format's default
};

/// Adds --imagery and what belongs to it.
void addImageryOptions(CLI::App& command, ImageryArguments& arguments);

/// The layers that were asked for. Errors: a layer that is not there, values that are none.
Result<ImageryOptions> parseImagery(const ImageryArguments& arguments);

/// The options that shape the result, as on the command line, without the files.
std::string describeImagery(const ImageryArguments& arguments);

}  // namespace terrane::cli
