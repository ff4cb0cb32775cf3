#include "terrane/stream/plan_requests.h"

#include <algorithm>
#include <numeric>

namespace terrane {

std::vector<PlannedRequest> planRequests(std::span<const FetchCandidate> candidates,
                                         const RequestLimits& limits) {
  std::vector<size_t> byPlace(candidates.size());
  std::iota(byPlace.begin(), byPlace.end(), size_t{0});
  std::sort(byPlace.begin(), byPlace.end(), [&](size_t a, size_t b) {
    const FetchCandidate &first = candidates[a], &second = candidates[b];
    return first.file != second.file ? first.file < second.file : first.offset < second.offset;
  });
  std::vector<size_t> rank(candidates.size());
  for (size_t i = 0; i < byPlace.size(); ++i) rank[byPlace[i]] = i;

  std::vector<PlannedRequest> out;
  std::vector<bool> taken(candidates.size(), false);
  uint64_t bytes = 0;
  for (size_t next = 0; next < candidates.size(); ++next) {
    if (taken[next] || candidates[next].along) continue;
    if (static_cast<int>(out.size()) >= limits.requests || (!out.empty() && bytes >= limits.bytes)) break;
    const FetchCandidate& first = candidates[next];
    taken[next] = true;
    uint64_t begin = first.offset;
    uint64_t end = first.offset + first.bytes;

    // Grow to both sides while a wanted neighbour is near enough, worth it, and the request not too long.
    const auto mayJoin = [&](size_t index) {
      const FetchCandidate& other = candidates[index];
      if (taken[index] || other.alone || first.alone || other.file != first.file) return false;
      const uint64_t otherEnd = other.offset + other.bytes;
      const uint64_t gap = other.offset >= end ? other.offset - end
                           : begin >= otherEnd ? begin - otherEnd
                                               : 0;
      const uint64_t together = std::max(end, otherEnd) - std::min(begin, other.offset);
      return gap <= limits.largestGap && together <= limits.bytesARequest &&
             (together <= limits.easyBytes || other.worthPerByte >= limits.leastShare * first.worthPerByte);
    };
    PlannedRequest request{first.file, 0, 0, {next}};
    size_t low = rank[next], high = rank[next];
    for (bool grew = true; grew;) {
      grew = false;
      for (const bool up : {true, false}) {
        if (up ? high + 1 >= byPlace.size() : low == 0) continue;
        const size_t index = byPlace[up ? high + 1 : low - 1];
        if (!mayJoin(index)) continue;
        (up ? ++high : --low);
        taken[index] = true;
        request.candidates.push_back(index);
        begin = std::min(begin, candidates[index].offset);
        end = std::max(end, candidates[index].offset + candidates[index].bytes);
        grew = true;
      }
    }
    const bool mayWait = std::all_of(request.candidates.begin(), request.candidates.end(),
                                     [&](size_t index) { return candidates[index].mayWait; });
    if (mayWait && end - begin < limits.worthStarting) continue;
    std::sort(request.candidates.begin(), request.candidates.end(),
              [&](size_t a, size_t b) { return candidates[a].offset < candidates[b].offset; });
    request.offset = begin;
    request.bytes = end - begin;
    bytes += request.bytes;
    out.push_back(std::move(request));
  }
  return out;
}

}  // namespace terrane
