#include "entity.h"

#include <fmt/format.h>

#include <optional>

#include "gzip.h"
#include "terrane/serve/byte_range.h"

namespace terrane::serve {
namespace {

constexpr size_t kLeastToCompress = 1024;

/// The answer where a precondition fails or what the client has is still good.
std::optional<int> preconditions(const HttpRequest& request, std::string_view etag) {
  if (!request.ifMatch.empty() && !matchesEtag(request.ifMatch, etag, false)) return 412;
  if (!request.ifNoneMatch.empty() && matchesEtag(request.ifNoneMatch, etag, true))
    return request.method == "GET" || request.method == "HEAD" ? 304 : 412;
  return {};
}

HttpResponse begin(Route route, const HttpRequest& request, int status, std::string_view etag,
                   std::string_view cacheControl) {
  HttpResponse response;
  response.route = route;
  response.status = status;
  response.headOnly = request.method == "HEAD";
  response.headers.reserve(512);
  response.add("ETag", etag);
  response.add("Cache-Control", cacheControl);
  return response;
}

}  // namespace

HttpResponse answerFile(const HttpRequest& request, Route route, const FileEntity& entity) {
  if (const auto status = preconditions(request, entity.etag)) {
    if (*status == 412) {
      HttpResponse refused =
          refuse(412, "The entity tag in If-Match is not this file's; ask for it without.");
      refused.route = route;
      refused.headOnly = request.method == "HEAD";
      return refused;
    }
    return begin(route, request, *status, entity.etag, entity.cacheControl);
  }

  // Ranges are of GET alone (RFC 9110, section 14.2), and only of the file that the client has a part of. A
  // date in If-Range matches nothing, for no Last-Modified is sent.
  RangeAnswer range;
  if (!request.range.empty() && request.method == "GET" &&
      (request.ifRange.empty() || request.ifRange == entity.etag))
    range = readRange(request.range, entity.bytes);
  if (range.kind == RangeAnswer::Kind::Unsatisfiable) {
    HttpResponse refused =
        refuse(416, fmt::format("The range is beyond the end: there are {} bytes.", entity.bytes));
    refused.route = route;
    refused.add("Content-Range", fmt::format("bytes */{}", entity.bytes));
    refused.add("Accept-Ranges", "bytes");
    return refused;
  }
  const bool part = range.kind == RangeAnswer::Kind::Part;
  HttpResponse response = begin(route, request, part ? 206 : 200, entity.etag, entity.cacheControl);
  response.add("Content-Type", entity.type);
  response.add("Accept-Ranges", "bytes");
  response.file = entity.file;
  response.fileOffset = entity.offset + (part ? range.offset : 0);
  response.fileBytes = part ? range.length : entity.bytes;
  if (part) {
    response.add("Content-Range",
                 fmt::format("bytes {}-{}/{}", range.offset, range.offset + range.length - 1, entity.bytes));
  }
  return response;
}

TextEntity makeTextEntity(std::string text, std::string_view name, std::string_view type) {
  TextEntity entity;
  entity.etag = fmt::format("\"{}\"", name);
  entity.compressedEtag = fmt::format("\"{}-gzip\"", name);
  entity.type = type;
  if (text.size() >= kLeastToCompress) entity.compressed = std::make_shared<const std::string>(gzip(text));
  entity.plain = std::make_shared<const std::string>(std::move(text));
  return entity;
}

HttpResponse answerText(const HttpRequest& request, Route route, const TextEntity& entity,
                        std::string_view cacheControl) {
  const bool compress = entity.compressed && acceptsGzip(request.acceptEncoding);
  const std::string& etag = compress ? entity.compressedEtag : entity.etag;
  if (const auto status = preconditions(request, etag)) {
    HttpResponse response =
        *status == 412
            ? refuse(412, "The entity tag in the request's precondition does not allow this answer.")
            : begin(route, request, *status, etag, cacheControl);
    response.route = route;
    response.add("Vary", "Accept-Encoding");
    response.headOnly = request.method == "HEAD";
    return response;
  }
  HttpResponse response = begin(route, request, 200, etag, cacheControl);
  response.add("Content-Type", entity.type);
  response.add("Vary", "Accept-Encoding");
  if (compress) response.add("Content-Encoding", "gzip");
  response.shared = compress ? entity.compressed : entity.plain;
  return response;
}

}  // namespace terrane::serve
