#include "terrane/serve/site.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "geographic.h"
#include "terrane/bake/build.h"
#include "terrane/bake/source.h"
#include "terrane/bake/synth.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/engine/elevation_query.h"
#include "web_mercator.h"

namespace terrane::serve {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// One dataset of made-up country with imagery, and the site that serves it.
class SiteTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(fs::temp_directory_path() / ("terrane_site_" + std::to_string(getpid())));
    fs::create_directories(*folder_);
    SilentProgress progress;
    SynthOptions synth;
    synth.output = (*folder_ / "made.tif").string();
    synth.colorOutput = (*folder_ / "color.tif").string();
    synth.cols = synth.rows = 1100;
    ASSERT_TRUE(synthesize(synth, progress).ok());
    SourceOptions inputs;
    inputs.inputs = {synth.output};
    const auto source = openSource(inputs, progress);
    ASSERT_TRUE(source.ok()) << source.error().message;
    BuildOptions options;
    options.output = (*folder_ / "made.terrane").string();
    options.attribution = "somebody & <others>";
    options.imagery.layers.push_back({});
    options.imagery.layers[0].inputs = {synth.colorOutput};
    ASSERT_TRUE(buildDataset(**source, options, progress).ok());
    metrics_ = new Metrics;
    SiteOptions site;
    site.datasets = {options.output + "/"};
    auto opened = Site::open(site, *metrics_);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    site_ = std::move(opened).value().release();
    base_ = new std::string("/d/made/" + site_->datasets().at(0).hash + "/");
  }
  static void TearDownTestSuite() {
    delete base_;
    delete site_;
    delete metrics_;
    fs::remove_all(*folder_);
    delete folder_;
  }

  static HttpResponse get(const std::string& target, HttpRequest fields = {}) {
    if (fields.method.empty()) fields.method = "GET";
    fields.target = target;
    return site_->answer(fields);
  }
  static HttpResponse post(const std::string& target, std::string_view body,
                           std::string_view type = "application/json") {
    HttpRequest fields;
    fields.method = "POST";
    fields.body = body;
    fields.contentType = type;
    return get(target, fields);
  }
  /// The body as it would be sent.
  static std::string bodyOf(const HttpResponse& response) {
    if (!response.file) return response.shared ? *response.shared : response.text;
    std::string out(response.fileBytes, '\0');
    EXPECT_EQ(
        pread(response.file->descriptor(), out.data(), out.size(), static_cast<off_t>(response.fileOffset)),
        static_cast<ssize_t>(out.size()));
    return out;
  }
  static std::string field(const HttpResponse& response, const std::string& name) {
    const size_t at = ("\r\n" + response.headers).find("\r\n" + name + ": ");
    if (at == std::string::npos) return "";
    const size_t begin = at + name.size() + 2;
    return response.headers.substr(begin, response.headers.find("\r\n", begin) - begin);
  }
  static std::string fileBytes(const std::string& name) {
    std::ifstream in(*folder_ / "made.terrane" / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static Json json(const HttpResponse& response) { return Json::parse(bodyOf(response), nullptr, false); }

  /// Red, green and blue of the made-up country's picture at a place of its CRS.
  static std::array<double, 3> colorAt(glm::dvec2 crs) {
    const Dataset dataset = std::move(*Dataset::open((*folder_ / "made.terrane").string()));
    const Manifest& manifest = dataset.manifest();
    const glm::dvec2 texel =
        manifest.frame.sampleFromLocal(glm::dvec2(manifest.frame.localFromCrs({crs, 0.0}))) *
        std::ldexp(1.0, manifest.imagery[0].finestLevel - manifest.frame.finestLevel);
    const auto col = static_cast<int32_t>(texel.x), row = static_cast<int32_t>(texel.y);
    const auto payload = dataset.readImagery(0, {manifest.imagery[0].finestLevel, col / 256, row / 256});
    const auto tile = decodeImagery(**payload);
    const uint8_t* rgba = tile->rgba.data() + 4 * (row % 256 * 256 + col % 256);
    return {static_cast<double>(rgba[0]), static_cast<double>(rgba[1]), static_cast<double>(rgba[2])};
  }

  static fs::path* folder_;
  static Metrics* metrics_;
  static Site* site_;
  static std::string* base_;
};
fs::path* SiteTest::folder_ = nullptr;
Metrics* SiteTest::metrics_ = nullptr;
Site* SiteTest::site_ = nullptr;
std::string* SiteTest::base_ = nullptr;

TEST_F(SiteTest, ListsWhatIsServed) {
  const Json list = json(get("/datasets.json"));
  ASSERT_EQ(list["datasets"].size(), 1U);
  EXPECT_EQ(list["datasets"][0]["name"], "made");
  EXPECT_EQ(list["datasets"][0]["immutable"], *base_);
  EXPECT_EQ(bodyOf(get(list["datasets"][0]["manifest"])), fileBytes("manifest.json"));
  const HttpResponse page = get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_NE(bodyOf(page).find("somebody &amp; &lt;others&gt;"), std::string::npos);
  EXPECT_EQ(bodyOf(page).find("<others>"), std::string::npos);
  EXPECT_NE(field(page, "Content-Security-Policy"), "");
  EXPECT_EQ(bodyOf(get("/healthz")), "ok\n");
  EXPECT_NE(bodyOf(get("/metrics")).find("terrane_tile_cache_bytes{dataset=\"made\"}"), std::string::npos);
}

/// The pixels of a PNG, three bytes each.
std::vector<uint8_t> pixelsOf(const std::string& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, png.data(), png.size()) == 0 || image.width != 256 ||
      image.height != 256)
    return {};
  image.format = PNG_FORMAT_RGB;
  std::vector<uint8_t> out(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, out.data(), 0, nullptr) == 0) return {};
  return out;
}

