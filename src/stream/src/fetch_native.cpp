#include <curl/curl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <map>
#include <mutex>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "dataset_url.h"
#include "http_answer.h"
#include "terrane/stream/transport.h"

/// HTTP outside browsers: libcurl, all transfers in one thread.
namespace terrane {
namespace {

/// No server of files has more to say before the first byte.
constexpr size_t kLargestHead = 64U << 10;
/// Of the text that comes with an error; it is not kept.
constexpr size_t kLongestRefusal = 256U << 10;

bool isField(std::string_view line, std::string_view lowerCaseName) {
  return line.size() > lowerCaseName.size() && line[lowerCaseName.size()] == ':' &&
         std::equal(lowerCaseName.begin(), lowerCaseName.end(), line.begin(),
                    [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b + 32 : b); });
}
std::string_view fieldValue(std::string_view line) {
  line.remove_prefix(line.find(':') + 1);
  while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r' || line.back() == '\n'))
    line.remove_suffix(1);
  return line;
}

/// One transfer under way.
struct Transfer {
  uint64_t id = 0;
  FetchRequest request;
  CURL* handle = nullptr;
  curl_slist* headers = nullptr;
  std::array<char, CURL_ERROR_SIZE> words{};  ///< libcurl's, where it fails
  std::vector<uint8_t> bytes;
  HttpAnswer answer;
  size_t headBytes = 0;
  size_t refusalBytes = 0;

  ~Transfer() {
    if (handle != nullptr) curl_easy_cleanup(handle);
    curl_slist_free_all(headers);
  }

  bool isRange() const { return request.bytes > 0; }

  static size_t onBody(char* data, size_t, size_t count, void* self) {
    auto& transfer = *static_cast<Transfer*>(self);
    long status = 0;
    curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
    if (status >= 400) {
      transfer.refusalBytes += count;
      transfer.answer.isCutOff = transfer.refusalBytes > kLongestRefusal;
      return transfer.answer.isCutOff ? 0 : count;
    }
    // Never more than was asked for; and nothing of a file that comes whole where its middle was wanted.
    const uint64_t limit = transfer.isRange() ? transfer.request.bytes : kLargestWholeFile;
    const bool isOfNoUse = transfer.isRange() && status != 206 && transfer.request.offset > 0;
    if (isOfNoUse || count > limit - transfer.bytes.size()) {
      transfer.answer.isCutOff = true;
      return 0;
    }
    transfer.bytes.insert(transfer.bytes.end(), data, data + count);
    return count;
  }

