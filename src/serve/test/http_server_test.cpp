#include "terrane/serve/http_server.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include "http_client.h"

namespace terrane::serve {
namespace {

using Clock = std::chrono::steady_clock;

/// Answers with what it was asked; "/file" with bytes of a file, "/long" when it is told to.
class Echo final : public HttpHandler {
 public:
  HttpResponse answer(const HttpRequest& request) override {
    HttpResponse response;
    response.route = Route::Page;
    response.add("Content-Type", "text/plain");
    response.headOnly = request.method == "HEAD";
    if (request.target == "/file" || request.target == "/small") {
      response.file = file;
      response.fileBytes = request.target == "/file" ? fileBytes : 5000;
      response.fileOffset = request.target == "/file" ? 0 : 77;
      return response;
    }
    if (request.target == "/long") {
      std::unique_lock lock(mutex);
      ++running;
      changed.notify_all();
      changed.wait(lock, [this] { return released; });
    }
    response.text =
        std::string(request.method) + " " + std::string(request.target) + " " + std::string(request.body);
    return response;
  }
  bool takesLong(const HttpRequest& request) const override { return request.target == "/long"; }
  void decorate(const HttpRequest&, HttpResponse& response) const override {
    response.add("X-Decorated", "yes");
  }

  void release() {
    const std::lock_guard lock(mutex);
    released = true;
    changed.notify_all();
  }
  void waitForRunning(int count) {
    std::unique_lock lock(mutex);
    changed.wait_for(lock, std::chrono::seconds(20), [&] { return running >= count; });
  }

  std::shared_ptr<const ServedFile> file;
  uint64_t fileBytes = 0;
  std::mutex mutex;
  std::condition_variable changed;
  bool released = false;
  int running = 0;
};

class HttpServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("terrane_http_" + std::to_string(getpid()));
    content_.resize(24 << 20);
    for (size_t i = 0; i < content_.size(); ++i) content_[i] = static_cast<char>(i * 2654435761U >> 24);
    std::ofstream(path_, std::ios::binary) << content_;
    echo_.file = std::make_shared<const ServedFile>(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
    echo_.fileBytes = content_.size();
  }
  void TearDown() override {
    echo_.release();
    server_.reset();
    std::filesystem::remove(path_);
    EXPECT_EQ(metrics_.connections, 0);
  }
  void start(const ServerLimits& limits = {}) {
    ServerOptions options;
    options.port = 0;
    options.threads = 2;
    options.limits = limits;
    auto started = HttpServer::start(options, echo_, metrics_);
    ASSERT_TRUE(started.ok()) << started.error().message;
    server_ = std::move(started).value();
  }
  HttpClient client(int receiveBufferBytes = 0) const {
    return HttpClient(server_->port(), receiveBufferBytes);
  }
  /// The server still serves.
  void expectAlive() {
    HttpClient other = client();
    const auto answer = other.get("/alive");
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
    EXPECT_EQ(answer->body, "GET /alive ");
  }
  /// What these bytes are answered with, on a connection of their own, which ends with it.
  void expectRefused(const std::string& bytes, int status) {
    HttpClient one = client();
    one.send(bytes);
    const auto answer = one.receive();
    ASSERT_TRUE(answer) << bytes.substr(0, 100);
    EXPECT_EQ(answer->status, status) << bytes.substr(0, 100) << "\n" << answer->body;
    EXPECT_EQ(answer->fields.at("Connection"), "close");
    EXPECT_EQ(answer->fields.at("X-Decorated"), "yes");
    EXPECT_GT(answer->body.size(), 10U);
    EXPECT_TRUE(one.closes()) << bytes.substr(0, 100);
    expectAlive();
  }
  /// Waits until something holds, by asking again and again.
  template <class Condition>
  static bool eventually(Condition condition, double seconds = 20.0) {
    const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
    while (!condition()) {
      if (Clock::now() > deadline) return false;
      std::this_thread::yield();
    }
    return true;
  }

