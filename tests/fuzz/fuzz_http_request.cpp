#include <cmath>
#include <cstdint>
#include <string_view>

#include "query_request.h"
#include "terrane/base/check.h"
#include "terrane/serve/byte_range.h"
#include "terrane/serve/request_target.h"

/// What is read from a request behind its framing: the first byte chooses. Accepted ranges lie inside,
/// accepted paths have no way up, accepted questions are finite and within their limits.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  using namespace terrane::serve;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto check = [](const QueryResult<QueryRequest>& found) {
    const QueryLimits limits;
    if (!found.value) {
      TERRANE_CHECK(!found.refusal.words.empty() &&
                    (found.refusal.status == 400 || found.refusal.status == 413));
      return;
    }
    const QueryRequest& query = *found.value;
    TERRANE_CHECK(!query.points.empty() && query.points.size() <= limits.points &&
                  query.samples <= limits.samples);
    for (const glm::dvec2 p : query.points) TERRANE_CHECK(std::isfinite(p.x) && std::isfinite(p.y));
    TERRANE_CHECK(std::isfinite(query.from.x) && std::isfinite(query.from.y));
    TERRANE_CHECK(query.eyeMeters >= 0.0 && query.targetMeters >= 0.0 && query.refraction < 1.0);
  };
  const auto kind = static_cast<QueryKind>(data[0] % 3);
  switch (data[0] / 3 % 4) {
    case 0:
      for (const uint64_t bytes : {uint64_t{0}, uint64_t{1}, uint64_t{1000}, ~uint64_t{0}}) {
        const RangeAnswer range = readRange(text, bytes);
        if (range.kind != RangeAnswer::Kind::Part) continue;
        TERRANE_CHECK(range.length > 0 && range.offset < bytes && range.length <= bytes - range.offset);
      }
      matchesEtag(text, "\"0123\"", (data[0] & 1) != 0);
      acceptsGzip(text);
      break;
    case 1: {
      const auto target = readTarget(text);
      if (!target.ok()) break;
      for (const std::string& segment : target->path) {
        TERRANE_CHECK(!segment.empty() && segment != "." && segment != "..");
        TERRANE_CHECK(segment.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos);
      }
      check(readQuery(kind, *target, {}));
      break;
    }
    default:
      check(readQueryJson(kind, text, {}));
  }
  return 0;
}
