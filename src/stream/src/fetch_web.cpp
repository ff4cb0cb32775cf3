#include <emscripten.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <string_view>
#include <utility>

#include "dataset_url.h"
#include "http_answer.h"
#include "terrane/stream/transport.h"

/// HTTP in browsers: their fetch(), which they call back from between two of the page's own turns.

// Begins a request and tells the transport `self` of what comes, by terrane_fetch_head(), _room() and _end(),
// until terrane_fetch_stop(). `range`: "bytes=0-99", or empty for all. `cache` is fetch()'s own word. What
// the page has asked for before the engine was there (EngineOptions.early of web/package/src/engine.ts) is
// taken from there, once.
// clang-format off
EM_JS(void, terrane_fetch_start, (void* self, uint32_t serial, const char* url, const char* range, const char* cache,
                                  double stallSeconds), {
  const requests = Module["terraneRequests"] = Module["terraneRequests"] || new Map();
  const controller = new AbortController();
  requests.set(serial, controller);
  const isWanted = () => requests.get(serial) === controller;
  // How it ended: 0 whole, 1 cut off by us, 2 broken off, 3 stood still.
  const end = (how) => {
    clearTimeout(timer);
    if (!isWanted()) return;
    requests.delete(serial);
    controller.abort();
    _terrane_fetch_end(self, serial, how, tookSeconds);
  };
  let tookSeconds = NaN;
  let timer = 0;
  const moved = () => {
    clearTimeout(timer);
    timer = setTimeout(() => end(3), stallSeconds * 1000);
  };
  moved();

  // The fields that decide whether the bytes can be used; which of them a page may see is the server to say.
  const head = (status, fields, isForeign) => {
    let text = "";
    ["content-range", "etag", "last-modified", "content-encoding"].forEach((name) => {
      const value = fields.get(name);
      if (value !== null) text += name + ":" + value + "\n";
    });
    const after = fields.get("retry-after");
    const seconds = after === null ? 0 : isNaN(after) ? (Date.parse(after) - Date.now()) / 1000 : Number(after);
    const bytes = new TextEncoder().encode(text);
    const at = _terrane_fetch_head(self, serial, status, seconds || 0, isForeign, bytes.length);
    HEAPU8.set(bytes, at);
  };
  // Is more wanted?
  const give = (bytes) => {
    const at = bytes.length > 0 ? _terrane_fetch_room(self, serial, bytes.length) : 1;
    if (bytes.length > 0 && at !== 0) HEAPU8.set(bytes, at);
    return at !== 0;
  };
  const takeEarly = (answer) => {
    tookSeconds = answer["seconds"];
    head(answer["status"], answer["headers"], false);
    end(give(answer["bytes"]) ? 0 : 1);
  };
  const take = (response) => {
    moved();
    head(response.status, response.headers, response.type === "cors");
    if (response.body === null) return end(0);
    const reader = response.body.getReader();
    const next = () => reader.read().then((part) => {
      if (!isWanted()) return;
      moved();
      if (part.done) return end(0);
      return give(part.value) ? next() : end(1);
    });
    return next();
  };

  const options = { "headers": {}, "signal": controller.signal, "cache": UTF8ToString(cache) };
  if (HEAPU8[range]) options["headers"]["Range"] = UTF8ToString(range);
  const address = UTF8ToString(url);
  const ask = () => fetch(address, options).then((response) => isWanted() && take(response));
  const early = Module["early"];
  const promised = early && options["cache"] === "no-cache" ? early.get(address) : undefined;
  if (promised) early.delete(address);
  (promised ? promised.then((answer) => isWanted() && (answer === null ? ask() : takeEarly(answer))) : ask()).catch(() => end(2));
});

EM_JS(void, terrane_fetch_stop, (uint32_t serial), {
  const requests = Module["terraneRequests"];
  const controller = requests.get(serial);
  requests.delete(serial);
  if (controller) controller.abort();
});
// clang-format on

