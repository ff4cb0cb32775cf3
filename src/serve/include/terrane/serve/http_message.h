#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace terrane::serve {

/// An open file that answers are sent from; closed with the last owner.
class ServedFile {
 public:
  explicit ServedFile(int descriptor) : descriptor_(descriptor) {}
  ~ServedFile();
  ServedFile(const ServedFile&) = delete;
  ServedFile& operator=(const ServedFile&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

/// One request, after the head was parsed and the body read. The views live as long as the request does.
struct HttpRequest {
  std::string_view method;
  std::string_view target;  ///< as sent: path and query, percent-encoded
  std::string_view body;
  // The header fields that matter here, empty where absent.
  std::string_view range;
  std::string_view ifRange;
  std::string_view ifMatch;
  std::string_view ifNoneMatch;
  std::string_view acceptEncoding;
  std::string_view contentType;
  std::string_view origin;
  std::string_view host;  ///< as the client named this server
  std::string_view
      forwardedProto;  ///< X-Forwarded-Proto: how the client reached the proxy before this server
};

/// Which kind of thing was asked for: what requests are counted by.
enum class Route : uint8_t {
  Page,
  List,
  Manifest,
  Archive,
  Tile,
  Xyz,
  Query,
  Health,
  Metrics,
  Preflight,
  Refused
};
inline constexpr int kRouteCount = 11;
std::string_view routeName(Route route);

/// One answer. The body is `text`, or `shared`, or a piece of a file, whichever is set; `Date`, `Connection`
/// and `Content-Length` are the server's to add.
struct HttpResponse {
  int status = 200;
  Route route = Route::Refused;
  std::string headers;  ///< lines "Name: value\r\n"
  std::string text;
  std::shared_ptr<const std::string> shared;
  std::shared_ptr<const ServedFile> file;
  uint64_t fileOffset = 0;
  uint64_t fileBytes = 0;
  bool headOnly = false;  ///< the length is told, the body is not sent

  uint64_t bodyBytes() const { return file ? fileBytes : shared ? shared->size() : text.size(); }
  void add(std::string_view name, std::string_view value);
};

std::string_view reasonPhrase(int status);

/// An answer that refuses: plain text that says what is wrong and what to do.
HttpResponse refuse(int status, std::string words);

}  // namespace terrane::serve
