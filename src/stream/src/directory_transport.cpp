#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "file_range.h"
#include "terrane/stream/transport.h"

namespace terrane {
namespace {

/// One thread that reads what is asked for, in that order.
class DirectoryTransport final : public Transport {
 public:
  explicit DirectoryTransport(std::string directory)
      : directory_(std::move(directory)), thread_([this] { readInThread(); }) {}
  ~DirectoryTransport() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

  void start(uint64_t id, const FetchRequest& request) override {
    {
      const std::lock_guard lock(mutex_);
      queue_.emplace_back(id, request);
    }
    wake_.notify_one();
  }
  void cancel(uint64_t id) override {
    const std::lock_guard lock(mutex_);
    const auto isIt = [id](const auto& entry) { return entry.first == id; };
    queue_.erase(std::remove_if(queue_.begin(), queue_.end(), isIt), queue_.end());
    answers_.erase(std::remove_if(answers_.begin(), answers_.end(),
                                  [id](const FetchAnswer& answer) { return answer.id == id; }),
                   answers_.end());
    if (reading_ == id) reading_ = kNothing;
  }
  std::vector<FetchAnswer> poll(double) override {
    const std::lock_guard lock(mutex_);
    return std::exchange(answers_, {});
  }
  const std::string& where() const override { return directory_; }

 private:
  static constexpr uint64_t kNothing = UINT64_MAX;

  void readInThread() {
    std::unique_lock lock(mutex_);
    for (;;) {
      wake_.wait(lock, [this] { return stop_ || !queue_.empty(); });
      if (stop_) return;
      const auto [id, request] = std::move(queue_.front());
      queue_.pop_front();
      reading_ = id;
      lock.unlock();
      auto read = readFileRange(directory_, request);
      lock.lock();
      // Cancelled meanwhile: nobody waits for it.
      if (reading_ != id) continue;
      reading_ = kNothing;
      FetchAnswer answer{.id = id, .bytes = {}, .failure = std::nullopt};
      if (auto* failure = std::get_if<FetchFailure>(&read))
        answer.failure = std::move(*failure);
      else
        answer.bytes = std::move(std::get<0>(read));
      answers_.push_back(std::move(answer));
    }
  }

  std::string directory_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  uint64_t reading_ = kNothing;
  std::deque<std::pair<uint64_t, FetchRequest>> queue_;
  std::vector<FetchAnswer> answers_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Transport> openDirectoryTransport(const std::string& directory) {
  return std::make_unique<DirectoryTransport>(directory);
}

bool isUrl(const std::string& directoryOrUrl) {
  return directoryOrUrl.rfind("http://", 0) == 0 || directoryOrUrl.rfind("https://", 0) == 0;
}

std::unique_ptr<Transport> openTransport(const std::string& directoryOrUrl) {
  return isUrl(directoryOrUrl) ? openHttpTransport(directoryOrUrl) : openDirectoryTransport(directoryOrUrl);
}

}  // namespace terrane