TEST_F(SiteTest, WebMapsGetTheHeightsThatQuestionsGet) {
  HttpRequest client;
  client.host = "terrain.example.org:8443";
  client.forwardedProto = "https";
  for (const std::string kind : {"terrarium", "terrain-rgb"}) {
    const HttpResponse described = get("/d/made/xyz/" + kind + ".json", client);
    ASSERT_EQ(described.status, 200);
    const Json tiles = json(described);
    const std::string url = tiles["tiles"][0];
    const std::string base = "https://terrain.example.org:8443" + *base_ + "xyz/" + kind + "/";
    ASSERT_EQ(url, base + "{z}/{x}/{y}.png");
    EXPECT_EQ(tiles["encoding"], kind == "terrarium" ? "terrarium" : "mapbox");
    EXPECT_EQ(tiles["attribution"], "somebody & <others>");
    const double west = tiles["bounds"][0], south = tiles["bounds"][1], east = tiles["bounds"][2],
                 north = tiles["bounds"][3];
    const int z = tiles["maxzoom"];
    const glm::dvec2 place =
        mercatorFromDegrees({0.5 * (west + east), 0.5 * (south + north)}) * std::ldexp(1.0, z);
    const int x = static_cast<int>(place.x), y = static_cast<int>(place.y);
    const std::string path = *base_ + "xyz/" + kind + fmt::format("/{}/{}/{}.png", z, x, y);
    const HttpResponse tile = get(path);
    ASSERT_EQ(tile.status, 200);
    EXPECT_EQ(field(tile, "Content-Type"), "image/png");
    EXPECT_NE(field(tile, "Cache-Control").find("immutable"), std::string::npos);
    const std::vector<uint8_t> pixels = pixelsOf(bodyOf(tile));
    ASSERT_EQ(pixels.size(), 256U * 256U * 3U);

    Json points = Json::array();
    for (int row = 3; row < 256; row += 25) {
      for (int col = 3; col < 256; col += 25) {
        const glm::dvec2 degrees = degreesFromMercator(
            (glm::dvec2(x, y) + glm::dvec2(col + 0.5, row + 0.5) / 256.0) / std::ldexp(1.0, z));
        points.push_back({degrees.x, degrees.y});
      }
    }
    const Json heights = json(
        post("/d/made/elevation", Json{{"points", points}, {"crs", "EPSG:4326"}}.dump()))["heightsMeters"];
    size_t i = 0;
    for (int row = 3; row < 256; row += 25) {
      for (int col = 3; col < 256; col += 25, ++i) {
        const uint8_t* rgb = pixels.data() + 3 * (row * 256 + col);
        const double height = kind == "terrarium" ? rgb[0] * 256.0 + rgb[1] + rgb[2] / 256.0 - 32768.0
                                                  : -10000.0 + 0.1 * (rgb[0] * 65536 + rgb[1] * 256 + rgb[2]);
        // A place may be off by a twentieth of a pixel, and ground rises as steeply as it falls.
        if (heights[i].is_number()) {
          EXPECT_NEAR(height, heights[i].get<double>(), 0.6) << kind;
        }
      }
    }

    // The same again is not made again, and under the name alone it is to be asked for again.
    HttpRequest again;
    const std::string etag = field(tile, "ETag");
    again.ifNoneMatch = etag;
    EXPECT_EQ(get(path, again).status, 304);
    const HttpResponse unversioned = get("/d/made/xyz/" + kind + fmt::format("/{}/{}/{}.png", z, x, y));
    EXPECT_EQ(bodyOf(unversioned), bodyOf(tile));
    EXPECT_EQ(field(unversioned, "Cache-Control"), "no-cache");
    // From far away it is small, and from farther it is between the pixels.
    EXPECT_EQ(get(fmt::format("/d/made/xyz/{}/{}/{}/{}.png", kind, z - 6, x >> 6, y >> 6)).status, 200);
    EXPECT_EQ(get("/d/made/xyz/" + kind + "/0/0/0.png").status, 404);
  }
}