namespace terrane {
namespace {

/// Browsers let no more of them run to one server, where it speaks HTTP/1.1: the others would only seem to
/// stand still.
constexpr int kMostConnections = 6;

enum class End { Whole = 0, CutOff = 1, Broken = 2, Stalled = 3 };

/// One request under way.
struct Transfer {
  uint64_t id = 0;
  FetchRequest request;
  std::string head;  ///< "name:value" lines
  bool isForeign = false;
  HttpAnswer answer;
  std::vector<uint8_t> bytes;

  bool isRange() const { return request.bytes > 0; }
};

/// The value of a field in a head; empty where it is not told.
std::string_view field(std::string_view head, std::string_view name) {
  while (!head.empty()) {
    const std::string_view line = head.substr(0, head.find('\n'));
    head.remove_prefix(std::min(head.size(), line.size() + 1));
    if (line.size() > name.size() && line.substr(0, name.size()) == name && line[name.size()] == ':')
      return line.substr(name.size() + 1);
  }
  return {};
}

}  // namespace

class WebTransport final : public Transport {
 public:
  WebTransport(const std::string& url, int connections, double stallSeconds)
      : url_(parseDatasetUrl(url)),
        connections_(std::clamp(connections, 1, kMostConnections)),
        stallSeconds_(stallSeconds) {}
  ~WebTransport() override {
    for (const auto& [serial, transfer] : underway_) terrane_fetch_stop(serial);
  }

  void start(uint64_t id, const FetchRequest& request) override {
    waiting_.emplace_back(id, request);
    startWaiting();
  }

