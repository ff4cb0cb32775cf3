#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "terrane/serve/http_message.h"
#include "terrane/serve/http_server.h"

namespace terrane::serve {

/// Takes requests out of a stream of bytes, one at a time. Whatever is not clearly one request is refused,
/// above all what another server on the way may believe to end elsewhere (RFC 9112, section 6.3): lengths
/// that are lists, and bodies in chunks, which need no server here.
class RequestParser {
 public:
  /// `limits` must outlive the parser: requestLineBytes (414), headBytes (431), bodyBytes (413).
  explicit RequestParser(const ServerLimits& limits);
  ~RequestParser();

  /// Begins the next request.
  void reset();
  /// Takes bytes from the front of what there is, gives how many. What is not taken must be given again, with
  /// more behind it; at most headBytes are ever needed at once.
  size_t take(std::string_view bytes);

  /// The refusal of what was taken, once; after that the stream makes no sense any more.
  std::optional<HttpResponse> takeRefusal();
  bool hasBegun() const;  ///< some of the head was taken
  bool hasHead() const;   ///< and all of it
  bool isWhole() const;   ///< the body, too
  bool expectsContinue() const;
  bool keepsAlive() const;
  bool isOld() const;  ///< HTTP/1.0
  /// The request as far as it has come: empty before its head is whole. Its views end with reset().
  HttpRequest request() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace terrane::serve
