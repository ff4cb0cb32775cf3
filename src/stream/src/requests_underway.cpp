#include "requests_underway.h"

#include <algorithm>
#include <utility>

namespace terrane {

void RequestsUnderway::start(Request request, const FetchRequest& fetch, double nowSeconds) {
  const uint64_t id = ++lastId_;
  request.started = nowSeconds;
  transport_.start(id, fetch);
  requests_.emplace(id, std::move(request));
}

std::optional<RequestsUnderway::Request> RequestsUnderway::finish(uint64_t id) {
  const auto at = requests_.find(id);
  if (at == requests_.end()) return std::nullopt;
  std::optional<Request> request = std::move(at->second);
  requests_.erase(at);
  return request;
}

std::vector<RequestsUnderway::Request> RequestsUnderway::cancel(
    const std::function<bool(const Request&)>& unwanted) {
  std::vector<Request> cancelled;
  for (auto at = requests_.begin(); at != requests_.end();) {
    if (!unwanted(at->second)) {
      ++at;
      continue;
    }
    transport_.cancel(at->first);
    cancelled.push_back(std::move(at->second));
    at = requests_.erase(at);
  }
  return cancelled;
}

uint64_t RequestsUnderway::bytes() const {
  uint64_t sum = 0;
  for (const auto& [id, request] : requests_) sum += request.plan.bytes;
  return sum;
}

bool RequestsUnderway::has(What what, int file, uint64_t offset) const {
  return std::any_of(requests_.begin(), requests_.end(), [&](const auto& entry) {
    const Request& request = entry.second;
    return request.what == what && request.plan.file == file && request.plan.offset == offset;
  });
}

}  // namespace terrane
