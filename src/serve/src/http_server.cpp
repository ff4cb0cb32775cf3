#include "terrane/serve/http_server.h"

#include <utility>
// note: Boost 1.74 forgets <utility>, and this order mends it.
#include <sys/sendfile.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <optional>
#include <thread>
#include <unordered_set>
#include <vector>

#include "request_parser.h"
#include "terrane/base/parallel.h"

namespace terrane::serve {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using Tcp = asio::ip::tcp;
using Clock = std::chrono::steady_clock;

/// File answers up to this size go through the thread's buffer together with their head, in one call; larger
/// ones by sendfile(2).
constexpr size_t kScratchBytes = 65536;
/// What one connection may send before others have their turn.
constexpr uint64_t kTurnBytes = 1 << 20;
/// Connections beyond the limit that are still told why they are turned away.
constexpr int64_t kRefusedAtOnce = 128;
constexpr uint64_t kDrainBytes = 256 * 1024;
constexpr double kDrainSeconds = 2.0;
constexpr std::chrono::milliseconds kTick{50};

Clock::time_point after(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// What all threads share.
struct Shared {
  ServerOptions options;
  HttpHandler* handler = nullptr;
  Metrics* metrics = nullptr;
  std::optional<asio::thread_pool> questions;
  std::atomic<size_t> waiting{0};
};

class Connection;

/// One thread, the connections that it serves, and what they take turns to use.
struct Worker {
  explicit Worker(Shared& all) : shared(all), tick(io) {}
  Shared& shared;
  asio::io_context io{1};
  asio::steady_timer tick;
  std::unordered_set<std::shared_ptr<Connection>> connections;
  std::vector<char> scratch = std::vector<char>(kScratchBytes);
  std::string date;
  std::time_t dateSecond = 0;
  bool stopping = false;
  Clock::time_point graceEnd;

  void onTick();
  std::string_view dateField();
};

std::string_view Worker::dateField() {
  if (const std::time_t now = std::time(nullptr); now != dateSecond) {
    dateSecond = now;
    std::tm parts{};
    gmtime_r(&now, &parts);
    std::array<char, 64> text{};
    const size_t length =
        std::strftime(text.data(), text.size(), "Date: %a, %d %b %Y %H:%M:%S GMT\r\n", &parts);
    date.assign(text.data(), length);
  }
  return date;
}

/// One client: reads a request, has it answered, sends the answer, and so on. All on its worker's thread but
/// for answers that take long.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Worker& worker, Tcp::socket socket)
      : worker_(worker),
        shared_(worker.shared),
        socket_(std::move(socket)),
        limits_(shared_.options.limits),
        parser_(limits_) {
    ++shared_.metrics->connections;
    error_code ignored;
    socket_.set_option(Tcp::no_delay(true), ignored);
    socket_.non_blocking(true, ignored);
    if (shared_.options.accessLog != nullptr) peer_ = socket_.remote_endpoint(ignored).address().to_string();
  }
  ~Connection() { --shared_.metrics->connections; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void begin() {
    buffer_.resize(limits_.headBytes);
    deadline_ = after(limits_.headSeconds);
    begun_ = Clock::now();
    nextRequest();
  }
  /// Turns the client away before it said anything.
  void turnAway() {
    buffer_.resize(1024);
    begun_ = Clock::now();
    HttpResponse response = refuse(503, "Too many connections; try again in a moment.");
    response.add("Retry-After", "1");
    refuseWith(std::move(response));
  }

  /// Is too slow: says so where that is of use, and closes.
  void checkTime(Clock::time_point now) {
    if (phase_ == Phase::Working || now < deadline_) return;
    ++shared_.metrics->timeouts;
    const bool waitsForRequest = (phase_ == Phase::Head && hasBegun()) || phase_ == Phase::Body;
    if (!waitsForRequest) return close();
    error_code ignored;
    socket_.cancel(ignored);
    refuseWith(refuse(408, "The request took too long to arrive."));
  }
  /// The server stops: closes what waits for a request that has not begun.
  void stopSoon() {
    if (phase_ == Phase::Head && !hasBegun()) close();
  }
  void close() {
    if (phase_ == Phase::Closed) return;
    if (phase_ == Phase::Sending) ++shared_.metrics->abandoned;
    phase_ = Phase::Closed;
    error_code ignored;
    socket_.close(ignored);
    worker_.connections.erase(shared_from_this());
  }

 private:
  enum class Phase : uint8_t { Head, Body, Working, Sending, Draining, Closed };

  /// Has any of the next request come?
  bool hasBegun() const { return used_ > 0 || parser_.hasBegun(); }
  void nextRequest();
  void readMore();
  void consume();
  void onHead();
  void respond();
  void send();
  void sendHeadAndBody();
  void finishAnswer();
  void drain();
  void refuseWith(HttpResponse response);
  void buildHead();
  ssize_t sendOnce();
  void waitToSend();

  Worker& worker_;
  Shared& shared_;
  Tcp::socket socket_;
  const ServerLimits& limits_;
  std::string peer_;
  Phase phase_ = Phase::Head;
  Clock::time_point deadline_ = Clock::time_point::max();
  Clock::time_point begun_;  ///< the request's first byte

  std::vector<char> buffer_;
  size_t used_ = 0;
  RequestParser parser_;
  bool closeAfter_ = false;

  HttpResponse response_;
  std::string head_;
  uint64_t sent_ = 0;  ///< of head and body
  uint64_t bodyBytes_ = 0;
  uint64_t drained_ = 0;
};

void Connection::nextRequest() {
  phase_ = Phase::Head;
  parser_.reset();
  closeAfter_ = false;
  if (used_ == 0) return readMore();
  begun_ = Clock::now();
  deadline_ = after(limits_.headSeconds);
  consume();
}

void Connection::readMore() {
  socket_.async_read_some(asio::buffer(buffer_.data() + used_, buffer_.size() - used_),
                          [self = shared_from_this()](error_code error, size_t bytes) {
                            Connection& c = *self;
                            if (c.phase_ != Phase::Head && c.phase_ != Phase::Body) return;
                            if (error) return c.close();
                            if (c.phase_ == Phase::Head && !c.hasBegun()) {
                              c.begun_ = Clock::now();
                              c.deadline_ = after(c.limits_.headSeconds);
                            }
                            c.used_ += bytes;
                            c.consume();
                          });
}

/// Gives the parser what there is.
void Connection::consume() {
  const size_t taken = parser_.take({buffer_.data(), used_});
  std::memmove(buffer_.data(), buffer_.data() + taken, used_ - taken);
  used_ -= taken;
  if (auto refusal = parser_.takeRefusal()) return refuseWith(std::move(*refusal));
  if (parser_.isWhole()) return respond();
  if (parser_.hasHead() && phase_ == Phase::Head) {
    phase_ = Phase::Body;
    deadline_ = after(limits_.bodySeconds);
    // A client that asks before it sends the body is told to go on; this fits into any socket's buffer.
    if (parser_.expectsContinue()) {
      constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
      [[maybe_unused]] const ssize_t told =
          ::send(socket_.native_handle(), kContinue.data(), kContinue.size(), MSG_NOSIGNAL);
    }
  }
  readMore();
}

/// A whole request is here.
void Connection::respond() {
  phase_ = Phase::Working;
  closeAfter_ = !parser_.keepsAlive() || worker_.stopping;
  const HttpRequest asked = parser_.request();
  const auto make = [](HttpHandler& handler, const HttpRequest& what) {
    // note: what is left to be thrown is the system's lack of memory, and that of one request must not end
    // all.
    try {
      return handler.answer(what);
    } catch (const std::exception&) {
      return refuse(500, "The server could not answer; try again later.");
    }
  };
  if (!shared_.handler->takesLong(asked)) {
    response_ = make(*shared_.handler, asked);
    buildHead();
    return send();
  }
  if (shared_.waiting.fetch_add(1) >= limits_.waitingQuestions) {
    --shared_.waiting;
    response_ = refuse(503, "Too many questions at a time; try again in a moment.");
    response_.route = Route::Query;
    response_.add("Retry-After", "1");
    shared_.handler->decorate(asked, response_);
    buildHead();
    return send();
  }
  asio::post(*shared_.questions, [self = shared_from_this(), make] {
    --self->shared_.waiting;
    self->response_ = make(*self->shared_.handler, self->parser_.request());
    asio::post(self->worker_.io, [self] {
      if (self->phase_ != Phase::Working) return;
      self->buildHead();
      self->send();
    });
  });
}

/// Refuses what was sent and says that the connection ends: what follows on it cannot be trusted.
void Connection::refuseWith(HttpResponse response) {
  response_ = std::move(response);
  response_.route = Route::Refused;
  shared_.handler->decorate(parser_.request(), response_);
  closeAfter_ = true;
  buildHead();
  send();
}

void Connection::buildHead() {
  phase_ = Phase::Sending;
  deadline_ = after(limits_.idleSeconds);
  sent_ = 0;
  bodyBytes_ =
      response_.headOnly || response_.status == 204 || response_.status == 304 ? 0 : response_.bodyBytes();
  closeAfter_ = closeAfter_ || worker_.stopping;
  head_ = "HTTP/1.1 ";
  head_ += std::to_string(response_.status);
  head_ += ' ';
  head_ += reasonPhrase(response_.status);
  head_ += "\r\n";
  head_ += worker_.dateField();
  head_ += response_.headers;
  if (response_.status != 204 && response_.status != 304) {
    head_ += "Content-Length: ";
    head_ += std::to_string(response_.bodyBytes());
    head_ += "\r\n";
  }
  if (closeAfter_)
    head_ += "Connection: close\r\n";
  else if (parser_.isOld())
    head_ += "Connection: keep-alive\r\n";
  head_ += "\r\n";
}

/// One call to the system; its result.
ssize_t Connection::sendOnce() {
  const int to = socket_.native_handle();
  const uint64_t headLeft = head_.size() - std::min<uint64_t>(sent_, head_.size());
  const uint64_t bodyAt = sent_ > head_.size() ? sent_ - head_.size() : 0;
  const uint64_t bodyLeft = bodyBytes_ - bodyAt;
  std::array<iovec, 2> parts{};
  parts[0] = {head_.data() + (head_.size() - headLeft), headLeft};

  // A large piece of a file: the head alone, held back until the file's first bytes follow it.
  if (response_.file && bodyLeft > kScratchBytes) {
    if (headLeft > 0) return ::send(to, parts[0].iov_base, headLeft, MSG_NOSIGNAL | MSG_MORE);
    auto offset = static_cast<off_t>(response_.fileOffset + bodyAt);
    const ssize_t count =
        ::sendfile(to, response_.file->descriptor(), &offset, std::min(bodyLeft, kTurnBytes));
    if (count == 0) errno = EIO;  // the file was cut off under us
    return count == 0 ? -1 : count;
  }
  if (response_.file && bodyLeft > 0) {
    const ssize_t count = ::pread(response_.file->descriptor(), worker_.scratch.data(), bodyLeft,
                                  static_cast<off_t>(response_.fileOffset + bodyAt));
    if (count != static_cast<ssize_t>(bodyLeft)) {
      errno = EIO;
      return -1;
    }
    parts[1] = {worker_.scratch.data(), bodyLeft};
  } else if (bodyLeft > 0) {
    const std::string& text = response_.shared ? *response_.shared : response_.text;
    parts[1] = {const_cast<char*>(text.data()) + bodyAt, bodyLeft};
  }
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  return ::sendmsg(to, &message, MSG_NOSIGNAL);
}

void Connection::send() {
  uint64_t inThisTurn = 0;
  const uint64_t all = head_.size() + bodyBytes_;
  while (sent_ < all) {
    const ssize_t count = sendOnce();
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return waitToSend();
    if (count < 0) return close();
    sent_ += static_cast<uint64_t>(count);
    deadline_ = after(limits_.idleSeconds);
    inThisTurn += static_cast<uint64_t>(count);
    if (inThisTurn < kTurnBytes || sent_ == all) continue;
    // Others have their turn.
    return asio::post(worker_.io, [self = shared_from_this()] {
      if (self->phase_ == Phase::Sending) self->send();
    });
  }
  finishAnswer();
}

void Connection::waitToSend() {
  socket_.async_wait(Tcp::socket::wait_write, [self = shared_from_this()](error_code error) {
    if (self->phase_ != Phase::Sending) return;
    if (error) return self->close();
    self->send();
  });
}

void Connection::finishAnswer() {
  const double seconds = std::chrono::duration<double>(Clock::now() - begun_).count();
  shared_.metrics->count(response_.route, response_.status, sent_, seconds);
  if (shared_.options.accessLog != nullptr) {
    const HttpRequest asked = parser_.request();
    shared_.options.accessLog->write({peer_, asked.method.empty() ? "-" : asked.method,
                                      asked.target.empty() ? "-" : asked.target, response_.status, bodyBytes_,
                                      seconds});
  }
  response_ = {};
  if (closeAfter_ || worker_.stopping) return drain();
  deadline_ = after(limits_.idleSeconds);
  if (used_ == 0) return nextRequest();
  // A request that came with the last one waits its turn.
  asio::post(worker_.io, [self = shared_from_this()] {
    if (self->phase_ == Phase::Sending) self->nextRequest();
  });
}

/// Ends our side and reads on for a while: closing with bytes unread would tear the answer from the client's
/// hands.
void Connection::drain() {
  if (phase_ != Phase::Draining) {
    phase_ = Phase::Draining;
    deadline_ = after(kDrainSeconds);
    error_code ignored;
    socket_.shutdown(Tcp::socket::shutdown_send, ignored);
  }
  socket_.async_read_some(asio::buffer(buffer_), [self = shared_from_this()](error_code error, size_t bytes) {
    if (self->phase_ != Phase::Draining) return;
    self->drained_ += bytes;
    if (error || self->drained_ > kDrainBytes) return self->close();
    self->drain();
  });
}

void Worker::onTick() {
  const auto now = Clock::now();
  // note: closing takes a connection out of the set.
  const std::vector<std::shared_ptr<Connection>> all(connections.begin(), connections.end());
  for (const auto& connection : all) {
    if (stopping && now >= graceEnd)
      connection->close();
    else
      connection->checkTime(now);
  }
  if (stopping && connections.empty()) return;  // nothing is left to do: the thread ends
  tick.expires_after(kTick);
  tick.async_wait([this](error_code) { onTick(); });
}

}  // namespace

struct HttpServer::State {
  Shared shared;
  std::vector<std::unique_ptr<Worker>> workers;
  std::vector<std::thread> threads;
  std::optional<Tcp::acceptor> acceptor;
  std::optional<asio::steady_timer> acceptPause;
  Tcp::endpoint endpoint;
  size_t next = 0;
  bool stopped = false;

