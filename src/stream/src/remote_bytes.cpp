#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <utility>

#include "back_off.h"
#include "terrane/base/format_number.h"
#include "terrane/stream/open_dataset.h"
#include "terrane/stream/plan_requests.h"

namespace terrane {
namespace {

constexpr size_t kMostRequests = 12;
constexpr uint64_t kBytesARequest = 256U << 10;
/// Fetched along where nobody wants it, to save a request.
constexpr uint64_t kLargestGap = 16U << 10;
constexpr double kLongestTry = 5.0;

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Requests that belong together: all are answered, or one says why not.
class RemoteBytes final : public ByteSource {
 public:
  RemoteBytes(std::unique_ptr<Transport> transport, const RemoteOptions& options)
      : transport_(std::move(transport)), options_(options) {}

  const std::string& where() const override { return transport_->where(); }
  std::string where(const std::string& file) const override { return transport_->where() + "/" + file; }

  Result<std::string> readWhole(const std::string& file) override {
    const std::lock_guard lock(mutex_);
    TERRANE_ASSIGN(const auto bytes, fetch({FetchRequest{file, 0, 0, false, 0}}));
    return std::string(bytes[0].begin(), bytes[0].end());
  }

  Status open(const std::string& file, uint64_t bytes) override {
    const std::lock_guard lock(mutex_);
    sizes_[file] = bytes;
    return {};
  }

  Result<std::vector<std::vector<uint8_t>>> read(std::span<const FileRange> ranges) const override {
    const std::lock_guard lock(mutex_);
    std::vector<const std::string*> files;
    std::vector<FetchCandidate> candidates;
    for (const FileRange& range : ranges) {
      const auto known = std::find_if(files.begin(), files.end(),
                                      [&](const std::string* file) { return *file == range.file; });
      const auto index = static_cast<int>(known - files.begin());
      if (known == files.end()) files.push_back(&range.file);
      candidates.push_back({index, range.offset, range.bytes, 1.0, false});
    }
    RequestLimits limits;
    limits.bytes = UINT64_MAX;
    limits.requests = INT32_MAX;
    limits.bytesARequest = kBytesARequest;
    limits.largestGap = kLargestGap;
    const std::vector<PlannedRequest> plans = planRequests(candidates, limits);
    std::vector<FetchRequest> requests;
    for (const PlannedRequest& plan : plans) {
      const std::string& file = *files[static_cast<size_t>(plan.file)];
      requests.push_back({file, plan.offset, plan.bytes, false, sizes_.at(file)});
    }
    TERRANE_ASSIGN(const auto answers, fetch(requests));

    // To each range its own part.
    std::vector<std::vector<uint8_t>> out(ranges.size());
    for (size_t i = 0; i < plans.size(); ++i) {
      for (const size_t index : plans[i].candidates) {
        const auto begin =
            answers[i].begin() + static_cast<ptrdiff_t>(ranges[index].offset - plans[i].offset);
        out[index].assign(begin, begin + static_cast<ptrdiff_t>(ranges[index].bytes));
      }
    }
    return out;
  }

 private:
  struct Try {
    size_t index = 0;  ///< of the requests
    int failures = 0;
    int damages = 0;  ///< of these, damaged answers
    double notBefore = 0.0;
    bool fresh = false;
  };

  Result<std::vector<std::vector<uint8_t>>> fetch(const std::vector<FetchRequest>& requests) const {
    std::vector<std::vector<uint8_t>> out(requests.size());
    std::deque<Try> waiting;
    for (size_t i = 0; i < requests.size(); ++i) waiting.push_back({i, 0, 0, 0.0, false});
    std::map<uint64_t, Try> underway;
    lastAnswer_ = std::max(lastAnswer_, seconds());
    std::optional<Error> ended;
    hasGivenUp_ = false;
    while (!ended && !(waiting.empty() && underway.empty())) {
      startDue(requests, waiting, underway);
      transport_->wait(0.1);
      for (FetchAnswer& answer : transport_->poll(seconds())) {
        const auto at = underway.find(answer.id);
        if (at == underway.end() || ended) continue;
        Try again = at->second;
        underway.erase(at);
        if (!answer.failure) {
          lastAnswer_ = seconds();
          isOpen_ = true;
          offlineTries_ = 0;
          if (options_.received) options_.received(answer.bytes.size());
          out[again.index] = std::move(answer.bytes);
        } else if (const Status status = takeFailure(*answer.failure, again); status.ok()) {
          waiting.push_front(again);
        } else {
          ended = status.error();
        }
      }
    }
    for (const auto& [id, one] : underway) transport_->cancel(id);
    if (!ended) return out;

    // Where the line broke: how much of it is missing?
    uint64_t missing = 0, all = 0;
    for (size_t i = 0; i < requests.size(); ++i) {
      all += requests[i].bytes;
      if (out[i].empty()) missing += requests[i].bytes;
    }
    if (!hasGivenUp_ || all == 0) return *ended;
    return makeError("{}; {} of the {} asked for last are missing", ended->message, formatBytes(missing),
                     formatBytes(all));
  }

