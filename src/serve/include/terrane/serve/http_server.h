#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "terrane/base/result.h"
#include "terrane/serve/access_log.h"
#include "terrane/serve/http_message.h"
#include "terrane/serve/metrics.h"

namespace terrane::serve {

/// What answers requests. Called from any thread of the server, several at a time.
class HttpHandler {
 public:
  virtual ~HttpHandler() = default;
  virtual HttpResponse answer(const HttpRequest& request) = 0;
  /// Could the answer take more than a fraction of a millisecond? Then it is made beside the threads that
  /// serve connections.
  virtual bool takesLong(const HttpRequest& request) const = 0;
  /// Adds the fields that every answer has to one that the server itself gives (a request that it refuses).
  virtual void decorate(const HttpRequest& request, HttpResponse& response) const = 0;
};

/// What a client may cost.
struct ServerLimits {
  size_t connections = 1024;
  size_t requestLineBytes = 8192;  ///< 414 beyond
  size_t headBytes = 16384;        ///< request line and fields; 431 beyond
  size_t bodyBytes = 512 * 1024;   ///< 413 beyond
  double headSeconds = 10.0;       ///< from a request's first byte to the end of its head; 408 beyond
  double bodySeconds = 30.0;       ///< for the body; 408 beyond
  double idleSeconds = 60.0;  ///< between requests, and without progress while an answer is sent; then closed
  /// Answers that take long and have not begun; 503 beyond. A web map asks for a hundred tiles at once.
  size_t waitingQuestions = 256;
};

struct ServerOptions {
  std::string bindAddress = "127.0.0.1";  ///< an IP address, or "localhost"
  int port = 8080;                        ///< 0: any that is free
  int threads = 0;                        ///< 0: as many as cores
  ServerLimits limits;
  AccessLog* accessLog = nullptr;  ///< may be null; must outlive the server
};

/// An HTTP/1.1 server: connections, framing, limits and time. It keeps a buffer of limits.headBytes for each
/// connection and one of 64 KiB for each thread; answers from files go through neither but from the system's
/// cache to the socket. Anything it cannot make sense of is refused and the connection closed.
class HttpServer {
 public:
  /// Listens and serves; returns at once. `handler` and `metrics` must outlive the server. Errors: the
  /// address is none, or cannot be listened at (with what to do).
  static Result<std::unique_ptr<HttpServer>> start(const ServerOptions& options, HttpHandler& handler,
                                                   Metrics& metrics);
  /// Stops without grace.
  ~HttpServer();

  int port() const;
  /// "http://127.0.0.1:8080/".
  std::string url() const;

  /// Accepts no more, lets requests that have begun finish for up to `graceSeconds`, then closes what is
  /// left. Returns when all is closed and every thread has ended.
  void stop(double graceSeconds);

 private:
  struct State;
  explicit HttpServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace terrane::serve
