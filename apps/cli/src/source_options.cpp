#include "source_options.h"

#include <fmt/format.h>

namespace terrane::cli {

void addSourceOptions(CLI::App& command, SourceOptions& source) {
  command.add_option("--crs", source.crs,
                     "CRS of the dataset, projected (default: the inputs', or a UTM zone)");
  command.add_option("--source-crs", source.sourceCrs, "CRS of inputs without one or with a wrong one");
  command.add_option("--nodata", source.noData,
                     "The value that stands for no data (default: what the files say)");
  CLI::Option* lossless = command.add_flag("--lossless", source.lossless,
                                           "Keep every height exactly (the default for integer inputs)");
  command
      .add_option("--max-error", source.maxErrorMeters,
                  "Largest error of a height in metres (default for others: spacing / 200, at least 0.002, "
                  "at most 5)")
      ->check(CLI::PositiveNumber)
      ->excludes(lossless);
  command
      .add_option("--spacing", source.spacing,
                  "Distance of the finest samples, in units of the dataset's CRS (default: the finest "
                  "input's)")
      ->check(CLI::PositiveNumber);
  const auto names = resamplingNames();
  command
      .add_option("--resampling", source.resampling, "How samples are made where an input has to be warped")
      ->check(CLI::IsMember(std::vector<std::string>(names.begin(), names.end())))
      ->capture_default_str();
}

std::string describeSource(const SourceOptions& source) {
  std::string text;
  const auto add = [&](const std::string& option) { text += (text.empty() ? "" : " ") + option; };
  if (!source.crs.empty()) add(fmt::format("--crs '{}'", source.crs));
  if (!source.sourceCrs.empty()) add(fmt::format("--source-crs '{}'", source.sourceCrs));
  if (source.noData) add(fmt::format("--nodata {}", *source.noData));
  if (source.lossless) add("--lossless");
  if (source.maxErrorMeters) add(fmt::format("--max-error {}", *source.maxErrorMeters));
  if (source.spacing) add(fmt::format("--spacing {}", *source.spacing));
  if (source.resampling != SourceOptions{}.resampling) add("--resampling " + source.resampling);
  return text;
}

}  // namespace terrane::cli