  void accept();
  void admit(Worker& worker, Tcp::socket socket);
};

/// Connections go round among the threads.
void HttpServer::State::accept() {
  Worker& worker = *workers[next++ % workers.size()];
  acceptor->async_accept(worker.io, [this, &worker](error_code error, Tcp::socket socket) {
    if (!acceptor->is_open()) return;
    if (!error) {
      admit(worker, std::move(socket));
      return accept();
    }
    // Out of descriptors, most likely: what is closed in a moment gives some back.
    acceptPause->expires_after(std::chrono::milliseconds(50));
    acceptPause->async_wait([this](error_code) {
      if (acceptor->is_open()) accept();
    });
  });
}

void HttpServer::State::admit(Worker& worker, Tcp::socket socket) {
  Metrics& metrics = *shared.metrics;
  const auto limit = static_cast<int64_t>(shared.options.limits.connections);
  ++metrics.accepted;
  const bool turnAway = metrics.connections >= limit;
  if (turnAway) ++metrics.overLimit;
  if (metrics.connections >= limit + kRefusedAtOnce) return;
  auto connection = std::make_shared<Connection>(worker, std::move(socket));
  asio::post(worker.io, [&worker, connection, turnAway] {
    worker.connections.insert(connection);
    if (worker.stopping) return connection->close();
    turnAway ? connection->turnAway() : connection->begin();
  });
}

Result<std::unique_ptr<HttpServer>> HttpServer::start(const ServerOptions& options, HttpHandler& handler,
                                                      Metrics& metrics) {
  error_code error;
  const std::string address = options.bindAddress == "localhost" ? "127.0.0.1" : options.bindAddress;
  const auto parsed = asio::ip::make_address(address, error);
  if (error)
    return makeError("'{}' is no IP address to listen at; use 127.0.0.1, ::1, 0.0.0.0 or ::",
                     options.bindAddress);

  auto state = std::make_unique<State>();
  state->shared.options = options;
  state->shared.handler = &handler;
  state->shared.metrics = &metrics;
  const int threads = options.threads > 0 ? options.threads : hardwareThreads();
  state->shared.questions.emplace(static_cast<size_t>(threads));
  for (int i = 0; i < threads; ++i) state->workers.push_back(std::make_unique<Worker>(state->shared));

  // Listen. An address that was in use a moment ago may be used again, one that is in use may not.
  asio::io_context& io = state->workers[0]->io;
  state->acceptor.emplace(io);
  state->acceptPause.emplace(io);
  const Tcp::endpoint endpoint(parsed, static_cast<unsigned short>(options.port));
  Tcp::acceptor& acceptor = *state->acceptor;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    const char* remedy =
        error == asio::error::address_in_use
            ? "; another program listens there: choose another --port, or 0 for any that is free"
        : error == asio::error::access_denied ? "; ports below 1024 need privileges: choose another --port"
                                              : "; check --bind and --port";
    return makeError("cannot listen at {} port {}: {}{}", address, options.port, error.message(), remedy);
  }
  state->endpoint = acceptor.local_endpoint(error);
  state->accept();
  for (auto& worker : state->workers) {
    worker->onTick();
    state->threads.emplace_back([&io = worker->io] { io.run(); });
  }
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(state)));
}

