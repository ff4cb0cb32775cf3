#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "terrane/bake/source.h"

namespace terrane::cli {

/// What --help says of the inputs of a build.
inline constexpr const char* kInputArgument = "Rasters that GDAL opens, folders, globs, or @list files";

/// Adds --crs, --source-crs, --nodata, --lossless, --max-error, --spacing and --resampling.
void addSourceOptions(CLI::App& command, SourceOptions& source);

/// Those that were given, as on the command line; inputs stand in the manifest by name.
std::string describeSource(const SourceOptions& source);

}  // namespace terrane::cli
