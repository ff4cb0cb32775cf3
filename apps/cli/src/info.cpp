#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "commands.h"
#include "common.h"
#include "terrane/base/format_number.h"
#include "terrane/dataset/dataset.h"

namespace terrane::cli {

namespace {

constexpr const char* kInfoExamples =
    "Examples:\n"
    "  terrane info alps.terrane\n"
    "  terrane info http://127.0.0.1:8080/d/alps\n"
    "  terrane info alps.terrane --json | jq .max_error_meters\n"
    "\n"
    "With --json one object: name, format_version, crs, crs_wkt, vertical_datum, attribution,\n"
    "spacing_x, spacing_y (CRS units), meters_per_unit, origin [easting, northing],\n"
    "extent {west, south, east, north} (CRS units), samples [columns, rows], finest_level,\n"
    "tiles, tiles_by_level, covered_cells, covered_km2, min_height_meters, max_height_meters,\n"
    "height_step_meters, max_error_meters, lossless, layers [{archive, max_error_meters, bytes}],\n"
    "files [{name, bytes, sha256}], bytes, bits_per_cell,\n"
    "inputs [{name, bytes, sha256, width, height, data_type, crs, warped, resampling, native_level, "
    "no_data}],\n"
    "imagery [{name, archive, format, quality, finest_level, tiles, bytes, bounds, spacing_meters, "
    "attribution, bands, "
    "stretch, inputs}],\n"
    "built_by, build_options.";

struct InfoArguments {
  std::string dataset;
  bool json = false;
};

/// What the manifest does not say straight away.
struct Facts {
  double west = 0.0;
  double south = 0.0;
  double east = 0.0;
  double north = 0.0;
  double coveredSquareMeters = 0.0;
  uint64_t bytes = 0;
  double bitsPerCell = 0.0;
  std::vector<uint64_t> tilesByLevel;
};

Facts factsOf(const Dataset& dataset) {
  const Manifest& m = dataset.manifest();
  Facts facts;
  facts.west = m.frame.originEasting;
  facts.north = m.frame.originNorthing;
  facts.east = facts.west + static_cast<double>(m.extentCols - 1) * m.frame.spacingX;
  facts.south = facts.north - static_cast<double>(m.extentRows - 1) * m.frame.spacingY;
  facts.coveredSquareMeters = m.coveredCells * m.frame.spacingXMeters() * m.frame.spacingYMeters();
  for (const ArchiveRecord& archive : m.archives) facts.bytes += archive.bytes;
  if (m.coveredCells > 0.0) facts.bitsPerCell = 8.0 * static_cast<double>(elevationBytes(m)) / m.coveredCells;
  facts.tilesByLevel.resize(static_cast<size_t>(m.frame.finestLevel) + 1);
  for (const TileId id : dataset.elevationTiles()) {
    if (id.level <= m.frame.finestLevel) ++facts.tilesByLevel[static_cast<size_t>(id.level)];
  }
  return facts;
}

nlohmann::json toJson(const std::vector<InputRecord>& records) {
  nlohmann::json inputs = nlohmann::json::array();
  for (const InputRecord& input : records) {
    inputs.push_back({{"name", input.name},
                      {"bytes", input.bytes},
                      {"sha256", input.sha256},
                      {"width", input.width},
                      {"height", input.height},
                      {"data_type", input.dataType},
                      {"crs", input.sourceCrs},
                      {"warped", input.warped},
                      {"resampling", input.resampling},
                      {"native_level", input.nativeLevel},
                      {"no_data", input.noData}});
  }
  return inputs;
}

const ArchiveRecord& archiveOf(const Manifest& m, const std::string& name) {
  return *std::find_if(m.archives.begin(), m.archives.end(),
                       [&](const ArchiveRecord& a) { return a.name == name; });
}

/// How far heights may be off the inputs' with the layers up to this one.
double layerError(const Manifest& m, int layer) {
  return layer + 1 < m.scale.layerCount ? m.scale.layerErrors[static_cast<size_t>(layer)] : m.maxErrorMeters;
}

/// Metres from texel to texel of the finest level.
double texelMeters(const Manifest& m, const ImageryLayerRecord& layer) {
  return std::ldexp(m.frame.spacingXMeters(), m.frame.finestLevel - layer.finestLevel);
}

nlohmann::json toJson(const Manifest& m, const ImageryLayerRecord& layer) {
  return {{"name", layer.name},
          {"archive", layer.archive},
          {"format", layer.format == ImageryFormat::Webp ? "webp" : "jpeg"},
          {"quality", layer.quality},
          {"finest_level", layer.finestLevel},
          {"tiles", layer.tileCount},
          {"bytes", archiveOf(m, layer.archive).bytes},
          {"bounds",
           {{"west", layer.bounds[0]},
            {"south", layer.bounds[1]},
            {"east", layer.bounds[2]},
            {"north", layer.bounds[3]}}},
          {"spacing_meters", texelMeters(m, layer)},
          {"attribution", layer.attribution},
          {"bands", layer.bands},
          {"stretch", layer.stretch},
          {"inputs", toJson(layer.inputs)}};
}

nlohmann::json toJson(const Manifest& m, const Facts& facts) {
  nlohmann::json files = nlohmann::json::array();
  for (const ArchiveRecord& a : m.archives)
    files.push_back({{"name", a.name}, {"bytes", a.bytes}, {"sha256", a.sha256}});
  nlohmann::json layers = nlohmann::json::array();
  for (int layer = 0; layer < m.scale.layerCount; ++layer) {
    const std::string name = elevationArchiveName(layer);
    layers.push_back(
        {{"archive", name}, {"max_error_meters", layerError(m, layer)}, {"bytes", archiveOf(m, name).bytes}});
  }
  nlohmann::json imagery = nlohmann::json::array();
  for (const ImageryLayerRecord& layer : m.imagery) imagery.push_back(toJson(m, layer));
  return {{"name", m.name},
          {"format_version", m.formatVersion},
          {"crs", m.crsName},
          {"crs_wkt", m.crsWkt},
          {"vertical_datum", m.verticalDatum},
          {"attribution", m.attribution},
          {"spacing_x", m.frame.spacingX},
          {"spacing_y", m.frame.spacingY},
          {"meters_per_unit", m.frame.metersPerUnit},
          {"origin", {m.frame.originEasting, m.frame.originNorthing}},
          {"extent",
           {{"west", facts.west}, {"south", facts.south}, {"east", facts.east}, {"north", facts.north}}},
          {"samples", {m.extentCols, m.extentRows}},
          {"finest_level", m.frame.finestLevel},
          {"tiles", m.tileCount},
          {"tiles_by_level", facts.tilesByLevel},
          {"covered_cells", m.coveredCells},
          {"covered_km2", facts.coveredSquareMeters / 1e6},
          {"min_height_meters", m.minHeight},
          {"max_height_meters", m.maxHeight},
          {"height_step_meters", m.scale.heightStep},
          {"max_error_meters", m.maxErrorMeters},
          {"lossless", m.maxErrorMeters == 0.0},
          {"layers", layers},
          {"files", files},
          {"bytes", facts.bytes},
          {"bits_per_cell", facts.bitsPerCell},
          {"imagery", imagery},
          {"inputs", toJson(m.inputs)},
          {"built_by", m.builtBy},
          {"build_options", m.buildOptions}};
}

void print(const Manifest& m, const Facts& facts) {
  const auto line = [](const char* name, const std::string& value) {
    if (!value.empty()) fmt::print("{:<14} {}\n", name, value);
  };
  const double width = static_cast<double>(m.extentCols - 1) * m.frame.spacingXMeters() / 1000.0;
  const double height = static_cast<double>(m.extentRows - 1) * m.frame.spacingYMeters() / 1000.0;
  fmt::print("{}\n", m.name);
  line("CRS", m.crsName);
  line("heights", m.verticalDatum);
  line("extent", fmt::format("{:.3f} to {:.3f} east, {:.3f} to {:.3f} north ({:.4g} x {:.4g} km)", facts.west,
                             facts.east, facts.south, facts.north, width, height));
  line("samples", fmt::format("{} x {}, every {:.4g} m", formatCount(m.extentCols), formatCount(m.extentRows),
                              m.frame.spacingXMeters()));
  line("ground", fmt::format("{:.4g} km2, from {:.1f} to {:.1f} m", facts.coveredSquareMeters / 1e6,
                             m.minHeight, m.maxHeight));
  const bool isWarped =
      std::any_of(m.inputs.begin(), m.inputs.end(), [](const InputRecord& input) { return input.warped; });
  line("heights kept",
       m.maxErrorMeters == 0.0
           ? fmt::format("exactly, in steps of {:.4g} m", m.scale.heightStep)
           : fmt::format("within {:.4g} m{}, in steps of {:.4g} m", m.maxErrorMeters,
                         isWarped ? " of the inputs as they were warped" : "", m.scale.heightStep));
  std::string levels;
  for (size_t i = 0; i < facts.tilesByLevel.size(); ++i)
    levels += fmt::format("{}{}", i == 0 ? "" : " ", facts.tilesByLevel[i]);
  line("tiles", fmt::format("{} on levels 0 to {} ({})", formatCount(static_cast<int64_t>(m.tileCount)),
                            m.frame.finestLevel, levels));
  if (m.scale.layerCount == 1) {
    line("file", fmt::format("{}, {}, {:.2f} bits a cell", elevationArchiveName(0),
                             formatBytes(elevationBytes(m)), facts.bitsPerCell));
  } else {
    for (int layer = 0; layer < m.scale.layerCount; ++layer) {
      const std::string name = elevationArchiveName(layer);
      line(layer == 0 ? "layers" : "",
           fmt::format("{} for heights within {:.4g} m, {}", name, layerError(m, layer),
                       formatBytes(archiveOf(m, name).bytes)));
    }
    line("",
         fmt::format("{} together, {:.2f} bits a cell", formatBytes(elevationBytes(m)), facts.bitsPerCell));
  }
  for (const ImageryLayerRecord& layer : m.imagery) {
    line("imagery",
         fmt::format("{}: a texel every {:.4g} m, {} tiles on levels 0 to {}, bands {}", layer.name,
                     texelMeters(m, layer), formatCount(static_cast<int64_t>(layer.tileCount)),
                     layer.finestLevel, layer.bands));
    line("", fmt::format(
                 "{}, {}, {} at quality {}", layer.archive, formatBytes(archiveOf(m, layer.archive).bytes),
                 layer.format == ImageryFormat::Webp ? "WebP (root: progressive JPEG)" : "progressive JPEG",
                 layer.quality));
    for (const auto& [low, high] : layer.stretch)
      line("", fmt::format("stretched from {:.6g} to {:.6g}", low, high));
    line("", layer.attribution);
  }
  for (const InputRecord& input : m.inputs) {
    line("input", fmt::format("{}, {} x {} {}, {}", input.name, input.width, input.height, input.dataType,
                              input.warped ? "warped (" + input.resampling + ")" : "taken sample by sample"));
  }
  line("attribution", m.attribution);
  line("built by", m.builtBy + (m.buildOptions.empty() ? "" : " with " + m.buildOptions));
}

int runInfo(const InfoArguments& options) {
  OutputOptions output;
  output.json = options.json;
  const auto progress = makeProgress({.quiet = true});
  const auto dataset = openDatasetArgument(options.dataset, *progress);
  if (!dataset.ok()) return fail(dataset.error(), output);
  const Facts facts = factsOf(*dataset);
  if (options.json)
    printJson(toJson(dataset->manifest(), facts));
  else
    print(dataset->manifest(), facts);
  return kExitOk;
}

}  // namespace

void addInfoCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("info", "Say what is in a dataset");
  command->footer(kInfoExamples);
  const auto options = std::make_shared<InfoArguments>();
  command->add_option("DATASET", options->dataset, kDatasetArgument)->required();
  command->add_flag("--json", options->json, "Print one JSON object instead of text");
  command->callback([&context, options] { context.run = [options] { return runInfo(*options); }; });
}

}  // namespace terrane::cli
