#include "terrane/serve/site.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "entity.h"
#include "query_request.h"
#include "served_dataset.h"
#include "site_pages.h"
#include "terrain_queries.h"
#include "terrane/dataset/hash.h"
#include "terrane/serve/request_target.h"
#include "viewer_files.h"
#include "xyz_site.h"

namespace terrane::serve {
namespace {

constexpr std::string_view kTextPlain = "text/plain; charset=utf-8";
constexpr std::string_view kXyz = "xyz";
constexpr std::string_view kTerrain = "quantized-mesh";

bool isReading(std::string_view method) {
  return method == "GET" || method == "HEAD";
}

HttpResponse refuseAs(Route route, int status, std::string words) {
  HttpResponse response = refuse(status, std::move(words));
  response.route = route;
  return response;
}

HttpResponse notAllowed(Route route, std::string_view allowed) {
  HttpResponse response = refuseAs(route, 405, fmt::format("Only {} here.", allowed));
  response.add("Allow", allowed);
  return response;
}

/// A number of a tile's address: digits alone, no more than fit.
std::optional<int32_t> readAddress(std::string_view text) {
  int32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size() || number < 0 || text.front() == '-')
    return {};
  return number;
}

/// The request as a route's handler sees it.
struct Call {
  const HttpRequest& request;
  const RequestTarget& target;
  size_t at = 0;  ///< segments that are read
  size_t left() const { return target.path.size() - at; }
  const std::string& segment(size_t i) const { return target.path[at + i]; }
};

}  // namespace

struct Site::State {
  std::vector<std::unique_ptr<ServedDataset>> datasets;
  ViewerFiles viewer;
  TextEntity page;  ///< where there is no viewer
  TextEntity list;
  std::string corsOrigin;
  Metrics* metrics = nullptr;
  QueryLimits limits;

  HttpResponse dispatch(const HttpRequest& request) const;
  HttpResponse outsideDatasets(const HttpRequest& request, const RequestTarget& target) const;
  HttpResponse inDataset(Call call, const ServedDataset& served) const;
  HttpResponse archive(const Call& call, const ServedArchive& archive, bool versioned) const;
  HttpResponse tile(const Call& call, const ServedDataset& served, const ServedArchive* layer) const;
  HttpResponse query(const Call& call, const ServedDataset& served, QueryKind kind, bool versioned) const;
  HttpResponse metricsText() const;
};

Site::Site(std::unique_ptr<State> state) : state_(std::move(state)) {}
Site::~Site() = default;

Result<std::unique_ptr<Site>> Site::open(const SiteOptions& options, Metrics& metrics) {
  auto state = std::make_unique<State>();
  state->corsOrigin = options.corsOrigin;
  state->metrics = &metrics;
  if (options.datasets.empty()) return makeError("there is no dataset to serve; name at least one directory");
  const uint64_t cacheBytes = options.cacheBytes / options.datasets.size();
  for (const std::string& directory : options.datasets) {
    TERRANE_ASSIGN(auto served, openServedDataset(directory, cacheBytes));
    for (const auto& other : state->datasets) {
      if (other->name == served->name)
        return makeError(
            "{}: another dataset that is served has the name {}, too; rename one of the directories",
            directory, served->name);
    }
    state->datasets.push_back(std::move(served));
  }
  if (!options.viewerFolder.empty()) {
    TERRANE_ASSIGN(state->viewer, ViewerFiles::read(options.viewerFolder));
  }
  const std::string list = datasetsJson(state->datasets), page = indexPage(state->datasets);
  state->list = makeTextEntity(list, sha256(list).substr(0, 32), "application/json");
  state->page = makeTextEntity(page, sha256(page).substr(0, 32), "text/html; charset=utf-8");
  return std::unique_ptr<Site>(new Site(std::move(state)));
}

std::vector<Site::Listed> Site::datasets() const {
  std::vector<Listed> out;
  for (const auto& served : state_->datasets)
    out.push_back({served->name, served->hash, "d/" + escapeSegment(served->name) + "/"});
  return out;
}

bool Site::takesLong(const HttpRequest& request) const {
  const std::string_view path = request.target.substr(0, request.target.find('?'));
  const std::string_view last = path.substr(path.rfind('/') + 1);
  const auto has = [&](std::string_view segment) { return path.find(segment) != std::string_view::npos; };
  return queryKind(last).has_value() || has("/xyz/") || has("/quantized-mesh/");
}

HttpResponse Site::answer(const HttpRequest& request) {
  HttpResponse response;
  if (request.method == "OPTIONS") {
    response.route = Route::Preflight;
    response.status = 204;
    response.add("Allow", "GET, HEAD, POST, OPTIONS");
  } else {
    response = state_->dispatch(request);
  }
  decorate(request, response);
  return response;
}