TEST_F(SiteTest, WebMapsGetThePictures) {
  const Json tiles = json(get("/d/made/xyz/imagery/imagery.json"));
  // note: no client named this server, so its address is a path.
  EXPECT_EQ(tiles["tiles"][0], *base_ + "xyz/imagery/imagery/{z}/{x}/{y}.webp");
  EXPECT_FALSE(tiles.contains("encoding"));
  const double west = tiles["bounds"][0], south = tiles["bounds"][1], east = tiles["bounds"][2],
               north = tiles["bounds"][3];
  const int z = tiles["maxzoom"];
  const glm::dvec2 place =
      mercatorFromDegrees({0.5 * (west + east), 0.5 * (south + north)}) * std::ldexp(1.0, z);
  const std::string name = fmt::format("/d/made/xyz/imagery/imagery/{}/{}/{}", z, static_cast<int>(place.x),
                                       static_cast<int>(place.y));
  const HttpResponse webp = get(name + ".webp"), png = get(name + ".png");
  ASSERT_EQ(webp.status, 200);
  EXPECT_EQ(field(webp, "Content-Type"), "image/webp");
  EXPECT_EQ(bodyOf(webp).substr(0, 4), "RIFF");
  EXPECT_EQ(bodyOf(webp).substr(8, 4), "WEBP");
  const std::vector<uint8_t> pixels = pixelsOf(bodyOf(png));
  ASSERT_EQ(pixels.size(), 256U * 256U * 3U);
  // The colour in the middle is the source's there, but for what WebP takes and what lies between texels.
  const glm::dvec2 degrees =
      degreesFromMercator((glm::floor(place) + glm::dvec2(128.5, 128.5) / 256.0) / std::ldexp(1.0, z));
  Geographic geographic(Dataset::open((*folder_ / "made.terrane").string())->manifest().crsWkt);
  const glm::dvec2 crs = *geographic.crsFromGeographic(degrees);
  const std::array<double, 3> source = colorAt(crs);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(pixels[3 * (128 * 256 + 128) + c], source[c], 25.0) << c;
}