  std::filesystem::path path_;
  std::string content_;
  Echo echo_;
  Metrics metrics_;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, AnswersOneRequestAfterTheOtherOnAConnection) {
  start();
  HttpClient one = client();
  for (int i = 0; i < 100; ++i) {
    const auto answer = one.get("/" + std::to_string(i));
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
    EXPECT_EQ(answer->body, "GET /" + std::to_string(i) + " ");
    EXPECT_EQ(answer->fields.count("Date"), 1U);
  }
  EXPECT_EQ(metrics_.accepted, 1U);
  // Pipelined, in order, whatever the pieces they come in.
  std::string many;
  for (int i = 0; i < 2000; ++i) many += "GET /" + std::to_string(i) + " HTTP/1.1\r\nHost: a\r\n\r\n";
  std::thread sender([&] {
    for (size_t at = 0; at < many.size(); at += 977) one.send(std::string_view(many).substr(at, 977));
  });
  for (int i = 0; i < 2000; ++i) {
    const auto answer = one.receive();
    ASSERT_TRUE(answer) << i;
    ASSERT_EQ(answer->body, "GET /" + std::to_string(i) + " ");
  }
  sender.join();
}

TEST_F(HttpServerTest, HeadIsGetWithoutABody) {
  start();
  HttpClient one = client();
  for (const std::string& target : {std::string("/file"), std::string("/small"), std::string("/x")}) {
    one.send("HEAD " + target + " HTTP/1.1\r\nHost: a\r\n\r\n");
    const auto head = one.receive(true);
    const auto get = one.get(target);
    ASSERT_TRUE(head && get);
    EXPECT_EQ(head->status, get->status);
    if (target != "/x") {
      EXPECT_EQ(head->fields.at("Content-Length"), get->fields.at("Content-Length"));
    }
    EXPECT_EQ(head->fields.at("Content-Type"), get->fields.at("Content-Type"));
  }
}

TEST_F(HttpServerTest, FilesComeWholeToFastAndSlowReaders) {
  start();
  HttpClient fast = client(), slow = client(4096);
  slow.sendGet("/file");
  auto answer = fast.get("/file");
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->body == content_);
  answer = fast.get("/small");
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->body == content_.substr(77, 5000));
  answer = slow.receive(false, 60.0);
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->body == content_);
}

TEST_F(HttpServerTest, BodiesComeByLength) {
  start();
  HttpClient one = client();
  one.send(
      "POST /a HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhelloPOST /b HTTP/1.1\r\nHost: "
      "a\r\nContent-Length: 0\r\n\r\n");
  auto answer = one.receive();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->body, "POST /a hello");
  answer = one.receive();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->body, "POST /b ");
  // One that asks first is told to go on.
  one.send("POST /c HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n");
  answer = one.receive();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 100);
  one.send("xy");
  EXPECT_EQ(one.receive()->body, "POST /c xy");
}

