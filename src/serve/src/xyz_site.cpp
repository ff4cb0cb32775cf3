#include "xyz_site.h"

#include <fmt/format.h>

#include <algorithm>

#include "entity.h"
#include "quantized_mesh.h"
#include "site_pages.h"
#include "terrane/dataset/hash.h"
#include "terrane/serve/byte_range.h"
#include "xyz_tiles.h"

namespace terrane::serve {
namespace {

HttpResponse refuseXyz(int status, std::string words) {
  HttpResponse response = refuse(status, std::move(words));
  response.route = Route::Xyz;
  return response;
}

/// One kind of tile of a dataset.
struct XyzKind {
  std::optional<HeightColors> heights;
  std::optional<size_t> layer;  ///< of the manifest's imagery
  size_t segments = 0;          ///< of the path that name it
};

/// "terrarium", "terrain-rgb" or "imagery", LAYER; the last segment may end with ".json".
std::optional<XyzKind> kindOf(const ServedDataset& served, const std::vector<std::string>& path) {
  if (path.empty()) return {};
  if (path[0] == "terrarium") return XyzKind{HeightColors::Terrarium, {}, 1};
  if (path[0] == "terrain-rgb") return XyzKind{HeightColors::TerrainRgb, {}, 1};
  if (path[0] != "imagery" || path.size() < 2) return {};
  const auto& layers = served.dataset->manifest().imagery;
  for (size_t i = 0; i < layers.size(); ++i)
    if (layers[i].name == path[1]) return XyzKind{{}, i, 2};
  return {};
}

/// Takes an ending off; false where it is not there.
bool takeEnding(std::string& text, std::string_view ending) {
  if (text.size() <= ending.size() || text.compare(text.size() - ending.size(), ending.size(), ending) != 0)
    return false;
  text.resize(text.size() - ending.size());
  return true;
}

/// This server as the client named it; empty where that is no name of a host.
std::string baseOf(const HttpRequest& request) {
  const auto isHost = [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == ':' || c == '[' || c == ']' || c == '_';
  };
  if (request.host.empty() || !std::all_of(request.host.begin(), request.host.end(), isHost)) return {};
  return fmt::format("{}://{}", request.forwardedProto == "https" ? "https" : "http", request.host);
}

HttpResponse describe(const HttpRequest& request, const ServedDataset& served, const XyzKind& kind) {
  const Manifest& manifest = served.dataset->manifest();
  std::string tiles = kind.layer ? "imagery/" + manifest.imagery[*kind.layer].name
                      : *kind.heights == HeightColors::Terrarium ? "terrarium"
                                                                 : "terrain-rgb";
  const std::string url =
      fmt::format("{}/d/{}/{}/xyz/{}/{{z}}/{{x}}/{{y}}.{}", baseOf(request), escapeSegment(served.name),
                  served.hash, tiles, kind.layer ? "webp" : "png");
  const int finer = kind.layer ? manifest.imagery[*kind.layer].finestLevel - manifest.frame.finestLevel : 0;
  const std::string& attribution = kind.layer && !manifest.imagery[*kind.layer].attribution.empty()
                                       ? manifest.imagery[*kind.layer].attribution
                                       : manifest.attribution;
  const char* encoding = kind.layer ? "" : *kind.heights == HeightColors::Terrarium ? "terrarium" : "mapbox";
  std::string text = tileJson(manifest, *served.xyzExtent, served.xyzExtent->zoomFor(finer), url, served.name,
                              encoding, attribution);
  const std::string name = sha256(text).substr(0, 32);
  return answerText(request, Route::Xyz, makeTextEntity(std::move(text), name, "application/json"),
                    kRevalidate);
}

/// The same dataset and the same program give the same bytes: no need to make them to know that they are
/// known.
std::string etagNameOf(const ServedDataset& served, std::string_view kind,
                       const std::vector<std::string>& path) {
  return sha256(fmt::format("{} {} {} {}", TERRANE_VERSION, served.hash, kind, fmt::join(path, "/")))
      .substr(0, 32);
}

HttpResponse refuseUnreadable() {
  return refuseXyz(500, "The dataset's tiles cannot be read; its operator should run terrane verify.");
}
HttpResponse refuseUnmapped() {
  return refuseXyz(
      404, "This dataset's CRS cannot be laid out on a map of the earth; its own tiles have no such bounds.");
}

}  // namespace

HttpResponse answerXyz(const HttpRequest& request, const ServedDataset& served,
                       const std::vector<std::string>& path, bool isVersioned) {
  constexpr const char* kNothing =
      "There is nothing here; there are xyz/terrarium/Z/X/Y.png, xyz/terrain-rgb/Z/X/Y.png, "
      "xyz/imagery/LAYER/Z/X/Y.webp (or .png), and terrarium.json, terrain-rgb.json, imagery/LAYER.json "
      "(TileJSON).";
  std::vector<std::string> names = path;
  const bool isJson = !names.empty() && takeEnding(names.back(), ".json");
  const auto kind = kindOf(served, names);
  if (!kind || names.size() != kind->segments + (isJson ? 0 : 3)) return refuseXyz(404, kNothing);
  if (!served.xyzExtent) return refuseUnmapped();
  if (isJson) return describe(request, served, *kind);

  std::string& last = names.back();
  const bool isPng = takeEnding(last, ".png");
  if (!isPng && !(kind->layer && takeEnding(last, ".webp"))) return refuseXyz(404, kNothing);
  const size_t at = kind->segments;
  const auto address = readXyz(names[at], names[at + 1], last);
  if (!address)
    return refuseXyz(404, fmt::format("A tile is Z/X/Y: Z from 0 to {}, X and Y below 2^Z.", kDeepestXyz));

  TextEntity entity;
  entity.type = isPng ? "image/png" : "image/webp";
  entity.etag = fmt::format("\"{}\"", etagNameOf(served, "xyz", path));
  const std::string_view cache = isVersioned ? kImmutable : kRevalidate;
  if (matchesEtag(request.ifNoneMatch, entity.etag, true)) {
    entity.plain = std::make_shared<const std::string>();
    return answerText(request, Route::Xyz, entity, cache);
  }
  Result<std::optional<std::vector<uint8_t>>> made = std::optional<std::vector<uint8_t>>{};
  if (served.xyzExtent->meets(*address)) {
    made =
        kind->layer
            ? pictureTile(*address, isPng ? PictureFile::Png : PictureFile::Webp, *kind->layer,
                          *served.xyzExtent, served.dataset->manifest(), *served.pictures, *served.geographic)
            : heightTile(*address, *kind->heights, *served.xyzExtent, *served.tiles, *served.geographic);
  }
  if (!made.ok()) return refuseUnreadable();
  if (!*made) {
    // note: clients of web maps take 404, not 204, for "nothing here".
    HttpResponse response = refuseXyz(404, "The dataset has nothing in this tile.");
    if (isVersioned) response.add("Cache-Control", kImmutable);
    return response;
  }
  entity.plain = std::make_shared<const std::string>((*made)->begin(), (*made)->end());
  return answerText(request, Route::Xyz, entity, cache);
}

HttpResponse answerTerrain(const HttpRequest& request, const ServedDataset& served,
                           const std::vector<std::string>& path, bool isVersioned) {
  constexpr const char* kNothing =
      "There is nothing here; there are quantized-mesh/layer.json and quantized-mesh/Z/X/Y.terrain.";
  const bool isLayer = path.size() == 1 && path[0] == "layer.json";
  if (!isLayer && path.size() != 3) return refuseXyz(404, kNothing);
  if (!served.xyzExtent) return refuseUnmapped();
  if (isLayer) {
    // note: a path alone, which CesiumJS resolves against this file's address.
    std::string text = terrainLayerJson(served.dataset->manifest(), *served.xyzExtent,
                                        fmt::format("/d/{}/{}/quantized-mesh/{{z}}/{{x}}/{{y}}.terrain",
                                                    escapeSegment(served.name), served.hash));
    const std::string name = sha256(text).substr(0, 32);
    return answerText(request, Route::Xyz, makeTextEntity(std::move(text), name, "application/json"),
                      kRevalidate);
  }
  std::string row = path[2];
  if (!takeEnding(row, ".terrain")) return refuseXyz(404, kNothing);
  const auto address = readTerrainAddress(path[0], path[1], row);
  if (!address)
    return refuseXyz(
        404, fmt::format("A tile is Z/X/Y: Z from 0 to {}, X below 2^(Z + 1), Y below 2^Z.", kDeepestXyz));

  constexpr std::string_view kType = "application/vnd.quantized-mesh";
  const std::string name = etagNameOf(served, "quantized-mesh", path);
  const std::string_view cache = isVersioned ? kImmutable : kRevalidate;
  // As makeTextEntity() names them.
  TextEntity known;
  known.etag = fmt::format("\"{}\"", name);
  known.compressedEtag = fmt::format("\"{}-gzip\"", name);
  known.plain = known.compressed = std::make_shared<const std::string>();
  known.type = kType;
  const std::string& etag = acceptsGzip(request.acceptEncoding) ? known.compressedEtag : known.etag;
  if (matchesEtag(request.ifNoneMatch, etag, true)) return answerText(request, Route::Xyz, known, cache);
  auto made = terrainTile(*address, *served.xyzExtent, *served.tiles, *served.geographic);
  if (!made.ok()) return refuseUnreadable();
  return answerText(request, Route::Xyz, makeTextEntity(std::move(made).value(), name, kType), cache);
}

}  // namespace terrane::serve
