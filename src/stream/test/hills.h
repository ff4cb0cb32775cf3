#pragma once

#include <cmath>
#include <string>

#include "function_source.h"
#include "terrane/bake/build.h"

namespace terrane {

/// Builds the dataset of the stream tests: without layers of significance, which those that need them make
/// of it (layered_dataset.h).
inline Status buildHills(const std::string& output) {
  BuildOptions options;
  options.output = output;
  const auto hills = [](int64_t x, int64_t y) {
    const double u = static_cast<double>(x), v = static_cast<double>(y);
    return static_cast<float>(300.0 * std::sin(u / 61.0) * std::cos(v / 83.0) +
                              20.0 * std::sin(u / 5.0 + v / 7.0));
  };
  const FunctionSource source({{.level = 3, .x0 = 0, .y0 = 0, .x1 = 1600, .y1 = 1400, .height = hills}}, 0.1,
                              0.05);
  SilentProgress silent;
  const auto built = buildDataset(source, options, silent);
  if (!built.ok()) return built.error();
  return {};
}

}  // namespace terrane