void Site::decorate(const HttpRequest& request, HttpResponse& response) const {
  response.headOnly = response.headOnly || request.method == "HEAD";
  response.add("X-Content-Type-Options", "nosniff");
  const std::string& origin = state_->corsOrigin;
  if (origin.empty()) return;
  if (origin != "*") response.add("Vary", "Origin");
  if (origin != "*" && request.origin != origin) return;
  response.add("Access-Control-Allow-Origin", origin);
  if (request.method == "OPTIONS") {
    response.add("Access-Control-Allow-Methods", "GET, HEAD, POST, OPTIONS");
    response.add("Access-Control-Allow-Headers", "Range, If-Range, If-Match, If-None-Match, Content-Type");
    response.add("Access-Control-Max-Age", "86400");
  } else {
    response.add("Access-Control-Expose-Headers",
                 "Accept-Ranges, Content-Encoding, Content-Length, Content-Range, ETag, Retry-After");
  }
}

HttpResponse Site::State::dispatch(const HttpRequest& request) const {
  auto target = readTarget(request.target);
  if (!target.ok()) return refuse(400, fmt::format("Bad request target: {}.", target.error().message));
  const std::vector<std::string>& path = target->path;

  if (path.size() < 2 || path[0] != "d") return outsideDatasets(request, *target);
  for (const auto& served : datasets) {
    if (served->name == path[1]) return inDataset({request, *target, 2}, *served);
  }
  return refuse(404, "There is no dataset of this name; /datasets.json lists those that there are.");
}

HttpResponse Site::State::outsideDatasets(const HttpRequest& request, const RequestTarget& target) const {
  std::string path;
  for (const std::string& segment : target.path) path += (path.empty() ? "" : "/") + segment;
  const Route route = path.empty()              ? Route::Page
                      : path == "datasets.json" ? Route::List
                      : path == "healthz"       ? Route::Health
                      : path == "metrics"       ? Route::Metrics
                                                : Route::Refused;
  const bool isSlashed = !path.empty() && target.trailingSlash;
  const bool isOurs = route == Route::List || route == Route::Health || route == Route::Metrics;
  std::optional<HttpResponse> file;
  if (!isSlashed && !isOurs) file = viewer.answer(request, path);
  if (isSlashed || (route == Route::Refused && !file))
    return refuse(404, "There is nothing here; /datasets.json lists what is served.");
  if (!isReading(request.method)) return notAllowed(file ? Route::Page : route, "GET, HEAD, OPTIONS");
  if (file) return *file;
  if (route == Route::List) return answerText(request, route, list, kRevalidate);
  if (route == Route::Metrics) return metricsText();
  if (route == Route::Page) {
    HttpResponse response = answerText(request, route, page, kRevalidate);
    response.add("Content-Security-Policy",
                 "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'");
    response.add("Referrer-Policy", "no-referrer");
    return response;
  }
  HttpResponse response;
  response.route = route;
  response.add("Content-Type", kTextPlain);
  response.add("Cache-Control", "no-store");
  response.text = "ok\n";
  return response;
}

HttpResponse Site::State::inDataset(Call call, const ServedDataset& served) const {
  // The hash may stand before what is asked for; what stands behind it never changes.
  bool versioned = false;
  const auto looksLikeHash = [](const std::string& text) {
    return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
  };
  if (call.left() > 0 && looksLikeHash(call.segment(0))) {
    if (call.segment(0) != served.hash) {
      return refuse(
          404,
          fmt::format("This is not the version of {0} that is served; ask for /d/{0}/manifest.json again.",
                      served.name));
    }
    versioned = true;
    ++call.at;
  }
  constexpr const char* kNothing =
      "There is nothing here; a dataset has manifest.json, its archives, elevation/LEVEL/COL/ROW, "
      "imagery/LAYER/LEVEL/COL/ROW, xyz/..., quantized-mesh/..., elevation?, profile? and line-of-sight?.";
  if (call.left() == 0 || call.target.trailingSlash) return refuse(404, kNothing);
  const std::string& first = call.segment(0);

  if (first == kXyz || first == kTerrain) {
    if (!isReading(call.request.method)) return notAllowed(Route::Xyz, "GET, HEAD, OPTIONS");
    const auto begin = call.target.path.begin() + static_cast<ptrdiff_t>(call.at) + 1;
    const std::vector<std::string> rest(begin, call.target.path.end());
    return first == kXyz ? answerXyz(call.request, served, rest, versioned)
                         : answerTerrain(call.request, served, rest, versioned);
  }
  if (call.left() == 1) {
    if (const auto kind = queryKind(first)) return query(call, served, *kind, versioned);
    const ServedArchive* file = served.findFile(first);
    if (first != "manifest.json" && file == nullptr) return refuse(404, kNothing);
    if (!isReading(call.request.method))
      return notAllowed(file ? Route::Archive : Route::Manifest, "GET, HEAD, OPTIONS");
    if (file != nullptr) return archive(call, *file, versioned);
    return answerText(call.request, Route::Manifest, served.manifestText,
                      versioned ? kImmutable : kRevalidate);
  }

  // Single tiles are under the hash alone: a tile without a version would mix with others in caches.
  const bool isElevation = first == "elevation" && call.left() == 4;
  const bool isImagery = first == "imagery" && call.left() == 5;
  if (!isElevation && !isImagery) return refuse(404, kNothing);
  if (!isReading(call.request.method)) return notAllowed(Route::Tile, "GET, HEAD, OPTIONS");
  if (!versioned)
    return refuseAs(Route::Tile, 404,
                    fmt::format("Single tiles are under the dataset's hash: /d/{}/HASH/...", served.name));
  const ServedArchive* layer = isElevation ? served.findElevation() : served.findImagery(call.segment(1));
  if (layer == nullptr)
    return refuseAs(Route::Tile, 404, "The dataset has no such layer; its manifest lists them.");
  call.at += isElevation ? 1 : 2;
  return tile(call, served, layer);
}

