#include "terrane/dataset/manifest.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "manifest_seal.h"
#include "terrane/dataset/hash.h"

// docs/format/dataset-v1.md and manifest.schema.json specify every member that is written and read here.
namespace terrane {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kSealMember = "\"manifestSha256\": \"";
constexpr size_t kSealDigits = 64;
constexpr const char* kFormat = "terrane-dataset";
constexpr const char* kElevationCodec = "terrane-elevation";
constexpr int kElevationCodecVersion = 2;
/// Of elevation in layers of significance: who knows nothing of them must not take the first for all.
constexpr int kLayeredCodecVersion = 3;
constexpr const char* kImageryCodec = "terrane-imagery";
constexpr int kImageryCodecVersion = 1;
constexpr size_t kMostImageryLayers = 256;
/// Integers beyond it are not safe in every JSON reader.
constexpr uint64_t kLargestInteger = uint64_t{1} << 53;

bool isHexDigit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}

bool isSha256(const std::string& text) {
  return text.size() == kSealDigits && std::all_of(text.begin(), text.end(), isHexDigit);
}

/// A name that cannot lead out of the dataset's directory.
bool isPlainFileName(const std::string& name) {
  const auto isFine = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 255 && name[0] != '.' &&
         std::all_of(name.begin(), name.end(), isFine);
}

/// Takes members out of a JSON object and remembers the first that is not as it should be.
class MemberReader {
 public:
  MemberReader(const Json& object, std::string path, std::optional<Error>& error)
      : object_(object), path_(std::move(path)), error_(error) {
    if (!object_.is_object()) fail("", "is not an object");
  }

  /// A member that is an object itself.
  MemberReader object(const char* name) const { return {member(name), pathOf(name), error_}; }
  /// A member that is an array, at most `limit` long.
  const Json& array(const char* name, size_t limit) const {
    const Json& value = member(name);
    if (value.is_array() && value.size() <= limit) return value;
    fail(name, fmt::format("is not an array of at most {}", limit));
    return emptyArray();
  }

  /// Whether there is such a member at all.
  bool has(const char* name) const { return object_.is_object() && object_.contains(name); }

  void read(const char* name, std::string& out) const {
    const Json& value = member(name);
    if (!value.is_string()) return fail(name, "is not a text");
    out = value.get<std::string>();
  }
  void read(const char* name, bool& out) const {
    const Json& value = member(name);
    if (!value.is_boolean()) return fail(name, "is not true or false");
    out = value.get<bool>();
  }
  void read(const char* name, double& out, double least, double most) const {
    const Json& value = member(name);
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (!(number >= least && number <= most)) {
      return fail(name, fmt::format("is not a number from {} to {}", least, most));
    }
    out = number;
  }
  template <class Integer>
  void readInteger(const char* name, Integer& out, uint64_t least, uint64_t most) const {
    const Json& value = member(name);
    const bool isThere =
        value.is_number_unsigned() && value.get<uint64_t>() >= least && value.get<uint64_t>() <= most;
    if (!isThere) return fail(name, fmt::format("is not a whole number from {} to {}", least, most));
    out = static_cast<Integer>(value.get<uint64_t>());
  }
  void readSha256(const char* name, std::string& out) const {
    read(name, out);
    if (!isSha256(out)) fail(name, "is not a SHA-256 in 64 lower-case hexadecimal digits");
  }
  void fail(const char* name, const std::string& what) const {
    if (!error_) error_ = makeError("\"{}\" {}", pathOf(name), what);
  }

  std::string pathOf(const char* name) const {
    if (path_.empty() || *name == '\0') return path_ + name;
    return path_ + "." + name;
  }

 private:
  const Json& member(const char* name) const {
    static const Json kNothing;
    const auto found = object_.is_object() ? object_.find(name) : object_.end();
    if (object_.is_object() && found != object_.end()) return *found;
    if (object_.is_object()) fail(name, "is missing");
    return kNothing;
  }
  static const Json& emptyArray() {
    static const Json kEmpty = Json::array();
    return kEmpty;
  }

  const Json& object_;
  std::string path_;
  std::optional<Error>& error_;
};

Json inputToJson(const InputRecord& input) {
  return {{"name", input.name},
          {"bytes", input.bytes},
          {"sha256", input.sha256},
          {"width", input.width},
          {"height", input.height},
          {"dataType", input.dataType},
          {"crs", input.sourceCrs},
          {"warped", input.warped},
          {"resampling", input.resampling},
          {"nativeLevel", input.nativeLevel},
          {"noData", input.noData}};
}

