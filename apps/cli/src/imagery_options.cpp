#include "imagery_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>

#include "terrane/dataset/manifest.h"

namespace terrane::cli {

namespace {

/// "NAME=REST", where a file of that very name does not exist.
struct Named {
  std::string name;  ///< empty: none was given
  std::string rest;
};
Named splitName(const std::string& text) {
  const size_t equals = text.find('=');
  std::error_code code;
  if (equals == std::string::npos || !isImageryName(text.substr(0, equals)) ||
      std::filesystem::exists(text, code))
    return {{}, text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// "a.tif,b.tif", where a file of that very name does not exist.
std::vector<std::string> splitFiles(const std::string& text) {
  std::error_code code;
  if (std::filesystem::exists(text, code)) return {text};
  std::vector<std::string> out;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) out.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return out;
}

Result<std::vector<double>> parseNumbers(const std::string& text, const char* option, const char* expected) {
  std::vector<double> out;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    char* tail = nullptr;
    out.push_back(std::strtod(part.c_str(), &tail));
    if (part.empty() || *tail != '\0') return makeError("{} {}: expected {}", option, text, expected);
    begin = end + 1;
  }
  return out;
}

/// Gives every "[NAME=]VALUE" to its layer, or to all of them.
Status forLayers(ImageryOptions& options, const std::vector<std::string>& values, const char* option,
                 const std::function<Status(ImageryLayerOptions&, const std::string&)>& take) {
  if (!values.empty() && options.layers.empty()) return makeError("{}: there is no --imagery", option);
  for (const std::string& text : values) {
    const Named named = splitName(text);
    bool taken = false;
    for (ImageryLayerOptions& layer : options.layers) {
      if (!named.name.empty() && named.name != layer.name) continue;
      TERRANE_TRY(take(layer, named.rest));
      taken = true;
    }
    if (!taken) return makeError("{} {}: there is no imagery layer '{}'", option, text, named.name);
  }
  return {};
}

ImageryFormat formatOf(const ImageryArguments& arguments) {
  return arguments.format == "jpeg" ? ImageryFormat::Jpeg : ImageryFormat::Webp;
}

int qualityOf(const ImageryArguments& arguments) {
  return arguments.quality.value_or(defaultImageryQuality(formatOf(arguments)));
}

}  // namespace

void addImageryOptions(CLI::App& command, ImageryArguments& arguments) {
  const auto add = [&](const char* name, std::vector<std::string>& to, const char* what) {
    command.add_option(name, to, what)->allow_extra_args(false)->type_name("[NAME=]VALUE");
  };
  command
      .add_option(
          "--imagery", arguments.imagery,
          "Pictures over the terrain, later ones on top; NAME= begins a layer of its own, A+B+C makes one\n"
          "picture of the bands of three files. (The inputs stand in front of this option.)")
      ->type_name("[NAME=]FILE...");
  add("--bands", arguments.bands,
      "Red, green and blue, counted from 1: 4,3,2; one band is grey, a fourth alpha");
  add("--stretch", arguments.stretch,
      "MIN,MAX: the values that become black and white (default for others than 8 bits: 2nd and 98th "
      "percentile)");
  add("--imagery-nodata", arguments.noData,
      "The value that stands for no picture (default: what the files say)");
  add("--imagery-crs", arguments.crs, "CRS of pictures without one or with a wrong one");
  add("--imagery-attribution", arguments.attribution, "Whose pictures they are");
  command
      .add_option("--imagery-format", arguments.format,
                  "webp, or jpeg (progressive: larger, quicker to make)")
      ->capture_default_str()
      ->check(CLI::IsMember({"jpeg", "webp"}));
  command
      .add_option(
          "--imagery-quality", arguments.quality,
          fmt::format("of the encoder (default: webp {}, jpeg {})",
                      defaultImageryQuality(ImageryFormat::Webp), defaultImageryQuality(ImageryFormat::Jpeg)))
      ->check(CLI::Range(1, 100));
}

Result<ImageryOptions> parseImagery(const ImageryArguments& arguments) {
  ImageryOptions options;
  options.format = formatOf(arguments);
  options.quality = qualityOf(arguments);
  for (const std::string& text : arguments.imagery) {
    const Named named = splitName(text);
    if (!named.name.empty() || options.layers.empty()) {
      const std::string name = named.name.empty() ? ImageryLayerOptions().name : named.name;
      const auto known = std::find_if(options.layers.begin(), options.layers.end(),
                                      [&](const ImageryLayerOptions& layer) { return layer.name == name; });
      if (known != options.layers.end() && &*known != &options.layers.back())
        return makeError("--imagery {}: another layer has come in between; name its files one after another",
                         text);
      if (known == options.layers.end()) options.layers.emplace_back().name = name;
    }
    for (const std::string& file : splitFiles(named.rest)) options.layers.back().inputs.push_back(file);
  }
  TERRANE_TRY(forLayers(
      options, arguments.bands, "--bands", [](ImageryLayerOptions& layer, const std::string& text) -> Status {
        TERRANE_ASSIGN(const std::vector<double> bands,
                       parseNumbers(text, "--bands", "numbers of bands, as 4,3,2"));
        for (const double band : bands) {
          if (band < 1.0 || band > 65535.0 || band != std::floor(band) || bands.size() == 2 ||
              bands.size() > 4)
            return makeError(
                "--bands {}: expected one band (grey), three (red,green,blue) or four (and alpha), "
                "counted from 1",
                text);
          layer.bands.push_back(static_cast<int>(band));
        }
        return {};
      }));
  TERRANE_TRY(forLayers(
      options, arguments.stretch, "--stretch",
      [](ImageryLayerOptions& layer, const std::string& text) -> Status {
        TERRANE_ASSIGN(const std::vector<double> ends,
                       parseNumbers(text, "--stretch", "two numbers, MIN,MAX"));
        if (ends.size() != 2 || !(ends[0] < ends[1]) || !std::isfinite(ends[1] - ends[0]))
          return makeError("--stretch {}: expected two numbers, MIN,MAX, the first the smaller one", text);
        layer.stretch = std::array<double, 2>{ends[0], ends[1]};
        return {};
      }));
  TERRANE_TRY(forLayers(options, arguments.noData, "--imagery-nodata",
                        [](ImageryLayerOptions& layer, const std::string& text) -> Status {
                          TERRANE_ASSIGN(const std::vector<double> value,
                                         parseNumbers(text, "--imagery-nodata", "a number"));
                          if (value.size() != 1)
                            return makeError("--imagery-nodata {}: expected one number", text);
                          layer.noData = value[0];
                          return {};
                        }));
  TERRANE_TRY(forLayers(options, arguments.crs, "--imagery-crs",
                        [](ImageryLayerOptions& layer, const std::string& text) -> Status {
                          layer.sourceCrs = text;
                          return {};
                        }));
  TERRANE_TRY(forLayers(options, arguments.attribution, "--imagery-attribution",
                        [](ImageryLayerOptions& layer, const std::string& text) -> Status {
                          layer.attribution = text;
                          return {};
                        }));
  return options;
}

std::string describeImagery(const ImageryArguments& arguments) {
  std::string out;
  if (arguments.imagery.empty()) return out;
  const auto add = [&](const char* option, const std::vector<std::string>& values) {
    for (const std::string& value : values) out += fmt::format(" {} '{}'", option, value);
  };
  out = fmt::format("--imagery-format {} --imagery-quality {}", arguments.format, qualityOf(arguments));
  add("--bands", arguments.bands);
  add("--stretch", arguments.stretch);
  add("--imagery-nodata", arguments.noData);
  add("--imagery-crs", arguments.crs);
  return out;
}

}  // namespace terrane::cli