  void cancel(uint64_t id) override {
    waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(),
                                  [id](const auto& entry) { return entry.first == id; }),
                   waiting_.end());
    answers_.erase(std::remove_if(answers_.begin(), answers_.end(),
                                  [id](const FetchAnswer& answer) { return answer.id == id; }),
                   answers_.end());
    for (auto at = underway_.begin(); at != underway_.end(); ++at) {
      if (at->second.id != id) continue;
      terrane_fetch_stop(at->first);
      underway_.erase(at);
      break;
    }
    startWaiting();
  }

  std::vector<FetchAnswer> poll(double) override { return std::exchange(answers_, {}); }
  const std::string& where() const override { return url_.shown; }

  // What the browser tells.

  /// The answer begins. Returns where the bytes of its fields go, before anything else is told.
  char* onHead(uint32_t serial, int status, double retryAfterSeconds, bool isForeign, size_t bytes) {
    Transfer& transfer = underway_.at(serial);
    transfer.answer.status = status;
    transfer.answer.retryAfterSeconds = retryAfterSeconds;
    transfer.isForeign = isForeign;
    transfer.head.resize(bytes);
    return transfer.head.data();
  }

  /// Returns where some more bytes go; null: they are not wanted, and none after them.
  uint8_t* onBytes(uint32_t serial, size_t count) {
    Transfer& transfer = underway_.at(serial);
    // Never more than was asked for; nothing of an error's text, nor of a file that comes whole where its
    // middle was wanted.
    const uint64_t limit = transfer.isRange() ? transfer.request.bytes : kLargestWholeFile;
    const int status = transfer.answer.status;
    const bool isOfNoUse =
        status >= 400 || (transfer.isRange() && status != 206 && transfer.request.offset > 0);
    if (isOfNoUse || count > limit - transfer.bytes.size()) {
      transfer.answer.isCutOff = true;
      return nullptr;
    }
    const size_t before = transfer.bytes.size();
    transfer.bytes.resize(before + count);
    return transfer.bytes.data() + before;
  }

  void onEnd(uint32_t serial, End end, double tookSeconds) {
    const auto at = underway_.find(serial);
    Transfer transfer = std::move(at->second);
    underway_.erase(at);
    FetchAnswer answer{.id = transfer.id, .bytes = {}, .failure = judge(transfer, end)};
    if (!answer.failure) answer.bytes = std::move(transfer.bytes);
    if (tookSeconds >= 0.0) answer.tookSeconds = tookSeconds;
    answers_.push_back(std::move(answer));
    startWaiting();
  }

 private:
  void startWaiting() {
    while (!waiting_.empty() && static_cast<int>(underway_.size()) < connections_) {
      const auto [id, request] = std::move(waiting_.front());
      waiting_.pop_front();
      static uint32_t lastSerial = 0;
      const uint32_t serial = ++lastSerial;
      Transfer transfer;
      transfer.id = id;
      transfer.request = request;
      underway_.emplace(serial, std::move(transfer));
      const std::string range =
          request.bytes > 0 ? fmt::format("bytes={}-{}", request.offset, request.offset + request.bytes - 1)
                            : "";
      // A manifest that the browser remembers may be that of another build: the server is asked whether it
      // is.
      const char* cache = request.fresh ? "reload" : request.bytes == 0 ? "no-cache" : "default";
      terrane_fetch_start(this, serial, url_.fileUrl(request.file).c_str(), range.c_str(), cache,
                          stallSeconds_);
    }
  }

  std::optional<FetchFailure> judge(Transfer& transfer, End end) {
    const std::string shown = url_.shown + "/" + transfer.request.file;
    HttpAnswer& answer = transfer.answer;
    if (end == End::Broken || end == End::Stalled) {
      // note: one that breaks off in its middle may do so each time, and must not hold up the others for
      // ever.
      const bool isBegun = !transfer.bytes.empty();
      const std::string why = end == End::Stalled ? fmt::format("nothing has come for {} s", stallSeconds_)
                              : isBegun
                                  ? std::string("broke off")
                                  : std::string(
                                        "no answer: no connection, or the server does not let pages of this "
                                        "site read it (CORS)");
      return FetchFailure{isBegun ? FetchProblem::Malformed : FetchProblem::Unreachable,
                          fmt::format("{}: {}", shown, why), 0.0};
    }
    const std::string_view range = field(transfer.head, "content-range");
    answer.range = parseContentRange(range);
    // note: to pages of other sites many servers do not show which range they send; its length must do.
    if (range.empty() && transfer.isForeign && answer.status == 206)
      answer.range =
          ContentRange{transfer.request.offset, transfer.request.offset + transfer.request.bytes - 1, {}};
    answer.etag = field(transfer.head, "etag");
    answer.lastModified = field(transfer.head, "last-modified");
    const std::string_view encoding = field(transfer.head, "content-encoding");
    answer.isEncoded = transfer.isRange() && !encoding.empty() && encoding != "identity";
    answer.bodyBytes = transfer.bytes.size();
    return judgeHttpAnswer(shown, transfer.request, answer, known_[transfer.request.file]);
  }

  DatasetUrl url_;
  int connections_;
  double stallSeconds_;
  std::deque<std::pair<uint64_t, FetchRequest>> waiting_;
  std::map<uint32_t, Transfer> underway_;  ///< by a number that no other request of the page has
  std::map<std::string, KnownFile> known_;
  std::vector<FetchAnswer> answers_;
};

std::unique_ptr<Transport> openHttpTransport(const std::string& url, int connections, double stallSeconds) {
  return std::make_unique<WebTransport>(url, connections, stallSeconds);
}

}  // namespace terrane

extern "C" {

EMSCRIPTEN_KEEPALIVE char* terrane_fetch_head(terrane::WebTransport* self, uint32_t serial, int status,
                                              double retryAfterSeconds, int isForeign, size_t bytes) {
  return self->onHead(serial, status, retryAfterSeconds, isForeign != 0, bytes);
}
EMSCRIPTEN_KEEPALIVE uint8_t* terrane_fetch_room(terrane::WebTransport* self, uint32_t serial, size_t bytes) {
  return self->onBytes(serial, bytes);
}
EMSCRIPTEN_KEEPALIVE void terrane_fetch_end(terrane::WebTransport* self, uint32_t serial, int how,
                                            double tookSeconds) {
  self->onEnd(serial, static_cast<terrane::End>(how), tookSeconds);
}
}