void readInputs(const MemberReader& members, std::vector<InputRecord>& inputs, std::optional<Error>& error) {
  for (const Json& entry : members.array("inputs", 10'000'000)) {
    InputRecord& input = inputs.emplace_back();
    const MemberReader record(entry, fmt::format("{}[{}]", members.pathOf("inputs"), inputs.size() - 1),
                              error);
    record.read("name", input.name);
    record.readInteger("bytes", input.bytes, 0, kLargestInteger);
    record.readSha256("sha256", input.sha256);
    record.readInteger("width", input.width, 1, INT32_MAX);
    record.readInteger("height", input.height, 1, INT32_MAX);
    record.read("dataType", input.dataType);
    record.read("crs", input.sourceCrs);
    record.read("warped", input.warped);
    record.read("resampling", input.resampling);
    record.readInteger("nativeLevel", input.nativeLevel, 0, kMaxLevel);
    record.read("noData", input.noData);
    if (error) return;
  }
}

const char* formatName(ImageryFormat format) {
  return format == ImageryFormat::Webp ? "webp" : "jpeg";
}

Json imageryToJson(const ImageryLayerRecord& layer) {
  Json inputs = Json::array();
  for (const InputRecord& input : layer.inputs) inputs.push_back(inputToJson(input));
  Json stretch = Json::array();
  for (const auto& [low, high] : layer.stretch) stretch.push_back({{"black", low}, {"white", high}});
  return {{"name", layer.name},
          {"archive", layer.archive},
          {"codec", kImageryCodec},
          {"codecVersion", kImageryCodecVersion},
          {"format", formatName(layer.format)},
          {"quality", layer.quality},
          {"tileSide", kImageryTileSide},
          {"finestLevel", layer.finestLevel},
          {"tileCount", layer.tileCount},
          {"bounds",
           {{"west", layer.bounds[0]},
            {"south", layer.bounds[1]},
            {"east", layer.bounds[2]},
            {"north", layer.bounds[3]}}},
          {"attribution", layer.attribution},
          {"bands", layer.bands},
          {"stretch", stretch},
          {"inputs", inputs}};
}

void readImageryLayer(const MemberReader& json, ImageryLayerRecord& layer, std::optional<Error>& error) {
  std::string codec, format;
  int version = 0, tileSide = 0;
  json.read("name", layer.name);
  if (!isImageryName(layer.name)) json.fail("name", "is not 1 to 64 letters, digits, '-' and '_'");
  json.read("archive", layer.archive);
  if (layer.archive != imageryArchiveName(layer.name))
    json.fail("archive", fmt::format("is not \"{}\"", imageryArchiveName(layer.name)));
  json.read("codec", codec);
  if (codec != kImageryCodec) json.fail("codec", fmt::format("is not \"{}\"", kImageryCodec));
  json.readInteger("codecVersion", version, 1, kImageryCodecVersion);
  json.read("format", format);
  layer.format = format == "webp" ? ImageryFormat::Webp : ImageryFormat::Jpeg;
  if (format != formatName(layer.format)) json.fail("format", "is neither \"jpeg\" nor \"webp\"");
  json.readInteger("quality", layer.quality, 1, 100);
  json.readInteger("tileSide", tileSide, kImageryTileSide, kImageryTileSide);
  json.readInteger("finestLevel", layer.finestLevel, 0, kMaxLevel);
  json.readInteger("tileCount", layer.tileCount, 1, kLargestInteger);
  const MemberReader bounds = json.object("bounds");
  bounds.read("west", layer.bounds[0], -1e12, 1e12);
  bounds.read("south", layer.bounds[1], -1e12, 1e12);
  bounds.read("east", layer.bounds[2], layer.bounds[0], 1e12);
  bounds.read("north", layer.bounds[3], layer.bounds[1], 1e12);
  json.read("attribution", layer.attribution);
  json.read("bands", layer.bands);
  for (const Json& entry : json.array("stretch", 4)) {
    const MemberReader channel(entry, json.pathOf("stretch"), error);
    auto& [low, high] = layer.stretch.emplace_back();
    channel.read("black", low, -1e300, 1e300);
    channel.read("white", high, -1e300, 1e300);
  }
  readInputs(json, layer.inputs, error);
}