TEST_F(HttpServerTest, OldClientsAndThoseThatCloseAreObeyed) {
  start();
  HttpClient old = client();
  old.send("GET / HTTP/1.0\r\n\r\n");
  EXPECT_EQ(old.receive()->fields.at("Connection"), "close");
  EXPECT_TRUE(old.closes());
  HttpClient keeps = client();
  keeps.send("GET / HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
  EXPECT_EQ(keeps.receive()->fields.at("Connection"), "keep-alive");
  HttpClient closes = client();
  closes.sendGet("/", "Connection: close\r\n");
  EXPECT_EQ(closes.receive()->fields.at("Connection"), "close");
  EXPECT_TRUE(closes.closes());
}

TEST_F(HttpServerTest, RefusesWhatIsTooLarge) {
  start();
  expectRefused("GET /" + std::string(9000, 'a') + " HTTP/1.1\r\nHost: a\r\n\r\n", 414);
  expectRefused(std::string(9000, 'a'), 414);
  expectRefused("GET / HTTP/1.1\r\nHost: a\r\nX: " + std::string(20000, 'a') + "\r\n\r\n", 431);
  std::string many = "GET / HTTP/1.1\r\nHost: a\r\n";
  for (int i = 0; i < 3000; ++i) many += "X" + std::to_string(i) + ": y\r\n";
  expectRefused(many + "\r\n", 431);
  expectRefused("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n", 413);
}

TEST_F(HttpServerTest, RefusesWhatOthersMightReadDifferently) {
  ServerLimits limits;
  limits.bodySeconds = 0.5;
  start(limits);
  const std::string post = "POST / HTTP/1.1\r\nHost: a\r\n";
  expectRefused(post + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400);
  expectRefused(post + "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n0\r\n\r\n", 400);
  expectRefused(post + "Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello", 400);
  expectRefused(post + "Content-Length: 5\r\nContent-Length: 5\r\n\r\nhello", 400);
  expectRefused(post + "Content-Length: 5, 5\r\n\r\nhello", 400);
  expectRefused(post + "Content-Length: +5\r\n\r\nhello", 400);
  expectRefused(post + "Content-Length: -5\r\n\r\nhello", 400);
  expectRefused(post + "Content-Length: 0x5\r\n\r\nhello", 400);
  expectRefused(post + "Content-Length: 99999999999999999999999\r\n\r\n", 400);
  expectRefused(post + "Content-Length : 5\r\n\r\nhello", 400);
  for (const char* coding : {"chunked", "gzip, chunked", "xchunked", "identity"})
    expectRefused(post + "Transfer-Encoding: " + coding + "\r\n\r\n0\r\n\r\n", 411);
  expectRefused(post + "Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\nGET / HTTP/1.1\r\n\r\n", 411);
  expectRefused("POST / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400);
  expectRefused("GET / HTTP/1.1\r\n\r\n", 400);
  expectRefused("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400);
  expectRefused("GET / HTTP/1.1\r\nHost: a\r\nA B: c\r\n\r\n", 400);
  expectRefused("GET / HTTP/1.1\r\nHost: a\r\nX: \x01\r\n\r\n", 400);
  expectRefused(std::string("GET /\0 HTTP/1.1\r\nHost: a\r\n\r\n", 29), 400);
  expectRefused("GET  / HTTP/1.1\r\nHost: a\r\n\r\n", 400);
  expectRefused("GET / HTTP/2.0\r\nHost: a\r\n\r\n", 505);
  expectRefused("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505);
  expectRefused("\x16\x03\x01\x02\r\n\r\n\r\n", 400);
  expectRefused("GET / HTTP/1.1\r\nHost: a\r\nExpect: tea\r\n\r\n", 417);
  expectRefused("POST / HTTP/1.1\r\nHost: a\r\nExpect: tea\r\nContent-Length: 3\r\n\r\nabc", 417);
}

TEST_F(HttpServerTest, SlowClientsByTheHundredStarveNobody) {
  ServerLimits limits;
  limits.headSeconds = 3.0;
  limits.bodySeconds = 3.0;
  start(limits);
  std::vector<HttpClient> slow;
  for (int i = 0; i < 400; ++i) {
    slow.push_back(client(i % 4 == 3 ? 4096 : 0));
    ASSERT_TRUE(slow.back().connected());
    if (i % 4 == 0) slow.back().send("GET /slow HTTP/1.1\r\n");
    if (i % 4 == 1) slow.back().send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 10\r\n\r\nabc");
    if (i % 4 == 2) slow.back().send("G");
    if (i % 4 == 3) slow.back().sendGet("/file");  // and never reads
  }
  // Meanwhile one who behaves is served, and quickly.
  HttpClient normal = client();
  const auto begin = Clock::now();
  for (int i = 0; i < 200; ++i) {
    for (int k = 0; k < 4; ++k)
      slow[static_cast<size_t>(i % 100 * 4)].send(k < 3 ? "X: y\r\n" : "Z");  // drop by drop
    const auto answer = normal.get("/" + std::to_string(i));
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 200);
  }
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - begin).count(), 2.5);
  // Those who did not come to the point are told, and are gone.
  for (size_t i = 0; i < slow.size(); ++i) {
    if (i % 4 == 3) continue;
    const auto late = slow[i].receive();
    ASSERT_TRUE(late) << i;
    EXPECT_EQ(late->status, 408);
    EXPECT_TRUE(slow[i].closes());
  }
  EXPECT_GE(metrics_.timeouts, 300U);
  expectAlive();
}

TEST_F(HttpServerTest, IdleConnectionsAreClosed) {
  ServerLimits limits;
  limits.idleSeconds = 0.3;
  limits.headSeconds = 0.3;
  start(limits);
  HttpClient used = client(), silent = client(), unread = client(4096);
  ASSERT_TRUE(used.get("/"));
  unread.sendGet("/file");
  EXPECT_TRUE(used.closes());
  EXPECT_TRUE(silent.closes());
  EXPECT_TRUE(eventually([&] { return metrics_.connections == 0; }));
  EXPECT_EQ(metrics_.abandoned, 1U);
}

TEST_F(HttpServerTest, ConnectionsBeyondTheLimitAreToldSo) {
  ServerLimits limits;
  limits.connections = 20;
  start(limits);
  std::vector<HttpClient> all;
  for (int i = 0; i < 20; ++i) {
    all.push_back(client());
    ASSERT_TRUE(all.back().get("/"));
  }
  HttpClient more = client();
  more.sendGet("/");
  const auto answer = more.receive();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 503);
  EXPECT_EQ(answer->fields.at("Retry-After"), "1");
  EXPECT_TRUE(more.closes());
  EXPECT_EQ(metrics_.overLimit, 1U);
  // Those who have a place keep it, and a place that is given up is free.
  EXPECT_TRUE(all[3].get("/"));
  all.pop_back();
  EXPECT_TRUE(eventually([&] { return metrics_.connections < 20; }));
  HttpClient again = client();
  EXPECT_EQ(again.get("/")->status, 200);
}

