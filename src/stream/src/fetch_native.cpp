#include <curl/curl.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "terrane/stream/transport.h"

/// HTTP outside browsers: libcurl, all transfers in one thread.
namespace terrane {
namespace {

/// What the server says of the range that it sends: "bytes 100-199/5000".
struct ContentRange {
  uint64_t first = 0;
  uint64_t last = 0;
};
std::optional<ContentRange> parseContentRange(std::string_view value) {
  while (!value.empty() && value.front() == ' ') value.remove_prefix(1);
  if (value.substr(0, 6) != "bytes ") return std::nullopt;
  value.remove_prefix(6);
  ContentRange range;
  const char* end = value.data() + value.size();
  const auto first = std::from_chars(value.data(), end, range.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '-') return std::nullopt;
  const auto last = std::from_chars(first.ptr + 1, end, range.last);
  if (last.ec != std::errc()) return std::nullopt;
  return range;
}

/// One transfer under way.
struct Transfer {
  uint64_t id = 0;
  FetchRequest request;
  std::string url;
  CURL* handle = nullptr;
  curl_slist* headers = nullptr;
  std::vector<uint8_t> bytes;
  std::optional<ContentRange> range;
  bool tooLong = false;

  ~Transfer() {
    if (handle != nullptr) curl_easy_cleanup(handle);
    curl_slist_free_all(headers);
  }