/// Datasets without imagery need not mention it.
void readImagery(const MemberReader& layers, std::vector<ImageryLayerRecord>& imagery,
                 std::optional<Error>& error) {
  if (!layers.has("imagery")) return;
  for (const Json& entry : layers.array("imagery", kMostImageryLayers)) {
    const MemberReader json(entry, fmt::format("layers.imagery[{}]", imagery.size()), error);
    ImageryLayerRecord layer;
    readImageryLayer(json, layer, error);
    const auto sameName = [&](const ImageryLayerRecord& other) { return other.name == layer.name; };
    if (std::any_of(imagery.begin(), imagery.end(), sameName)) json.fail("name", "is another layer's too");
    if (error) return;
    imagery.push_back(std::move(layer));
  }
}

void readArchives(const MemberReader& members, std::vector<ArchiveRecord>& archives,
                  std::optional<Error>& error) {
  for (const Json& entry : members.array("archives", 1000)) {
    ArchiveRecord& archive = archives.emplace_back();
    const MemberReader record(entry, fmt::format("archives[{}]", archives.size() - 1), error);
    record.read("name", archive.name);
    if (!isPlainFileName(archive.name)) record.fail("name", "is not a plain file name");
    record.readInteger("bytes", archive.bytes, 0, kLargestInteger);
    record.readSha256("sha256", archive.sha256);
    if (error) return;
  }
}

void readFrame(const MemberReader& members, Manifest& manifest) {
  Frame& frame = manifest.frame;
  const MemberReader json = members.object("frame");
  json.read("originEasting", frame.originEasting, -1e12, 1e12);
  json.read("originNorthing", frame.originNorthing, -1e12, 1e12);
  json.read("spacingX", frame.spacingX, 1e-9, 1e9);
  json.read("spacingY", frame.spacingY, 1e-9, 1e9);
  json.read("metersPerUnit", frame.metersPerUnit, 1e-9, 1e9);
  json.readInteger("finestLevel", frame.finestLevel, 0, kMaxLevel);

  const auto worldSamples = static_cast<uint64_t>(frame.worldCells() + 1);
  const MemberReader extent = members.object("extent");
  extent.readInteger("cols", manifest.extentCols, 1, worldSamples);
  extent.readInteger("rows", manifest.extentRows, 1, worldSamples);
}

/// Which of the versions that are read is the codec's, and so whether the elevation is in layers.
void readCodecVersion(const MemberReader& elevation, int& version) {
  elevation.readInteger("codecVersion", version, 1, kLayeredCodecVersion);
  if (version < kElevationCodecVersion)
    elevation.fail("codecVersion", fmt::format("is {}, which this program no longer reads", version));
  if (version == kLayeredCodecVersion) return;
  for (const char* name : {"refinements", "layerErrorsMeters"})
    if (elevation.has(name)) elevation.fail(name, fmt::format("is there in codec version {}", version));
}

/// The layers of significance after the first, and the bounds of all but the last.
void readRefinements(const MemberReader& elevation, ElevationScale& scale, std::optional<Error>& error) {
  constexpr size_t kMost = ElevationScale::kMostLayers - 1;
  const Json& refinements = elevation.array("refinements", kMost);
  if (refinements.empty()) elevation.fail("refinements", "is empty");
  scale.layerCount = 1;
  for (const Json& entry : refinements) {
    const MemberReader json(
        entry, fmt::format("{}[{}]", elevation.pathOf("refinements"), scale.layerCount - 1), error);
    std::string archive;
    json.read("archive", archive);
    const std::string expected = elevationArchiveName(scale.layerCount);
    if (archive != expected) json.fail("archive", fmt::format("is not \"{}\"", expected));
    ++scale.layerCount;
  }

  const Json& bounds = elevation.array("layerErrorsMeters", kMost);
  if (bounds.size() != refinements.size()) {
    elevation.fail("layerErrorsMeters",
                   fmt::format("has {} members for {} refinements", bounds.size(), refinements.size()));
  }
  if (error) return;
  for (size_t i = 0; i < bounds.size(); ++i) {
    const double bound = bounds[i].is_number() ? bounds[i].get<double>() : NAN;
    if (!(bound > scale.sampleError && bound <= 1e9) || (i > 0 && !(bound < scale.layerErrors[i - 1])))
      elevation.fail("layerErrorsMeters", "are not falling numbers above maxErrorMeters");
    scale.layerErrors[i] = bound;
  }
  scale.layerErrors[bounds.size()] = scale.sampleError;
}