TEST_F(HttpServerTest, AnswersThatTakeLongHoldUpNobodyAndAreBounded) {
  ServerLimits limits;
  limits.waitingQuestions = 5;
  start(limits);
  std::vector<HttpClient> asking;
  for (int i = 0; i < 2; ++i) asking.push_back(client()), asking.back().sendGet("/long");
  echo_.waitForRunning(2);
  for (int i = 0; i < 5; ++i) asking.push_back(client()), asking.back().sendGet("/long");
  // Both threads for questions are taken and five wait; the next is told to come again.
  HttpClient more = client();
  ASSERT_TRUE(eventually([&] {
    const auto answer = more.get("/nothing");
    if (!answer) return false;
    HttpClient one = client();
    one.sendGet("/long");
    const auto busy = one.receive(false, 0.2);
    return busy && busy->status == 503 && busy->fields.count("Retry-After") == 1;
  }));
  expectAlive();
  echo_.release();
  for (size_t i = 0; i < asking.size(); ++i) {
    const auto answer = asking[i].receive();
    ASSERT_TRUE(answer) << i;
    EXPECT_TRUE(answer->status == 200 || answer->status == 503);
  }
}

TEST_F(HttpServerTest, StoppingLetsADownloadFinish) {
  start();
  const int port = server_->port();
  HttpClient slow = client(4096), idle = client(), asking = client();
  ASSERT_TRUE(idle.get("/"));
  slow.sendGet("/file");
  asking.sendGet("/long");
  echo_.waitForRunning(1);
  ASSERT_TRUE(slow.more(Clock::now() + std::chrono::seconds(20)));
  std::atomic<bool> stopped{false};
  std::thread stopper([&] {
    server_->stop(60.0);
    stopped = true;
  });
  // Who waits for nothing is let go at once; nobody new comes in; what runs goes on.
  EXPECT_TRUE(idle.closes());
  EXPECT_TRUE(eventually([&] { return !HttpClient(port).connected(); }));
  EXPECT_FALSE(stopped);
  echo_.release();
  const auto answered = asking.receive();
  ASSERT_TRUE(answered);
  EXPECT_EQ(answered->body, "GET /long ");
  const auto answer = slow.receive(false, 60.0);
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->body == content_);
  EXPECT_TRUE(slow.closes());
  stopper.join();
}

TEST_F(HttpServerTest, StoppingWithoutGraceEndsAllAndThePortIsFreeAgain) {
  start();
  const int port = server_->port();
  HttpClient unread = client(4096);
  unread.sendGet("/file");
  ASSERT_TRUE(unread.more(Clock::now() + std::chrono::seconds(20)));

  // While it is taken, the port is refused in words.
  ServerOptions options;
  options.port = port;
  Metrics others;
  const auto second = HttpServer::start(options, echo_, others);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("another program listens there"), std::string::npos)
      << second.error().message;

  const auto begin = Clock::now();
  server_->stop(0.1);
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - begin).count(), 5.0);
  EXPECT_TRUE(unread.closes());
  const auto third = HttpServer::start(options, echo_, metrics_);
  ASSERT_TRUE(third.ok()) << third.error().message;
  HttpClient one(port);
  EXPECT_TRUE(one.get("/"));
  (*third)->stop(0.0);
}

TEST_F(HttpServerTest, RefusesAddressesThatAreNone) {
  ServerOptions options;
  options.bindAddress = "nowhere";
  const auto server = HttpServer::start(options, echo_, metrics_);
  ASSERT_FALSE(server.ok());
  EXPECT_NE(server.error().message.find("nowhere"), std::string::npos);
  options.bindAddress = "192.0.2.1";
  options.port = 0;
  EXPECT_FALSE(HttpServer::start(options, echo_, metrics_).ok());
}

TEST_F(HttpServerTest, ConnectionsLeaveNothingBehind) {
  start();
  for (int i = 0; i < 3000; ++i) {
    HttpClient one = client();
    if (i % 3 == 0) one.sendGet("/small");
    if (i % 3 == 1) one.send("GET / HTTP/1.1\r\nHo");
    if (i % 3 == 2) {
      ASSERT_TRUE(one.get("/x"));
    }
  }
  EXPECT_TRUE(eventually([&] { return metrics_.connections == 0; }));
  size_t open = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) ++open;
  EXPECT_LT(open, 60U);
  expectAlive();
}

}  // namespace
}  // namespace terrane::serve
