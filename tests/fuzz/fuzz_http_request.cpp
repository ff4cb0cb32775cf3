#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "query_request.h"
#include "request_parser.h"
#include "terrane/base/check.h"
#include "terrane/serve/byte_range.h"
#include "terrane/serve/request_target.h"

namespace {

using namespace terrane;
using namespace terrane::serve;

/// What a stream of requests was taken for, given in pieces of a size.
std::string readStream(std::string_view text, size_t piece) {
  ServerLimits limits;
  limits.requestLineBytes = 200;
  limits.headBytes = 400;
  limits.bodyBytes = 500;
  RequestParser parser(limits);
  std::string out, pending;
  for (size_t at = 0; at < text.size() || !pending.empty();) {
    const size_t count = std::min({piece, text.size() - at, limits.headBytes - pending.size()});
    pending += text.substr(at, count);
    at += count;
    const size_t taken = parser.take(pending);
    pending.erase(0, taken);
    if (parser.takeRefusal()) return out + "refused";
    if (parser.isWhole()) {
      const HttpRequest request = parser.request();
      TERRANE_CHECK(request.body.size() <= limits.bodyBytes && request.target.size() <= limits.headBytes);
      out.append(request.method)
          .append(" ")
          .append(request.target)
          .append(" ")
          .append(request.body)
          .append("\n");
      parser.reset();
    } else if (at == text.size()) {
      break;
    } else {
      TERRANE_CHECK(pending.size() < limits.headBytes, "{}", pending.size());
    }
  }
  return out;
}

/// Requests are the same however they come, up to a refusal: a limit may be met earlier in larger pieces.
void checkFraming(std::string_view text, size_t piece) {
  const std::string whole = readStream(text, 400), pieces = readStream(text, piece);
  const size_t common = std::min(whole.rfind('\n') + 1, pieces.rfind('\n') + 1);
  TERRANE_CHECK(whole.substr(0, common) == pieces.substr(0, common), "{}\n---\n{}", whole, pieces);
}

}  // namespace

/// What is read from a request, its framing and what lies behind it. The first byte chooses. Accepted ranges
/// lie inside, accepted paths have no way up, accepted questions are finite and within their limits.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
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
  switch (data[0] / 3 % 5) {
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
    case 2:
      checkFraming(text, 1 + data[0] % 7);
      break;
    default:
      check(readQueryJson(kind, text, {}));
  }
  return 0;
}
