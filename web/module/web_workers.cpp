#include "web_workers.h"

#include <emscripten.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

// Makes the workers of `self` and tells it what they say, by terrane_worker_room() and then _ready(),
// _answered() or _failed(), until terrane_workers_end(). Returns how many there are.
// clang-format off
EM_JS(int, terrane_workers_begin, (void* self), {
  const workers = [];
  // Buffers go to and fro: making new ones would cost more than filling them.
  const buffers = [];
  Module["terraneWorkers"] = Module["terraneWorkers"] || new Map();
  Module["terraneWorkers"].set(self, { workers: workers, buffers: buffers });
  const take = (bytes) => {
    // note: making room may replace HEAPU8.
    const room = _terrane_worker_room(self, bytes.length);
    HEAPU8.set(bytes, room);
  };
  const fail = (index, why) => {
    if (workers[index] === null) return;
    workers[index].terminate();
    workers[index] = null;
    take(new TextEncoder().encode(String(why)));
    _terrane_worker_failed(self, index);
  };
  const count = Module["makeWorker"] ? Module["workerCount"] || 0 : 0;
  for (let index = 0; index < count; ++index) {
    let worker = null;
    // A page's rules may forbid them.
    try {
      worker = Module["makeWorker"]();
    } catch (error) {
      break;
    }
    workers.push(worker);
    worker.onmessage = (event) => {
      const told = event.data;
      if (workers[index] === null) return;
      if (told["problem"] !== undefined) return fail(index, told["problem"]);
      if (told["bytes"] === undefined) return _terrane_worker_ready(self, index);
      take(new Uint8Array(told["bytes"], 0, told["size"]));
      if (buffers.length < 2 * count) buffers.push(told["bytes"]);
      _terrane_worker_answered(self, index, told["serial"]);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      fail(index, event.message || "its script could not be loaded");
    };
    worker.onmessageerror = () => fail(index, "its answer could not be read");
    // It may have been ready before anybody listened.
    worker.postMessage({});
  }
  return workers.length;
});

EM_JS(void, terrane_workers_send, (void* self, int worker, uint32_t serial, uint32_t kind, const uint8_t* at, size_t size), {
  const all = Module["terraneWorkers"].get(self);
  const fitting = all.buffers.findIndex((buffer) => buffer.byteLength >= size);
  const bytes = fitting < 0 ? new ArrayBuffer(Math.max(size, 1 << 20)) : all.buffers.splice(fitting, 1)[0];
  new Uint8Array(bytes).set(HEAPU8.subarray(at, at + size));
  all.workers[worker].postMessage({ "serial": serial, "kind": kind, "bytes": bytes, "size": size }, [bytes]);
});

EM_JS(void, terrane_worker_end, (void* self, int worker), {
  const workers = Module["terraneWorkers"].get(self).workers;
  if (workers[worker] !== null) workers[worker].terminate();
  workers[worker] = null;
});

EM_JS(void, terrane_workers_end, (void* self), {
  Module["terraneWorkers"].get(self).workers.forEach((worker, index, workers) => {
    if (worker !== null) worker.terminate();
    workers[index] = null;
  });
  Module["terraneWorkers"].delete(self);
});
// clang-format on

namespace terrane {
namespace {

/// Orders that a worker has at once: one in work, one to go on with.
constexpr int kOrdersEach = 2;

}  // namespace

WebWorkers::WebWorkers() {
  workers_.resize(static_cast<size_t>(terrane_workers_begin(this)));
}
WebWorkers::~WebWorkers() {
  terrane_workers_end(this);
}

int WebWorkers::live() const {
  return static_cast<int>(
      std::count_if(workers_.begin(), workers_.end(), [](const Worker& worker) { return worker.ready; }));
}
int WebWorkers::width() const {
  return std::max(waiting_.width(), kOrdersEach * live());
}

void WebWorkers::submit(std::unique_ptr<Work> work) {
  waiting_.submit(std::move(work));
  send();
}

void WebWorkers::send() {
  while (!waiting_.isIdle()) {
    // To the one with the least to do.
    int idlest = -1;
    for (size_t i = 0; i < workers_.size(); ++i) {
      const Worker& worker = workers_[i];
      if (!worker.ready || worker.orders >= kOrdersEach) continue;
      if (idlest < 0 || worker.orders < workers_[static_cast<size_t>(idlest)].orders)
        idlest = static_cast<int>(i);
    }
    if (idlest < 0) return;
    Sent sent{idlest, waiting_.takeFirst()};
    packer_.clear();
    packer_.sendTo(&workers_[static_cast<size_t>(idlest)].sent);
    sent.work->pack(packer_);
    terrane_workers_send(this, idlest, ++lastSerial_, sent.work->kind(), packer_.bytes().data(),
                         packer_.bytes().size());
    ++workers_[static_cast<size_t>(idlest)].orders;
    sent_.emplace(lastSerial_, std::move(sent));
  }
}

int WebWorkers::work(double seconds) {
  return live() > 0 ? 0 : waiting_.work(seconds);
}

uint8_t* WebWorkers::room(size_t bytes) {
  room_.resize(bytes);
  return room_.data();
}

void WebWorkers::isReady(int worker) {
  workers_[static_cast<size_t>(worker)].ready = true;
  send();
}

void WebWorkers::hasAnswered(int worker, uint32_t serial) {
  const auto at = sent_.find(serial);
  if (at == sent_.end() || at->second.worker != worker)
    return letGo(worker, "it answered what it was not asked");
  if (const Status status = at->second.work->takeAnswer(room_); !status.ok())
    return letGo(worker, status.error().message);
  sent_.erase(at);
  --workers_[static_cast<size_t>(worker)].orders;
  send();
}

void WebWorkers::hasFailed(int worker) {
  letGo(worker, std::string(room_.begin(), room_.end()));
}

void WebWorkers::letGo(int worker, const std::string& why) {
  terrane_worker_end(this, worker);
  workers_[static_cast<size_t>(worker)] = {};
  // What it had comes first again, in its order.
  for (auto at = sent_.rbegin(); at != sent_.rend(); ++at)
    if (at->second.worker == worker) waiting_.putFirst(std::move(at->second.work));
  for (auto at = sent_.begin(); at != sent_.end();)
    at = at->second.worker == worker ? sent_.erase(at) : std::next(at);
  trouble_ = live() > 0 ? fmt::format("a worker failed: {}; the others go on", why)
                        : fmt::format("a worker failed: {}; decoding between frames instead", why);
  send();
}

}  // namespace terrane

// What terrane_workers_begin() calls.
extern "C" {
EMSCRIPTEN_KEEPALIVE uint8_t* terrane_worker_room(terrane::WebWorkers* self, size_t bytes) {
  return self->room(bytes);
}
EMSCRIPTEN_KEEPALIVE void terrane_worker_ready(terrane::WebWorkers* self, int worker) {
  self->isReady(worker);
}
EMSCRIPTEN_KEEPALIVE void terrane_worker_answered(terrane::WebWorkers* self, int worker, uint32_t serial) {
  self->hasAnswered(worker, serial);
}
EMSCRIPTEN_KEEPALIVE void terrane_worker_failed(terrane::WebWorkers* self, int worker) {
  self->hasFailed(worker);
}
}