/// Reads numbers of a tile of terrain one after the other.
class TerrainReader {
 public:
  explicit TerrainReader(std::string bytes) : bytes_(std::move(bytes)) {}
  template <class T>
  T take() {
    T out{};
    EXPECT_LE(at_ + sizeof(T), bytes_.size());
    if (at_ + sizeof(T) <= bytes_.size()) std::memcpy(&out, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return out;
  }
  std::vector<int> takeDifferences(size_t count) {
    std::vector<int> out;
    int value = 0;
    for (size_t i = 0; i < count; ++i) {
      const int code = take<uint16_t>();
      out.push_back(value += code >> 1 ^ -(code & 1));
    }
    return out;
  }
  size_t left() const { return bytes_.size() - at_; }

 private:
  std::string bytes_;
  size_t at_ = 0;
};

TEST_F(SiteTest, CesiumGetsTheHeightsThatQuestionsGet) {
  const Json layer = json(get("/d/made/quantized-mesh/layer.json"));
  EXPECT_EQ(layer["tiles"][0], *base_ + "quantized-mesh/{z}/{x}/{y}.terrain");
  EXPECT_EQ(layer["attribution"], "somebody & <others>");
  const int z = layer["maxzoom"];
  const Json range = layer["available"][z][0];
  const int x = (range["startX"].get<int>() + range["endX"].get<int>()) / 2,
            y = (range["startY"].get<int>() + range["endY"].get<int>()) / 2;
  const std::string path = *base_ + fmt::format("quantized-mesh/{}/{}/{}.terrain", z, x, y);
  const HttpResponse tile = get(path);
  ASSERT_EQ(tile.status, 200);
  EXPECT_EQ(field(tile, "Content-Type"), "application/vnd.quantized-mesh");
  TerrainReader reader(bodyOf(tile));
  const glm::dvec3 center(reader.take<double>(), reader.take<double>(), reader.take<double>());
  // On the ground, 60 degrees north: where the ellipsoid is 6362 km from the middle of the earth.
  EXPECT_NEAR(glm::length(center), 6362e3, 3e3);
  const double low = static_cast<double>(reader.take<float>()),
               high = static_cast<double>(reader.take<float>());
  ASSERT_LT(low, high);
  for (int i = 0; i < 7; ++i) reader.take<double>();
  const size_t count = reader.take<uint32_t>();
  ASSERT_LT(count, 66000U);
  const std::vector<int> u = reader.takeDifferences(count), v = reader.takeDifferences(count),
                         h = reader.takeDifferences(count);
  Json points = Json::array();
  std::vector<double> heights;
  const double side = std::ldexp(180.0, -z);
  for (size_t i = 0; i < count; i += 1 + count / 500) {
    ASSERT_TRUE(u[i] >= 0 && u[i] <= 32767 && v[i] >= 0 && v[i] <= 32767 && h[i] >= 0 && h[i] <= 32767);
    points.push_back({-180.0 + side * (x + u[i] / 32767.0), -90.0 + side * (y + v[i] / 32767.0)});
    heights.push_back(low + (high - low) * h[i] / 32767.0);
  }
  const Json asked =
      json(post("/d/made/elevation", Json{{"points", points}, {"crs", "EPSG:4326"}}.dump()))["heightsMeters"];
  size_t compared = 0;
  for (size_t i = 0; i < heights.size(); ++i) {
    if (!asked[i].is_number()) continue;
    EXPECT_NEAR(heights[i], asked[i].get<double>(), 0.6);
    ++compared;
  }
  EXPECT_GT(compared, 100U);
  const size_t triangles = reader.take<uint32_t>();
  uint32_t next = 0;
  for (size_t i = 0; i < 3 * triangles; ++i) {
    const uint32_t code = reader.take<uint16_t>();
    ASSERT_LE(code, next);
    if (code == 0) ++next;
  }
  EXPECT_EQ(next, count);
  for (int edge = 0; edge < 4; ++edge) {
    const size_t onEdge = reader.take<uint32_t>();
    EXPECT_GE(onEdge, 2U);
    for (size_t i = 0; i < onEdge; ++i) EXPECT_LT(reader.take<uint16_t>(), count);
  }
  EXPECT_EQ(reader.take<uint8_t>(), 1);
  EXPECT_EQ(reader.take<uint32_t>(), 2 * count);
  EXPECT_EQ(reader.left(), 2 * count);

  // Known already, plainly and compressed.
  HttpRequest again;
  again.acceptEncoding = "gzip";
  const HttpResponse compressed = get(path, again);
  EXPECT_EQ(field(compressed, "Content-Encoding"), "gzip");
  const std::string etag = field(compressed, "ETag");
  again.ifNoneMatch = etag;
  EXPECT_EQ(get(path, again).status, 304);
  HttpRequest plain;
  const std::string plainEtag = field(tile, "ETag");
  plain.ifNoneMatch = plainEtag;
  EXPECT_EQ(get(path, plain).status, 304);
  for (const std::string wrong :
       {"quantized-mesh", "quantized-mesh/0/0/0", "quantized-mesh/0/2/0.terrain", "quantized-mesh/1/0/0.png",
        "quantized-mesh/1/0/0/0.terrain", "quantized-mesh/meta.json"})
    EXPECT_EQ(get("/d/made/" + wrong).status, 404) << wrong;
  // Level at the sea, where there is nothing: a root of the globe.
  EXPECT_EQ(get("/d/made/quantized-mesh/0/0/0.terrain").status, 200);
}

TEST_F(SiteTest, WhatIsNoTileOfAWebMapIsRefused) {
  for (const std::string path :
       {"xyz", "xyz/terrarium", "xyz/terrarium/1/0", "xyz/terrarium/1/0/0", "xyz/terrarium/1/0/0.webp",
        "xyz/terrarium/1/2/0.png", "xyz/terrarium/25/0/0.png", "xyz/terrarium/-1/0/0.png",
        "xyz/terrarium/1/0/0.png.png", "xyz/terrarium/99999999999999999999/0/0.png", "xyz/heights/1/0/0.png",
        "xyz/imagery/1/0/0.png", "xyz/imagery/other/1/0/0.png", "xyz/imagery.json", "xyz/imagery/other.json",
        "xyz/.json", "xyz/terrarium/.json", "xyz/terrarium/1/0/0/0.png", "xyz/terrarium/3/7/7.png"})
    EXPECT_EQ(get("/d/made/" + path).status, 404) << path;
  EXPECT_EQ(post("/d/made/xyz/terrarium/0/0/0.png", "{}").status, 405);
  HttpRequest hostile;
  hostile.host = "evil\"><script>";
  const Json tiles = json(get("/d/made/xyz/terrarium.json", hostile));
  EXPECT_EQ(tiles["tiles"][0].get<std::string>().find("evil"), std::string::npos);
  HttpRequest asked;
  for (const char* target : {"/d/made/xyz/terrarium/0/0/0.png", "/d/made/elevation?points=1,2"}) {
    asked.target = target;
    EXPECT_TRUE(site_->takesLong(asked)) << target;
  }
}

TEST_F(SiteTest, GivesTheViewerAndNothingElseOfItsFolder) {
  const fs::path folder = *folder_ / "viewer";
  fs::create_directories(folder / "assets");
  std::ofstream(*folder_ / "secret.txt") << "secret";
  std::ofstream(folder / "healthz") << "not this";
  SiteOptions options;
  options.datasets = {(*folder_ / "made.terrane").string()};
  options.viewerFolder = folder.string();
  Metrics metrics;
  const auto without = Site::open(options, metrics);
  ASSERT_FALSE(without.ok());
  EXPECT_NE(without.error().message.find("index.html"), std::string::npos) << without.error().message;

  std::ofstream(folder / "index.html") << "<!doctype html><title>made</title>";
  std::ofstream(folder / "assets" / "index-1a2b.js") << std::string(5000, ' ');
  std::ofstream(folder / "assets" / "engine.wasm") << "wasm";
  const auto opened = Site::open(options, metrics);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const auto ask = [&](std::string_view method, std::string_view target) {
    HttpRequest request;
    request.method = method;
    request.target = target;
    request.acceptEncoding = "gzip";
    return (*opened)->answer(request);
  };
  const HttpResponse page = ask("GET", "/?dataset=made");
  EXPECT_EQ(bodyOf(page), "<!doctype html><title>made</title>");
  EXPECT_EQ(field(page, "Cache-Control"), "no-cache");
  EXPECT_NE(field(page, "Content-Security-Policy").find("wasm-unsafe-eval"), std::string::npos);
  const HttpResponse script = ask("GET", "/assets/index-1a2b.js");
  EXPECT_EQ(script.status, 200);
  EXPECT_EQ(field(script, "Content-Encoding"), "gzip");
  EXPECT_EQ(field(script, "Content-Type"), "text/javascript; charset=utf-8");
  EXPECT_NE(field(script, "Cache-Control").find("immutable"), std::string::npos);
  EXPECT_EQ(field(ask("GET", "/assets/engine.wasm"), "Content-Type"), "application/wasm");
  EXPECT_EQ(ask("POST", "/assets/engine.wasm").status, 405);
  EXPECT_EQ(bodyOf(ask("GET", "/healthz")), "ok\n");
  EXPECT_EQ(ask("GET", "/datasets.json").status, 200);
  for (const char* target : {"/assets", "/assets/", "/assets/none.js", "/secret.txt", "/../secret.txt",
                             "/assets/../../secret.txt", "/%2e%2e/secret.txt", "/index.html/"})
    EXPECT_GE(ask("GET", target).status, 400) << target;
}

TEST_F(SiteTest, FilesAreThereUnderTheHashForeverAndWithoutItForNow) {
  for (const std::string& name :
       {std::string("manifest.json"), std::string("elevation.pmtiles"), std::string("imagery.pmtiles")}) {
    const HttpResponse fixed = get(*base_ + name), moving = get("/d/made/" + name);
    EXPECT_EQ(fixed.status, 200) << name;
    EXPECT_EQ(bodyOf(fixed), fileBytes(name)) << name;
    EXPECT_EQ(bodyOf(moving), fileBytes(name)) << name;
    EXPECT_NE(field(fixed, "Cache-Control").find("immutable"), std::string::npos);
    EXPECT_EQ(field(moving, "Cache-Control"), "no-cache");
    EXPECT_EQ(field(fixed, "ETag").front(), '"');
  }
  EXPECT_EQ(field(get(*base_ + "elevation.pmtiles"), "Accept-Ranges"), "bytes");
  // Another version is not this one.
  std::string other = *base_;
  other[10] = other[10] == '0' ? '1' : '0';
  const HttpResponse gone = get(other + "elevation.pmtiles");
  EXPECT_EQ(gone.status, 404);
  EXPECT_NE(bodyOf(gone).find("/d/made/manifest.json again"), std::string::npos);
}

TEST_F(SiteTest, RangesAndPreconditions) {
  const std::string target = *base_ + "elevation.pmtiles", whole = fileBytes("elevation.pmtiles");
  const std::string etag = field(get(target), "ETag");
  HttpRequest fields;
  fields.range = "bytes=7-106";
  HttpResponse part = get(target, fields);
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(bodyOf(part), whole.substr(7, 100));
  EXPECT_EQ(field(part, "Content-Range"), "bytes 7-106/" + std::to_string(whole.size()));
  fields.range = "bytes=-100";
  EXPECT_EQ(bodyOf(get(target, fields)), whole.substr(whole.size() - 100));
  fields.range = "bytes=99999999999999999999-";
  part = get(target, fields);
  EXPECT_EQ(part.status, 416);
  EXPECT_EQ(field(part, "Content-Range"), "bytes */" + std::to_string(whole.size()));
  fields.range = "bytes=0-1,5-6";
  EXPECT_EQ(get(target, fields).status, 200);

  // If-Range: the same file gives the part, another the whole; a date is no entity tag of ours.
  fields.range = "bytes=7-106";
  fields.ifRange = etag;
  EXPECT_EQ(get(target, fields).status, 206);
  for (const std::string& changed :
       {std::string("\"changed\""), "W/" + etag, std::string("Wed, 21 Oct 2015 07:28:00 GMT")}) {
    fields.ifRange = changed;
    EXPECT_EQ(get(target, fields).status, 200) << changed;
    EXPECT_EQ(get(target, fields).fileBytes, whole.size());
  }
  fields.method = "HEAD";
  fields.ifRange = {};
  EXPECT_EQ(get(target, fields).status, 200);
  EXPECT_TRUE(get(target, fields).headOnly);

  HttpRequest known;
  known.ifNoneMatch = etag;
  EXPECT_EQ(get(target, known).status, 304);
  EXPECT_EQ(field(get(target, known), "ETag"), etag);
  known.ifNoneMatch = "\"another\"";
  EXPECT_EQ(get(target, known).status, 200);
  HttpRequest must;
  must.ifMatch = "\"another\"";
  EXPECT_EQ(get(target, must).status, 412);
  must.ifMatch = etag;
  EXPECT_EQ(get(target, must).status, 200);
}

TEST_F(SiteTest, TextsAreCompressedWhereThatIsAccepted) {
  HttpRequest fields;
  fields.acceptEncoding = "gzip, br";
  const HttpResponse packed = get("/d/made/manifest.json", fields);
  EXPECT_EQ(field(packed, "Content-Encoding"), "gzip");
  EXPECT_EQ(field(packed, "Vary"), "Accept-Encoding");
  EXPECT_NE(field(packed, "ETag"), field(get("/d/made/manifest.json"), "ETag"));
  EXPECT_LT(packed.bodyBytes(), fileBytes("manifest.json").size());
  std::string out(1 << 20, '\0'), in = bodyOf(packed);
  z_stream stream{};
  ASSERT_EQ(inflateInit2(&stream, 31), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  ASSERT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  EXPECT_EQ(out, fileBytes("manifest.json"));
  fields.ifNoneMatch = "\"nothing\"";
  EXPECT_EQ(field(get(*base_ + "elevation.pmtiles", fields), "Content-Encoding"), "");
}

TEST_F(SiteTest, EveryStoredTileIsTheArchivesBytes) {
  const auto dataset = Dataset::open((*folder_ / "made.terrane").string());
  ASSERT_TRUE(dataset.ok());
  for (const bool imagery : {false, true}) {
    const auto ids = imagery ? dataset->imageryTiles(0) : dataset->elevationTiles();
    ASSERT_GT(ids.size(), 4U);
    for (const TileId id : ids) {
      const auto stored = imagery ? dataset->readImagery(0, id) : dataset->readElevation(id);
      const HttpResponse response =
          get(*base_ + (imagery ? "imagery/imagery/" : "elevation/") + toString(id));
      ASSERT_EQ(response.status, 200) << toString(id);
      ASSERT_EQ(bodyOf(response), std::string((*stored)->begin(), (*stored)->end())) << toString(id);
    }
  }
  // What the pyramid has and the archive does not; what no pyramid has; what is no address.
  const int finest = dataset->manifest().frame.finestLevel;
  const int last = (1 << finest) - 1;
  const TileId corner{finest, last, last};
  ASSERT_FALSE(dataset->readElevation(corner)->has_value());
  EXPECT_EQ(get(*base_ + "elevation/" + toString(corner)).status, 204);
  EXPECT_EQ(get(*base_ + "elevation/21/0/0").status, 404);
  EXPECT_EQ(get(*base_ + "elevation/1/2/0").status, 404);
  EXPECT_EQ(get(*base_ + "elevation/99999999999/0/0").status, 400);
  EXPECT_EQ(get(*base_ + "elevation/-1/0/0").status, 400);
  EXPECT_EQ(get(*base_ + "elevation/1/x/0").status, 400);
  EXPECT_EQ(get(*base_ + "imagery/absent/0/0/0").status, 404);
  EXPECT_EQ(get("/d/made/elevation/0/0/0").status, 404);
}

TEST_F(SiteTest, AnswersQuestionsAtFullResolution) {
  const auto dataset = Dataset::open((*folder_ / "made.terrane").string());
  ASSERT_TRUE(dataset.ok());
  const Frame& frame = dataset->manifest().frame;
  ElevationQuery query(*dataset);
  const std::vector<glm::dvec2> places = {
      {500000.0, 6700000.0}, {501234.5, 6699001.25}, {497000.0, 6702345.6}, {100.0, 100.0}};
  std::string list, array;
  for (const glm::dvec2 p : places) {
    list += fmt::format("{}{},{}", list.empty() ? "" : ";", p.x, p.y);
    array += fmt::format("{}[{},{}]", array.empty() ? "" : ",", p.x, p.y);
  }
  for (const HttpResponse& response :
       {get("/d/made/elevation?points=" + list), get(*base_ + "elevation?points=" + list),
        post("/d/made/elevation", "{\"points\":[" + array + "]}")}) {
    ASSERT_EQ(response.status, 200) << bodyOf(response);
    const Json answer = json(response);
    EXPECT_EQ(answer["maxErrorMeters"].get<double>(), dataset->manifest().maxErrorMeters);
    ASSERT_EQ(answer["heightsMeters"].size(), places.size());
    for (size_t i = 0; i + 1 < places.size(); ++i) {
      const auto expected = query.heightAt(glm::dvec2(frame.localFromCrs({places[i], 0.0})));
      EXPECT_NEAR(answer["heightsMeters"][i].get<double>(), **expected, 1e-9);
    }
    EXPECT_TRUE(answer["heightsMeters"][3].is_null());
  }
  // E 500000 N 6700000 in UTM 32 is 9 E on the central meridian.
  const Json here = json(get("/d/made/elevation?points=500000,6700000"));
  const Json geographic = json(get("/d/made/elevation?points=9,60.4362771947&crs=EPSG:4326"));
  EXPECT_NEAR(geographic["heightsMeters"][0].get<double>(), here["heightsMeters"][0].get<double>(), 0.01);
  EXPECT_TRUE(
      json(get("/d/made/elevation?points=60.4362771947,9&crs=EPSG:4326"))["heightsMeters"][0].is_null());
  // In any other CRS, east before north; its own code is as good as none.
  for (const char* place : {"500000,6700000&crs=EPSG:32632", "1001875.417139,8497517.365&crs=EPSG:3857"}) {
    const Json there = json(get(fmt::format("/d/made/elevation?points={}", place)));
    EXPECT_EQ(there["dataset"], "made");
    EXPECT_NEAR(there["heightsMeters"][0].get<double>(), here["heightsMeters"][0].get<double>(), 0.05)
        << place;
  }
  const HttpResponse refused = get("/d/made/elevation?points=1,2&crs=EPSG:999999");
  EXPECT_EQ(refused.status, 400);
  EXPECT_NE(bodyOf(refused).find("EPSG:999999 is not known"), std::string::npos) << bodyOf(refused);

  const Json profile =
      json(get("/d/made/profile?points=498000,6698000;502000,6698000;502000,6701000&samples=8"));
  // Beside the middle of a zone its projection shows 0.9996 of what there is.
  EXPECT_EQ(profile["measuredOn"], "ellipsoid");
  EXPECT_NEAR(profile["lengthMeters"].get<double>(), 7000.0 / 0.9996, 0.01);
  ASSERT_EQ(profile["distancesMeters"].size(), 8U);
  EXPECT_NEAR(profile["distancesMeters"][5].get<double>(), 5000.0 / 0.9996, 0.01);
  const auto corner = query.heightAt(glm::dvec2(frame.localFromCrs({502000.0, 6699000.0, 0.0})));
  EXPECT_NEAR(profile["heightsMeters"][5].get<double>(), **corner, 1e-9);

  const Json sight = json(get(
      "/d/made/line-of-sight?from=498000,6698000&to=502000,6701000;498010,6698010;1,1&eye=3000&target=3000"));
  ASSERT_EQ(sight["results"].size(), 3U);
  EXPECT_EQ(sight["results"][0]["visible"], true);
  EXPECT_NEAR(sight["results"][0]["distanceMeters"].get<double>(), 5000.0 / 0.9996, 0.01);
  EXPECT_GT(sight["results"][1]["clearanceMeters"].get<double>(), 2900.0);
  EXPECT_TRUE(sight["results"][2]["visible"].is_null());
  // Through a hill: against the surface, step by step.
  const Json low = json(get("/d/made/line-of-sight?from=497600,6697600&to=502400,6702400"));
  const Json& result = low["results"][0];
  double clearance = 1e9;
  for (int i = 1; i < 20000; ++i) {
    const double t = i / 20000.0;
    const auto h =
        query.heightAt(glm::dvec2(frame.localFromCrs({497600.0 + t * 4800.0, 6697600.0 + t * 4800.0, 0.0})));
    if (!h.ok() || !*h) continue;
    const double line =
        result["fromHeightMeters"].get<double>() * (1.0 - t) + result["toHeightMeters"].get<double>() * t;
    clearance = std::min(clearance, line - **h);
  }
  EXPECT_NEAR(result["clearanceMeters"].get<double>(), std::min(clearance, 0.0), 0.5);
  EXPECT_EQ(result["visible"].get<bool>(), clearance >= 0.0);
}

TEST_F(SiteTest, RefusesInWords) {
  const auto refuses = [](const HttpResponse& response, int status) {
    EXPECT_EQ(response.status, status) << bodyOf(response);
    EXPECT_GT(bodyOf(response).size(), 10U);
    EXPECT_EQ(field(response, "Cache-Control"), "no-store");
  };
  for (const char* path :
       {"/etc/passwd", "/d", "/d/", "/d/none/manifest.json", "/d/made", "/d/made/", "/d/made/manifest.json/",
        "/d/made/made.tif", "/d/made.terrane/manifest.json", "/d/made/manifest.json.part", "/favicon.ico",
        "/d/%252e%252e/made.tif", "/healthz/"})
    refuses(get(path), 404);
  for (const char* path : {"/d/made/../made.tif", "/d/made/%2e%2e/made.tif", "/d/made/..%2fmade.tif",
                           "/d/made/%00", "/d/made/elevation?points=1,2&points=3,4", "/d/made/elevation",
                           "/d/made/elevation?points=a", "/d/made/profile?points=1,2"})
    refuses(get(path), 400);
  refuses(post("/d/made/elevation", "{"), 400);
  refuses(post("/d/made/elevation?points=1,2", "{\"points\":[[1,2]]}"), 400);
  refuses(post("/d/made/elevation", "points=1,2", "application/x-www-form-urlencoded"), 415);
  refuses(get("/d/made/profile?points=1,2;3,4&samples=1000000"), 413);
  for (const char* method : {"PUT", "DELETE", "POST", "PATCH", "TRACE", "CONNECT", "get"}) {
    HttpRequest fields;
    fields.method = method;
    const HttpResponse response = get("/d/made/manifest.json", fields);
    refuses(response, 405);
    EXPECT_EQ(field(response, "Allow"), "GET, HEAD, OPTIONS");
  }
}

TEST_F(SiteTest, CorsOnlyWhereItWasAskedFor) {
  HttpRequest fields;
  fields.method = "OPTIONS";
  fields.origin = "https://example.org";
  EXPECT_EQ(field(get("/d/made/manifest.json", fields), "Access-Control-Allow-Origin"), "");

  SiteOptions options;
  options.datasets = {(*folder_ / "made.terrane").string()};
  for (const std::string& origin : {std::string("*"), std::string("https://example.org")}) {
    options.corsOrigin = origin;
    const auto site = Site::open(options, *metrics_);
    ASSERT_TRUE(site.ok());
    fields.method = "OPTIONS";
    fields.target = "/d/made/elevation.pmtiles";
    fields.origin = "https://example.org";
    HttpResponse response = (*site)->answer(fields);
    EXPECT_EQ(response.status, 204);
    EXPECT_EQ(field(response, "Access-Control-Allow-Origin"), origin);
    EXPECT_NE(field(response, "Access-Control-Allow-Headers").find("Range"), std::string::npos);
    fields.method = "GET";
    response = (*site)->answer(fields);
    for (const char* name : {"Content-Range", "ETag", "Accept-Ranges", "Content-Length"})
      EXPECT_NE(field(response, "Access-Control-Expose-Headers").find(name), std::string::npos);
    fields.origin = "https://elsewhere.org";
    EXPECT_EQ(field((*site)->answer(fields), "Access-Control-Allow-Origin"), origin == "*" ? "*" : "");
  }
}

TEST_F(SiteTest, SaysWhatCannotBeServed) {
  SiteOptions options;
  options.datasets = {(*folder_ / "absent.terrane").string()};
  auto site = Site::open(options, *metrics_);
  ASSERT_FALSE(site.ok());
  EXPECT_NE(site.error().message.find("absent.terrane"), std::string::npos);
  options.datasets = {(*folder_ / "made.terrane").string(), (*folder_ / "made.terrane").string()};
  site = Site::open(options, *metrics_);
  ASSERT_FALSE(site.ok());
  EXPECT_NE(site.error().message.find("rename"), std::string::npos);
}

}  // namespace
}  // namespace terrane::serve