void readElevation(const MemberReader& members, Manifest& manifest, std::optional<Error>& error) {
  ElevationScale& scale = manifest.scale;
  const MemberReader json = members.object("layers").object("elevation");
  std::string archive;
  std::string codec;
  int codecVersion = 0;
  json.read("archive", archive);
  if (archive != elevationArchiveName(0))
    json.fail("archive", fmt::format("is not \"{}\"", elevationArchiveName(0)));
  json.read("codec", codec);
  if (codec != kElevationCodec) json.fail("codec", fmt::format("is not \"{}\"", kElevationCodec));
  readCodecVersion(json, codecVersion);
  json.read("heightStep", scale.heightStep, 1e-9, 1e6);
  json.read("heightOffset", scale.heightOffset, -1e9, 1e9);
  json.read("errorUnit", scale.errorUnit, 1e-12, 1e9);
  json.read("rangeBase", scale.rangeBase, -1e9, 1e9);
  json.read("rangeUnit", scale.rangeUnit, 1e-12, 1e9);
  json.read("minHeight", manifest.minHeight, -1e9, 1e9);
  json.read("maxHeight", manifest.maxHeight, manifest.minHeight, 1e9);
  json.read("maxErrorMeters", manifest.maxErrorMeters, 0.0, 1e9);
  scale.sampleError = manifest.maxErrorMeters;
  json.readInteger("tileCount", manifest.tileCount, 0, kLargestInteger);
  json.read("coveredCells", manifest.coveredCells, 0.0, 1e18);
  if (json.has("roughness")) json.read("roughness", scale.roughness, 0.0, 1e9);
  if (json.has("zeroShare")) json.read("zeroShare", manifest.zeroShare.emplace(), 0.0, 1.0);
  if (codecVersion == kLayeredCodecVersion) readRefinements(json, scale, error);
}

/// The version of the elevation's codec where it is one that only newer programs read.
std::optional<int> newerCodecVersion(const Json& json) {
  std::optional<Error> ignored;
  int version = 0;
  MemberReader(json, "", ignored)
      .object("layers")
      .object("elevation")
      .readInteger("codecVersion", version, kLayeredCodecVersion + 1, INT32_MAX);
  return version > kLayeredCodecVersion ? std::optional(version) : std::nullopt;
}

}  // namespace

bool isImageryName(const std::string& name) {
  const auto isFine = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), isFine);
}

std::string elevationArchiveName(int layer) {
  return layer == 0 ? "elevation.pmtiles" : fmt::format("elevation-{}.pmtiles", layer);
}

uint64_t elevationBytes(const Manifest& manifest) {
  uint64_t sum = 0;
  for (const ArchiveRecord& archive : manifest.archives) {
    for (int layer = 0; layer < manifest.scale.layerCount; ++layer)
      if (archive.name == elevationArchiveName(layer)) sum += archive.bytes;
  }
  return sum;
}

std::string imageryArchiveName(const std::string& layerName) {
  return layerName == "imagery" ? "imagery.pmtiles" : "imagery-" + layerName + ".pmtiles";
}

std::optional<size_t> findSeal(std::string_view text) {
  // note: inside a JSON text a quotation mark is written \", so no value can look like this member.
  const size_t found = text.find(kSealMember);
  if (found == std::string_view::npos || text.find(kSealMember, found + 1) != std::string_view::npos)
    return {};
  const size_t digits = found + kSealMember.size();
  if (text.size() < digits + kSealDigits + 1 || text[digits + kSealDigits] != '"') return {};
  const std::string_view seal = text.substr(digits, kSealDigits);
  if (!std::all_of(seal.begin(), seal.end(), isHexDigit)) return {};
  return digits;
}

std::string sealOf(std::string text, size_t seal) {
  text.replace(seal, kSealDigits, kSealDigits, '0');
  return sha256(text);
}

std::string sealManifest(std::string text) {
  if (const auto seal = findSeal(text)) text.replace(*seal, kSealDigits, sealOf(text, *seal));
  return text;
}