  static size_t onHeader(char* data, size_t, size_t count, void* self) {
    auto& transfer = *static_cast<Transfer*>(self);
    HttpAnswer& answer = transfer.answer;
    const std::string_view line(data, count);
    transfer.headBytes += count;
    if (transfer.headBytes > kLargestHead) return 0;
    // A redirection's fields are not those of the file.
    if (line.substr(0, 5) == "HTTP/") answer = {};
    if (isField(line, "content-range")) answer.range = parseContentRange(fieldValue(line));
    if (isField(line, "etag")) answer.etag = fieldValue(line);
    if (isField(line, "last-modified")) answer.lastModified = fieldValue(line);
    if (isField(line, "content-encoding"))
      answer.isEncoded = transfer.isRange() && fieldValue(line) != "identity";
    return count;
  }
};

/// Why a transfer ended before its answer.
FetchFailure judgeBroken(const std::string& url, const Transfer& transfer, CURLcode code) {
  const char* words = transfer.words[0] != '\0' ? transfer.words.data() : curl_easy_strerror(code);
  const auto failure = [&](FetchProblem problem) {
    return FetchFailure{problem, fmt::format("{}: {}", url, words), 0.0};
  };
  switch (code) {
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_URL_MALFORMAT:
    case CURLE_UNSUPPORTED_PROTOCOL:
    case CURLE_TOO_MANY_REDIRECTS:
      return failure(FetchProblem::Fatal);
    case CURLE_PARTIAL_FILE:
    case CURLE_BAD_CONTENT_ENCODING:
    case CURLE_WRITE_ERROR:
      return failure(FetchProblem::Malformed);
    default:
      // note: one that breaks off in its middle may do so each time, and must not hold up the others for
      // ever.
      return failure(transfer.bytes.empty() ? FetchProblem::Unreachable : FetchProblem::Malformed);
  }
}

class HttpTransport final : public Transport {
 public:
  HttpTransport(const std::string& url, int connections, double stallSeconds)
      : url_(parseDatasetUrl(url)), stallSeconds_(stallSeconds) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    TERRANE_CHECK(started == CURLE_OK, "libcurl: {}", static_cast<int>(started));
    if (const char* file = std::getenv("CURL_CA_BUNDLE"); file != nullptr) certificates_ = file;
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
  void wait(double seconds) override {
    std::unique_lock lock(mutex_);
    answered_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return !answers_.empty(); });
  }
  const std::string& where() const override { return url_.shown; }

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
    CURL* handle = curl_easy_init();
    transfer->handle = handle;
    curl_easy_setopt(handle, CURLOPT_URL, url_.fileUrl(request.file).c_str());
    curl_easy_setopt(handle, CURLOPT_ERRORBUFFER, transfer->words.data());
    if (request.bytes > 0) {
      const std::string range = fmt::format("{}-{}", request.offset, request.offset + request.bytes - 1);
      curl_easy_setopt(handle, CURLOPT_RANGE, range.c_str());
      transfer->bytes.reserve(static_cast<size_t>(std::min<uint64_t>(request.bytes, 1U << 20)));
      // A compressed answer has no ranges.
      transfer->headers = curl_slist_append(transfer->headers, "Accept-Encoding: identity");
    } else {
      curl_easy_setopt(handle, CURLOPT_ACCEPT_ENCODING, "gzip");
    }
    if (request.fresh) transfer->headers = curl_slist_append(transfer->headers, "Cache-Control: no-cache");
    curl_easy_setopt(handle, CURLOPT_HTTPHEADER, transfer->headers);
    curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, &Transfer::onBody);
    curl_easy_setopt(handle, CURLOPT_WRITEDATA, transfer.get());
    curl_easy_setopt(handle, CURLOPT_HEADERFUNCTION, &Transfer::onHeader);
    curl_easy_setopt(handle, CURLOPT_HEADERDATA, transfer.get());
    curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(handle, CURLOPT_FOLLOWLOCATION, 1L);
    curl_easy_setopt(handle, CURLOPT_MAXREDIRS, 5L);
    curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
    // What was asked for in private is not fetched in public.
    const bool isPrivate = url_.folder.rfind("https:", 0) == 0;
    curl_easy_setopt(handle, CURLOPT_REDIR_PROTOCOLS_STR, isPrivate ? "https" : "http,https");
    curl_easy_setopt(handle, CURLOPT_SSL_VERIFYPEER, 1L);
    curl_easy_setopt(handle, CURLOPT_SSL_VERIFYHOST, 2L);
    if (!certificates_.empty()) curl_easy_setopt(handle, CURLOPT_CAINFO, certificates_.c_str());
    curl_easy_setopt(handle, CURLOPT_USERAGENT, "terrane");
    curl_easy_setopt(handle, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_2TLS));
    curl_easy_setopt(handle, CURLOPT_PIPEWAIT, 1L);
    curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(stallSeconds_ * 1000.0));
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(handle, CURLOPT_QUICK_EXIT, 1L);  // the end waits for no name server
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
    {
      const std::lock_guard lock(mutex_);
      answers_.push_back(std::move(answer));
    }
    answered_.notify_all();
  }

  std::optional<FetchFailure> judge(Transfer& transfer, CURLcode code) {
    const std::string shown = url_.shown + "/" + transfer.request.file;
    HttpAnswer& answer = transfer.answer;
    if (code != CURLE_OK && !answer.isCutOff) return judgeBroken(shown, transfer, code);
    long status = 0;
    curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
    curl_off_t after = 0;
    curl_easy_getinfo(transfer.handle, CURLINFO_RETRY_AFTER, &after);
    answer.status = static_cast<int>(status);
    answer.retryAfterSeconds = static_cast<double>(after);
    answer.bodyBytes = transfer.bytes.size();
    return judgeHttpAnswer(shown, transfer.request, answer, known_[transfer.request.file]);
  }

  DatasetUrl url_;
  double stallSeconds_;
  std::string certificates_;  ///< a file of those to trust; empty: the system's
  CURLM* multi_ = nullptr;
  std::map<CURL*, std::unique_ptr<Transfer>> underway_;  ///< the thread's own
  std::map<std::string, KnownFile> known_;               ///< the thread's own

  std::mutex mutex_;
  std::condition_variable answered_;
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