  static size_t onBody(char* data, size_t, size_t count, void* self) {
    auto& transfer = *static_cast<Transfer*>(self);
    const uint64_t limit = transfer.request.bytes > 0 ? transfer.request.bytes : kLargestWholeFile;
    if (count > limit - transfer.bytes.size()) {
      // An error's text may be as long as it likes; it is not kept.
      long status = 0;
      curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
      if (status >= 400) return count;
      transfer.tooLong = true;
      return 0;
    }
    transfer.bytes.insert(transfer.bytes.end(), data, data + count);
    return count;
  }
  static size_t onHeader(char* data, size_t, size_t count, void* self) {
    constexpr std::string_view kName = "content-range:";
    std::string_view line(data, count);
    if (line.substr(0, 5) == "HTTP/") static_cast<Transfer*>(self)->range.reset();
    if (line.size() < kName.size()) return count;
    const bool isIt = std::equal(kName.begin(), kName.end(), line.begin(),
                                 [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b + 32 : b); });
    if (isIt) static_cast<Transfer*>(self)->range = parseContentRange(line.substr(kName.size()));
    return count;
  }
};

class HttpTransport final : public Transport {
 public:
  HttpTransport(std::string url, int connections, double stallSeconds)
      : url_(std::move(url)), stallSeconds_(stallSeconds) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    TERRANE_CHECK(started == CURLE_OK, "libcurl: {}", static_cast<int>(started));
    while (!url_.empty() && url_.back() == '/') url_.pop_back();
    multi_ = curl_multi_init();
    curl_multi_setopt(multi_, CURLMOPT_MAX_HOST_CONNECTIONS, static_cast<long>(connections));
    thread_ = std::thread([this] { transferInThread(); });
  }
  ~HttpTransport() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    curl_multi_wakeup(multi_);
    thread_.join();
    for (auto& [handle, transfer] : underway_) curl_multi_remove_handle(multi_, handle);
    underway_.clear();
    curl_multi_cleanup(multi_);
  }

  void start(uint64_t id, const FetchRequest& request) override {
    {
      const std::lock_guard lock(mutex_);
      toStart_.emplace_back(id, request);
    }
    curl_multi_wakeup(multi_);
  }
  void cancel(uint64_t id) override {
    {
      const std::lock_guard lock(mutex_);
      toCancel_.insert(id);
      answers_.erase(std::remove_if(answers_.begin(), answers_.end(),
                                    [id](const FetchAnswer& answer) { return answer.id == id; }),
                     answers_.end());
    }
    curl_multi_wakeup(multi_);
  }
  std::vector<FetchAnswer> poll(double) override {
    const std::lock_guard lock(mutex_);
    return std::exchange(answers_, {});
  }
  const std::string& where() const override { return url_; }

 private:
  void transferInThread() {
    for (;;) {
      {
        std::unique_lock lock(mutex_);
        if (stop_) return;
        const auto starting = std::exchange(toStart_, {});
        const auto cancelled = std::exchange(toCancel_, {});
        lock.unlock();
        for (const auto& [id, request] : starting)
          if (cancelled.count(id) == 0) begin(id, request);
        for (auto at = underway_.begin(); at != underway_.end();) {
          if (cancelled.count(at->second->id) == 0) {
            ++at;
            continue;
          }
          curl_multi_remove_handle(multi_, at->first);
          at = underway_.erase(at);
        }
      }
      int running = 0;
      curl_multi_perform(multi_, &running);
      int left = 0;
      while (CURLMsg* message = curl_multi_info_read(multi_, &left)) {
        if (message->msg == CURLMSG_DONE) finish(message->easy_handle, message->data.result);
      }
      curl_multi_poll(multi_, nullptr, 0, 1000, nullptr);
    }
  }

  void begin(uint64_t id, const FetchRequest& request) {
    auto transfer = std::make_unique<Transfer>();
    transfer->id = id;
    transfer->request = request;
    transfer->url = url_ + "/" + request.file;
    CURL* handle = curl_easy_init();
    transfer->handle = handle;
    curl_easy_setopt(handle, CURLOPT_URL, transfer->url.c_str());
    if (request.bytes > 0) {
      const std::string range =
          fmt::format("{}-{}", request.offset, request.offset + request.bytes - 1);
      curl_easy_setopt(handle, CURLOPT_RANGE, range.c_str());
      transfer->bytes.reserve(static_cast<size_t>(std::min<uint64_t>(request.bytes, 1U << 20)));
    }
    if (request.fresh) {
      transfer->headers = curl_slist_append(nullptr, "Cache-Control: no-cache");
      curl_easy_setopt(handle, CURLOPT_HTTPHEADER, transfer->headers);
    }
    curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, &Transfer::onBody);
    curl_easy_setopt(handle, CURLOPT_WRITEDATA, transfer.get());
    curl_easy_setopt(handle, CURLOPT_HEADERFUNCTION, &Transfer::onHeader);
    curl_easy_setopt(handle, CURLOPT_HEADERDATA, transfer.get());
    curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(handle, CURLOPT_FOLLOWLOCATION, 1L);
    curl_easy_setopt(handle, CURLOPT_MAXREDIRS, 5L);
    curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(handle, CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(handle, CURLOPT_USERAGENT, "terrane");
    curl_easy_setopt(handle, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_2TLS));
    curl_easy_setopt(handle, CURLOPT_PIPEWAIT, 1L);
    curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(stallSeconds_ * 1000.0));
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_TIME, std::max(1L, static_cast<long>(stallSeconds_)));
    curl_multi_add_handle(multi_, handle);
    underway_.emplace(handle, std::move(transfer));
  }

  void finish(CURL* handle, CURLcode code) {
    const auto at = underway_.find(handle);
    if (at == underway_.end()) return;
    curl_multi_remove_handle(multi_, handle);
    Transfer& transfer = *at->second;
    FetchAnswer answer{.id = transfer.id, .bytes = {}, .failure = judge(transfer, code)};
    if (!answer.failure) answer.bytes = std::move(transfer.bytes);
    underway_.erase(at);
    const std::lock_guard lock(mutex_);
    answers_.push_back(std::move(answer));
  }

  static std::optional<FetchFailure> judge(const Transfer& transfer, CURLcode code) {
    const FetchRequest& request = transfer.request;
    const auto failure = [&](FetchProblem problem, const std::string& why) {
      return FetchFailure{problem, fmt::format("{}: {}", transfer.url, why), 0.0};
    };
    long status = 0;
    curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
    if (code != CURLE_OK && !transfer.tooLong) {
      const bool isCut = code == CURLE_PARTIAL_FILE;
      return failure(isCut ? FetchProblem::Malformed : FetchProblem::Unreachable, curl_easy_strerror(code));
    }
    if (status == 429 || status == 408 || status >= 500) {
      FetchFailure busy = failure(FetchProblem::Busy, fmt::format("the server answers {}", status));
      curl_off_t after = 0;
      curl_easy_getinfo(transfer.handle, CURLINFO_RETRY_AFTER, &after);
      busy.retryAfterSeconds = static_cast<double>(std::clamp<curl_off_t>(after, 0, 120));
      return busy;
    }
    if (status >= 400) return failure(FetchProblem::Missing, fmt::format("the server answers {}", status));
    if (request.bytes == 0) {
      if (transfer.tooLong) return failure(FetchProblem::Malformed, "is too long");
      return std::nullopt;
    }
    // A server that knows no ranges sends the whole file, which is right only by chance.
    const bool isWhole = status == 200 && request.offset == 0 && !transfer.tooLong;
    const bool isRange = status == 206 && transfer.range && transfer.range->first == request.offset &&
                         transfer.range->last - transfer.range->first + 1 == request.bytes;
    if (!isWhole && !isRange)
      return failure(FetchProblem::Malformed,
                     status == 200 ? "the server sends whole files where ranges are asked for"
                                   : "the server sends another range than was asked for");
    if (transfer.bytes.size() != request.bytes)
      return failure(FetchProblem::Malformed,
                     fmt::format("has {} bytes, not {}", transfer.bytes.size(), request.bytes));
    return std::nullopt;
  }

  std::string url_;
  double stallSeconds_;
  CURLM* multi_ = nullptr;
  std::map<CURL*, std::unique_ptr<Transfer>> underway_;  ///< the thread's own

  std::mutex mutex_;
  bool stop_ = false;
  std::vector<std::pair<uint64_t, FetchRequest>> toStart_;
  std::set<uint64_t> toCancel_;
  std::vector<FetchAnswer> answers_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Transport> openHttpTransport(const std::string& url, int connections, double stallSeconds) {
  return std::make_unique<HttpTransport>(url, connections, stallSeconds);
}

}  // namespace terrane