HttpServer::HttpServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

HttpServer::~HttpServer() {
  stop(0.0);
}

int HttpServer::port() const {
  return state_->endpoint.port();
}

std::string HttpServer::url() const {
  const auto address = state_->endpoint.address();
  const std::string text = address.to_string();
  return fmt::format("http://{}:{}/", address.is_v6() ? "[" + text + "]" : text, state_->endpoint.port());
}

void HttpServer::stop(double graceSeconds) {
  if (std::exchange(state_->stopped, true)) return;
  State& state = *state_;
  asio::post(state.workers[0]->io, [&state] {
    error_code ignored;
    state.acceptor->close(ignored);
    state.acceptPause->cancel();
  });
  const auto graceEnd = after(graceSeconds);
  for (auto& worker : state.workers) {
    asio::post(worker->io, [&worker = *worker, graceEnd] {
      worker.stopping = true;
      worker.graceEnd = graceEnd;
      const std::vector<std::shared_ptr<Connection>> all(worker.connections.begin(),
                                                         worker.connections.end());
      for (const auto& connection : all) connection->stopSoon();
      worker.tick.cancel();
    });
  }
  for (std::thread& thread : state.threads) thread.join();
  state.shared.questions->stop();
  state.shared.questions->join();
  // note: questions that never began hold connections, which must go before the contexts that they live in.
  state.shared.questions.reset();
  for (auto& worker : state.workers) worker->connections.clear();
}

}  // namespace terrane::serve