std::string manifestToJson(const Manifest& manifest) {
  const Frame& frame = manifest.frame;
  const ElevationScale& scale = manifest.scale;
  Json inputs = Json::array();
  for (const InputRecord& input : manifest.inputs) inputs.push_back(inputToJson(input));
  Json archives = Json::array();
  for (const ArchiveRecord& archive : manifest.archives) {
    archives.push_back({{"name", archive.name}, {"bytes", archive.bytes}, {"sha256", archive.sha256}});
  }

  Json json = {
      {"format", kFormat},
      {"formatVersion", manifest.formatVersion},
      {"name", manifest.name},
      {"crs",
       {{"name", manifest.crsName}, {"wkt", manifest.crsWkt}, {"verticalDatum", manifest.verticalDatum}}},
      {"frame",
       {{"originEasting", frame.originEasting},
        {"originNorthing", frame.originNorthing},
        {"spacingX", frame.spacingX},
        {"spacingY", frame.spacingY},
        {"metersPerUnit", frame.metersPerUnit},
        {"finestLevel", frame.finestLevel}}},
      {"extent", {{"cols", manifest.extentCols}, {"rows", manifest.extentRows}}},
      {"layers",
       {{"elevation",
         {{"archive", elevationArchiveName(0)},
          {"codec", kElevationCodec},
          {"codecVersion", scale.layerCount > 1 ? kLayeredCodecVersion : kElevationCodecVersion},
          {"heightStep", scale.heightStep},
          {"heightOffset", scale.heightOffset},
          {"errorUnit", scale.errorUnit},
          {"rangeBase", scale.rangeBase},
          {"rangeUnit", scale.rangeUnit},
          {"minHeight", manifest.minHeight},
          {"maxHeight", manifest.maxHeight},
          {"maxErrorMeters", manifest.maxErrorMeters},
          {"tileCount", manifest.tileCount},
          {"coveredCells", manifest.coveredCells},
          {"roughness", scale.roughness}}}}},
      {"attribution", manifest.attribution},
      {"inputs", inputs},
      {"builtBy", manifest.builtBy},
      {"buildOptions", manifest.buildOptions},
      {"archives", archives},
      {"manifestSha256", std::string(kSealDigits, '0')},
  };
  if (manifest.zeroShare) json["layers"]["elevation"]["zeroShare"] = *manifest.zeroShare;
  for (int layer = 1; layer < scale.layerCount; ++layer) {
    Json& elevation = json["layers"]["elevation"];
    elevation["refinements"].push_back({{"archive", elevationArchiveName(layer)}});
    elevation["layerErrorsMeters"].push_back(scale.layerErrors[static_cast<size_t>(layer) - 1]);
  }
  for (const ImageryLayerRecord& layer : manifest.imagery)
    json["layers"]["imagery"].push_back(imageryToJson(layer));
  // File names need not be UTF-8, JSON must be.
  return sealManifest(json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

Result<Manifest> manifestFromJson(const std::string& text, const std::string& where) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object()) {
    return makeError("{}: is not a JSON object; the file is damaged, or not a manifest", where);
  }

  // The version comes first: of another one, nothing else can be judged.
  std::optional<Error> error;
  Manifest manifest;
  const MemberReader members(json, "", error);
  std::string format;
  members.read("format", format);
  if (!error && format != kFormat) members.fail("format", fmt::format("is not \"{}\"", kFormat));
  members.readInteger("formatVersion", manifest.formatVersion, 1, INT32_MAX);
  if (error) return makeError("{}: {}; this is no manifest of a Terrane dataset", where, error->message);
  if (manifest.formatVersion > Manifest::kFormatVersion) {
    return makeError("{}: has format version {}, this program reads {}: update Terrane", where,
                     manifest.formatVersion, Manifest::kFormatVersion);
  }

  // Then the seal: a changed byte is told as such, and not as whatever it led to.
  const std::optional<size_t> seal = findSeal(text);
  if (!seal) return makeError("{}: \"manifestSha256\" is missing or damaged; build the dataset again", where);
  if (text.compare(*seal, kSealDigits, sealOf(text, *seal)) != 0) {
    return makeError(
        "{}: was changed after it was written (\"manifestSha256\" does not match); restore it, or build the "
        "dataset "
        "again",
        where);
  }

  // Nor can elevation be judged that another codec made.
  if (const auto version = newerCodecVersion(json)) {
    return makeError("{}: has elevation of codec version {}, this program reads {}: update Terrane", where,
                     *version, kLayeredCodecVersion);
  }

  members.read("name", manifest.name);
  const MemberReader crs = members.object("crs");
  crs.read("name", manifest.crsName);
  crs.read("wkt", manifest.crsWkt);
  crs.read("verticalDatum", manifest.verticalDatum);
  readFrame(members, manifest);
  readElevation(members, manifest, error);
  readImagery(members.object("layers"), manifest.imagery, error);
  members.read("attribution", manifest.attribution);
  readInputs(members, manifest.inputs, error);
  members.read("builtBy", manifest.builtBy);
  members.read("buildOptions", manifest.buildOptions);
  readArchives(members, manifest.archives, error);
  if (error) return makeError("{}: {}; build the dataset again", where, error->message);
  return manifest;
}

}  // namespace terrane