  void startDue(const std::vector<FetchRequest>& requests, std::deque<Try>& waiting,
                std::map<uint64_t, Try>& underway) const {
    const double now = seconds();
    // While nobody is there, one request at a time finds out.
    const size_t most = offlineTries_ > 0 ? 1 : kMostRequests;
    if (offlineTries_ > 0 && now < offlineUntil_) return;
    for (auto at = waiting.begin(); at != waiting.end() && underway.size() < most;) {
      if (now < at->notBefore) {
        ++at;
        continue;
      }
      FetchRequest request = requests[at->index];
      request.fresh = at->fresh;
      transport_->start(++lastId_, request);
      underway.emplace(lastId_, *at);
      at = waiting.erase(at);
    }
  }

  /// Is there any use in another try? Says when.
  Status takeFailure(const FetchFailure& failure, Try& again) const {
    const double now = seconds();
    switch (failure.problem) {
      case FetchProblem::Fatal:
        return Error{failure.message};
      case FetchProblem::Missing:
        if (isOpen_) return Error{failure.message};
        return makeError("{}; is this a dataset's address? terrane serve lists its own at /",
                         failure.message);
      case FetchProblem::Unreachable: {
        const double patience = isOpen_ ? options_.patienceSeconds : options_.openingSeconds;
        if (now - lastAnswer_ >= patience) {
          hasGivenUp_ = true;
          return makeError("{}; nobody has answered for {:.0f} s", failure.message, now - lastAnswer_);
        }
        if (offlineTries_++ == 0 && options_.trouble) options_.trouble(failure.message + "; asking again");
        offlineUntil_ = now + std::min(kLongestTry, backOff(offlineTries_, lastId_));
        return {};
      }
      case FetchProblem::Busy:
      case FetchProblem::Malformed:
        break;
    }
    lastAnswer_ = now;
    offlineTries_ = 0;
    const bool isBusy = failure.problem == FetchProblem::Busy;
    if (!isBusy) ++again.damages;
    if (++again.failures >= kMostBusy || again.damages >= kMostDamaged)
      return makeError("{}, {} times", failure.message, again.failures);
    again.fresh = !isBusy;
    again.notBefore = now + std::max(failure.retryAfterSeconds, backOff(again.failures, lastId_));
    return {};
  }

  std::unique_ptr<Transport> transport_;
  RemoteOptions options_;
  std::map<std::string, uint64_t> sizes_;

  mutable std::mutex mutex_;  ///< the transport is one thread's at a time
  mutable uint64_t lastId_ = 0;
  mutable bool isOpen_ = false;  ///< there was an answer
  mutable bool hasGivenUp_ = false;
  mutable int offlineTries_ = 0;
  mutable double offlineUntil_ = 0.0;
  mutable double lastAnswer_ = 0.0;
};

}  // namespace

std::unique_ptr<ByteSource> openRemoteBytes(std::unique_ptr<Transport> transport,
                                            const RemoteOptions& options) {
  return std::make_unique<RemoteBytes>(std::move(transport), options);
}

Result<Dataset> openDataset(const std::string& directoryOrUrl, const RemoteOptions& options) {
  if (!isUrl(directoryOrUrl)) return Dataset::open(directoryOrUrl);
  return Dataset::open(openRemoteBytes(openTransport(directoryOrUrl), options));
}

}  // namespace terrane