HttpResponse Site::State::archive(const Call& call, const ServedArchive& archive, bool versioned) const {
  return answerFile(call.request, Route::Archive,
                    {archive.file, 0, archive.bytes, archive.etag, "application/vnd.pmtiles",
                     versioned ? kImmutable : kRevalidate});
}

HttpResponse Site::State::tile(const Call& call, const ServedDataset& served,
                               const ServedArchive* layer) const {
  const auto level = readAddress(call.segment(0)), col = readAddress(call.segment(1)),
             row = readAddress(call.segment(2));
  if (!level || !col || !row)
    return refuseAs(Route::Tile, 400, "A tile is LEVEL/COL/ROW, three whole numbers.");
  const TileId id{*level, *col, *row};
  if (!id.valid() || id.level > layer->finestLevel)
    return refuseAs(Route::Tile, 404,
                    fmt::format("Levels are 0 to {}, columns and rows below 2^LEVEL.", layer->finestLevel));
  const auto place = layer->reader->find(id);
  if (!place) {
    // A tile of the pyramid that is not stored: void, or nothing but what its parent interpolates to.
    HttpResponse response;
    response.route = Route::Tile;
    response.status = 204;
    response.add("Cache-Control", kImmutable);
    return response;
  }
  const std::string etag = fmt::format("\"{:.16}-{}-{}-{}\"", served.hash, id.level, id.col, id.row);
  return answerFile(call.request, Route::Tile,
                    {layer->file, place->offset, place->bytes, etag, layer->tileType, kImmutable});
}

HttpResponse Site::State::query(const Call& call, const ServedDataset& served, QueryKind kind,
                                bool versioned) const {
  const HttpRequest& request = call.request;
  const bool isPost = request.method == "POST";
  if (!isReading(request.method) && !isPost) return notAllowed(Route::Query, "GET, HEAD, POST, OPTIONS");
  if (isPost && request.contentType.substr(0, request.contentType.find(';')) != "application/json")
    return refuseAs(Route::Query, 415, "Send a question as application/json.");
  if (isPost && !call.target.query.empty())
    return refuseAs(Route::Query, 400, "A POST has its parameters in the body, none in the URL.");
  const auto question =
      isPost ? readQueryJson(kind, request.body, limits) : readQuery(kind, call.target, limits);
  if (!question.value) return refuseAs(Route::Query, question.refusal.status, question.refusal.words + ".");
  const auto answered = answerQuery(*question.value, served.name, *served.tiles, *served.geographic, limits);
  if (!answered.ok())
    return refuseAs(Route::Query, 500,
                    "The dataset's tiles cannot be read; its operator should run terrane verify.");
  if (!answered->value)
    return refuseAs(Route::Query, answered->refusal.status, answered->refusal.words + ".");
  TextEntity entity =
      makeTextEntity(*answered->value, sha256(*answered->value).substr(0, 32), "application/json");
  return answerText(request, Route::Query, entity, versioned && !isPost ? kImmutable : kRevalidate);
}

HttpResponse Site::State::metricsText() const {
  HttpResponse response;
  response.route = Route::Metrics;
  response.add("Content-Type", "text/plain; version=0.0.4; charset=utf-8");
  response.add("Cache-Control", "no-store");
  response.text = metrics->text();
  const auto each = [&](const char* name, const char* type, const char* help, auto value) {
    response.text += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n", name, help, type);
    for (const auto& served : datasets) {
      std::string label;
      for (const char c : served->name) {
        if (c == '"' || c == '\\') label += '\\';
        label += c == '\n' ? ' ' : c;
      }
      response.text +=
          fmt::format("{}{{dataset=\"{}\"}} {}\n", name, label, value(served->tiles->statistics()));
    }
  };
  each("terrane_tile_cache_hits_total", "counter", "Decoded tiles found in memory.",
       [](const auto& s) { return s.hits; });
  each("terrane_tile_cache_misses_total", "counter", "Tiles that had to be decoded.",
       [](const auto& s) { return s.misses; });
  each("terrane_tile_cache_bytes", "gauge", "Decoded tiles in memory.",
       [](const auto& s) { return s.bytes; });
  return response;
}

}  // namespace terrane::serve
