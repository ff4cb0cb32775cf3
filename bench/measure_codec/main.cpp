#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "bound_check.h"
#include "cpu_time.h"
#include "others.h"
#include "stored_pyramid.h"
#include "terrane/measure/bench_result.h"

/// Bits a sample and decode speed of Terrane's elevation beside other codecs.
///
/// usage: measure_codec RESULT.json CACHE.json {INPUT LOSSLESS HALF QUARTER}...
///
/// Each input comes with three datasets made of it: by default, and with a --max-error of a half and of a
/// quarter of its sample spacing.

namespace terrane {
namespace {

/// As many tiles of a file tell how fast another codec decodes.
constexpr size_t kTimedTiles = 16;

struct Setting {
  const char* name;
  double spacings;  ///< the bound, in sample spacings
};
constexpr Setting kSettings[] = {{"lossless", 0.0}, {"half", 0.5}, {"quarter", 0.25}};

struct Outcome {
  size_t setting = 0;
  double samples = 0.0;  ///< of the finest level, with a height
  uint64_t ours = 0;     ///< bytes
  uint64_t jxl = 0;
  uint64_t best = 0;
  double decodedSamples = 0.0;  ///< of ours in oursSeconds
  double oursSeconds = 0.0;
  double jxlSeconds = 0.0;  ///< for as many samples
  int64_t violations = 0;
};

struct DecodeSpeeds {
  double oursSeconds = 0.0;                           ///< for the whole pyramid
  std::array<double, kOtherCodecs> samplesASecond{};  ///< of the others; 0: does not take part
};

/// All codecs in turns, so that what else the machine does meets all of them.
Result<DecodeSpeeds> measureDecoding(const StoredPyramid& pyramid, const std::vector<TileContent>& tiles,
                                     const OtherSizes& sizes) {
  std::vector<EncodedTiles> others;
  std::vector<size_t> places;
  auto codecs = makeOtherCodecs();
  for (size_t i = 0; i < codecs.size(); ++i) {
    if (sizes.bytes[i] == 0) continue;
    TERRANE_ASSIGN(EncodedTiles encoded, EncodedTiles::encode(std::move(codecs[i]), tiles, kTimedTiles));
    others.push_back(std::move(encoded));
    places.push_back(i);
  }
  std::vector<std::vector<double>> seconds(others.size() + 1);
  for (int turn = 0; turn < kTurns; ++turn) {
    TERRANE_ASSIGN(const double ours, secondsOf([&] { return pyramid.decodeAll(); }));
    seconds.back().push_back(ours);
    for (size_t i = 0; i < others.size(); ++i) {
      TERRANE_ASSIGN(const double other, secondsOf([&] { return others[i].decodeAll(); }));
      seconds[i].push_back(other);
    }
  }
  DecodeSpeeds speeds;
  speeds.oursSeconds = median(seconds.back());
  for (size_t i = 0; i < others.size(); ++i)
    speeds.samplesASecond[places[i]] = static_cast<double>(others[i].samples()) / median(seconds[i]);
  return speeds;
}

/// Bytes of the masks that tell void from ground, by the codec that is best at them. The others' sizes leave
/// them out, ours holds its own.
Result<uint64_t> smallestMasks(const std::vector<SourceTile>& source, nlohmann::json& cache) {
  const std::vector<TileContent> masks = voidMasks(source);
  if (masks.empty()) return uint64_t{0};
  TERRANE_ASSIGN(const OtherSizes sizes, measureSizes(masks, cache));
  uint64_t smallest = UINT64_MAX;
  for (const uint64_t bytes : sizes.bytes) {
    if (bytes > 0) smallest = std::min(smallest, bytes);
  }
  return smallest;
}

Result<Outcome> measureSetting(const std::string& name, size_t index, const StoredPyramid& pyramid,
                               const std::vector<SourceTile>& source, BenchResult& result,
                               nlohmann::json& cache) {
  const Setting& setting = kSettings[index];
  const Manifest& manifest = pyramid.manifest();
  const double asked = setting.spacings * manifest.frame.spacingXMeters();
  if (asked > 0.0 && manifest.maxErrorMeters > asked * (1.0 + 1e-9))
    return makeError("{}: the dataset states a bound of {} m, not {} m", name, manifest.maxErrorMeters,
                     asked);

  std::vector<TileContent> tiles;
  Outcome outcome;
  outcome.setting = index;
  for (const SourceTile& tile : source) {
    tiles.push_back(contentOf(tile, manifest.scale, asked));
    outcome.samples += static_cast<double>(tile.ownSamples);
  }
  TERRANE_ASSIGN(const BoundCheck check, checkBound(pyramid, source));
  TERRANE_ASSIGN(const OtherSizes sizes, measureSizes(tiles, cache));
  TERRANE_ASSIGN(const uint64_t maskBytes, smallestMasks(source, cache));
  TERRANE_ASSIGN(const DecodeSpeeds speeds, measureDecoding(pyramid, tiles, sizes));

  const auto codecs = makeOtherCodecs();
  outcome.ours = pyramid.bytes();
  outcome.violations = check.violations;
  outcome.oursSeconds = speeds.oursSeconds;
  outcome.decodedSamples = static_cast<double>(pyramid.finestTiles()) * kTileSampleCount;
  std::string best;
  for (size_t i = 0; i < codecs.size(); ++i) {
    if (sizes.bytes[i] == 0) continue;
    if (best.empty() || sizes.bytes[i] < outcome.best) {
      best = codecs[i]->name();
      outcome.best = sizes.bytes[i];
    }
    if (codecs[i]->name() == "jxl") {
      outcome.jxl = sizes.bytes[i];
      outcome.jxlSeconds = outcome.decodedSamples / speeds.samplesASecond[i];
    }
  }

  const auto bits = [&](uint64_t bytes) { return 8.0 * static_cast<double>(bytes) / outcome.samples; };
  const auto ratio = [&](uint64_t bytes) {
    return static_cast<double>(outcome.ours) / static_cast<double>(bytes);
  };
  nlohmann::ordered_json row = {{"file", name},
                                {"setting", setting.name},
                                {"bound_m", manifest.maxErrorMeters},
                                {"samples", static_cast<int64_t>(outcome.samples)},
                                {"ours", bits(outcome.ours)},
                                {"ours_finest", bits(pyramid.finestBytes())}};
  for (size_t i = 0; i < codecs.size(); ++i) {
    const std::string column(codecs[i]->name());
    row[column] =
        sizes.bytes[i] == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(bits(sizes.bytes[i]));
  }
  row["void_mask"] = bits(maskBytes);
  row["to_jxl"] = ratio(outcome.jxl);
  row["to_best"] = ratio(outcome.best);
  row["best"] = best;
  row["ours_msps"] = outcome.decodedSamples / speeds.oursSeconds / 1e6;
  for (size_t i = 0; i < codecs.size(); ++i) {
    row[std::string(codecs[i]->name()) + "_msps"] =
        sizes.bytes[i] == 0 ? nlohmann::ordered_json()
                            : nlohmann::ordered_json(speeds.samplesASecond[i] / 1e6);
  }
  row["divided"] = sizes.dividedTiles;
  row["max_error_m"] = check.largestMeters;
  row["violations"] = check.violations;
  result.rows.push_back(row);
  std::fprintf(
      stderr,
      "%s, %s: %.3f bits a sample, JPEG XL %.3f, best %.3f; decodes %.1f, JPEG XL %.1f million a second\n",
      name.c_str(), setting.name, bits(outcome.ours), bits(outcome.jxl), bits(outcome.best),
      row["ours_msps"].get<double>(), row["jxl_msps"].get<double>());
  return outcome;
}

void setBars(const std::vector<Outcome>& outcomes, BenchResult& result) {
  double worst = 0.0;
  double violations = 0.0;
  std::array<double, 3> ours{};
  std::array<double, 3> best{};
  double jxl = 0.0;
  double oursSeconds = 0.0;
  double jxlSeconds = 0.0;
  for (const Outcome& outcome : outcomes) {
    ours[outcome.setting] += static_cast<double>(outcome.ours);
    best[outcome.setting] += static_cast<double>(outcome.best);
    violations += static_cast<double>(outcome.violations);
    if (outcome.setting == 0) {
      jxl += static_cast<double>(outcome.jxl);
      oursSeconds += outcome.oursSeconds;
      jxlSeconds += outcome.jxlSeconds;
    } else {
      worst = std::max(worst, static_cast<double>(outcome.ours) / static_cast<double>(outcome.best));
    }
  }
  result.bars = {{"lossless_vs_jxl", ours[0] / jxl, "", 1.0},
                 {"decode_speed_vs_jxl", jxlSeconds / oursSeconds, "", 8.0, Bar::Side::AtLeast},
                 {"bound_half_vs_best", ours[1] / best[1], "", 0.55},
                 {"bound_quarter_vs_best", ours[2] / best[2], "", 0.95},
                 {"bound_worst_file", worst, "", 1.15},
                 {"bound_violations", violations, "samples", 0.0}};
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 6 || arguments.size() % 4 != 2)
    return makeError("usage: measure_codec RESULT.json CACHE.json {{INPUT LOSSLESS HALF QUARTER}}...");
  nlohmann::json cache = nlohmann::json::object();
  if (std::ifstream stored(arguments[1]); stored) {
    cache = nlohmann::json::parse(stored, nullptr, false);
    if (!cache.is_object()) return makeError("{}: is damaged; remove it", arguments[1]);
  }

  BenchResult result;
  result.bench = "codec";
  std::vector<Outcome> outcomes;
  for (size_t i = 2; i < arguments.size(); i += 4) {
    const std::string name = std::filesystem::path(arguments[i + 1]).stem().string();
    std::vector<SourceTile> source;
    for (size_t setting = 0; setting < 3; ++setting) {
      TERRANE_ASSIGN(const StoredPyramid pyramid, StoredPyramid::open(arguments[i + 1 + setting]));
      if (setting == 0) {
        TERRANE_ASSIGN(source, readSourceTiles(arguments[i], pyramid.manifest()));
      }
      TERRANE_ASSIGN(const Outcome outcome, measureSetting(name, setting, pyramid, source, result, cache));
      outcomes.push_back(outcome);
      TERRANE_TRY(writeTextFile(arguments[1], cache.dump(1) + "\n"));
    }
  }
  setBars(outcomes, result);
  return finishBench(result, arguments[0]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_codec", argc, argv, terrane::run);
}
