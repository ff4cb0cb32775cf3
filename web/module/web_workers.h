#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "terrane/stream/workers.h"

namespace terrane {

/// The page's Web Workers, which Module.makeWorker() makes, Module.workerCount of them: orders go to them as
/// bytes, and answers come back so, between two of the page's own turns (web/package/src/worker.ts). Each has
/// few orders at a time, so that what becomes urgent does not stand behind what was. Until the first of them
/// is ready, and where there are none, work is done between frames as SlicedWorkers does it.
///
/// A worker that fails is let go, and what it had is done again.
class WebWorkers final : public Workers {
 public:
  WebWorkers();
  /// Ends them.
  ~WebWorkers() override;
  WebWorkers(const WebWorkers&) = delete;
  WebWorkers& operator=(const WebWorkers&) = delete;

  void submit(std::unique_ptr<Work> work) override;
  int width() const override;

  /// Where no worker is ready, works for about `seconds`. Returns how many pieces were done.
  int work(double seconds);
  bool isIdle() const { return waiting_.isIdle() && sent_.empty(); }
  /// How many are ready.
  int live() const;
  /// What the last worker that failed died of; empty: none did.
  const std::string& trouble() const { return trouble_; }

  // What JavaScript tells.
  uint8_t* room(size_t bytes);
  void isReady(int worker);
  void hasAnswered(int worker, uint32_t serial);
  void hasFailed(int worker);

 private:
  struct Worker {
    bool ready = false;
    int orders = 0;  ///< that it has
    SentObjects sent;
  };
  struct Sent {
    int worker = 0;
    std::unique_ptr<Work> work;
  };
  void send();
  void letGo(int worker, const std::string& why);

  std::vector<Worker> workers_;
  SlicedWorkers waiting_;
  std::map<uint32_t, Sent> sent_;  ///< by serial
  uint32_t lastSerial_ = 0;
  Packer packer_;
  std::vector<uint8_t> room_;
  std::string trouble_;
};

}  // namespace terrane
