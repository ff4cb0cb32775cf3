#include <gtest/gtest.h>

#include <thread>

#include "fetching.h"
#include "scripted_server.h"
#include "terrane/stream/transport.h"

/// HTTP against a server that says what it is told. What real servers say: tests/journeys.
namespace terrane {
namespace {

using Request = ScriptedServer::Request;
using Reply = ScriptedServer::Reply;

std::string someBytes(size_t count) {
  std::string out;
  for (size_t i = 0; i < count; ++i) out += static_cast<char>((i * 37 + i / 256) % 251);
  return out;
}
const std::string& file() {
  static const std::string bytes = someBytes(300000);
  return bytes;
}
FetchRequest rangeOf(uint64_t offset, uint64_t bytes) {
  return {"elevation.pmtiles", offset, bytes, false, file().size()};
}

class HttpTransportTest : public ::testing::Test {
 protected:
  /// The problem that an answer has; nothing for bytes.
  std::optional<FetchProblem> problemOf(Transport& transport, const FetchRequest& request) {
    const FetchAnswer answer = fetchOne(transport, request);
    if (!answer.failure) return {};
    message_ = answer.failure->message;
    return answer.failure->problem;
  }
  std::optional<FetchProblem> problemOf(const ScriptedServer& server, const FetchRequest& request) {
    const auto transport = openTransport(server.url());
    return problemOf(*transport, request);
  }

  std::string message_;
};

TEST_F(HttpTransportTest, RangesAndWholeFilesComeWithTheQueryAndUncompressed) {
  ScriptedServer server([](const Request& request) { return ScriptedServer::honest(request, file()); });
  for (const char* path : {"/made?key=a/b", "/made/?key=a/b", "/made/manifest.json?key=a/b"}) {
    const auto transport = openTransport(server.url(path));
    EXPECT_EQ(textOf(fetchOne(*transport, {"manifest.json", 0, 0, false, 0})), file());
    EXPECT_EQ(server.requests().back().target, "/made/manifest.json?key=a/b");
    EXPECT_EQ(server.requests().back().field("accept-encoding"), "gzip");
    EXPECT_EQ(textOf(fetchOne(*transport, rangeOf(70000, 5000))), file().substr(70000, 5000));
    EXPECT_EQ(server.requests().back().target, "/made/elevation.pmtiles?key=a/b");
    EXPECT_EQ(server.requests().back().field("range"), "bytes=70000-74999");
    EXPECT_EQ(server.requests().back().field("accept-encoding"), "identity");
    EXPECT_EQ(server.requests().back().field("cache-control"), "");
    FetchRequest fresh = rangeOf(0, 10);
    fresh.fresh = true;
    EXPECT_EQ(textOf(fetchOne(*transport, fresh)), file().substr(0, 10));
    EXPECT_EQ(server.requests().back().field("cache-control"), "no-cache");
  }
}

TEST_F(HttpTransportTest, ManyAtOnceAreEachTheirOwn) {
  ScriptedServer server([](const Request& request) { return ScriptedServer::honest(request, file()); });
  const auto transport = openHttpTransport(server.url(), 4);
  for (uint64_t id = 0; id < 100; ++id) transport->start(id, rangeOf(id * 2900, 1000 + id));
  size_t come = 0;
  while (come < 100) {
    transport->wait(60.0);
    const auto answers = transport->poll(0.0);
    ASSERT_FALSE(answers.empty());
    for (const FetchAnswer& answer : answers)
      EXPECT_EQ(textOf(answer), file().substr(answer.id * 2900, 1000 + answer.id));
    come += answers.size();
  }
}

TEST_F(HttpTransportTest, AServerWithoutRangesIsToldAtOnceAndNotDownloadedFrom) {
  const std::string large = someBytes(64 << 20);
  ScriptedServer server([&](const Request&) { return ScriptedServer::reply(200, "", large); });
  FetchRequest request{"elevation.pmtiles", 0, 16384, false, large.size()};
  EXPECT_EQ(problemOf(server, request), FetchProblem::Fatal);
  EXPECT_NE(message_.find("knows ranges"), std::string::npos) << message_;
  request.offset = 1 << 20;
  EXPECT_EQ(problemOf(server, request), FetchProblem::Fatal);
  // note: what the system holds between the two may have been sent.
  EXPECT_LT(server.bytesSent(), large.size() / 2);
}

TEST_F(HttpTransportTest, MoreThanWasAskedForIsCutOff) {
  const auto endless = [](const std::string& head) {
    Reply reply{head + "\r\n\r\nx"};
    reply.endless = true;
    return reply;
  };
  ScriptedServer server([&](const Request&) {
    return endless("HTTP/1.1 206 Part\r\nContent-Range: bytes 100-199/" + std::to_string(file().size()));
  });
  EXPECT_EQ(problemOf(server, rangeOf(100, 100)), FetchProblem::Malformed);
  server.setScript([&](const Request&) { return endless("HTTP/1.1 200 All"); });
  EXPECT_EQ(problemOf(server, {"manifest.json", 0, 0, false, 0}), FetchProblem::Malformed);
  server.setScript([&](const Request&) { return endless("HTTP/1.1 404 Nothing"); });
  EXPECT_EQ(problemOf(server, rangeOf(100, 100)), FetchProblem::Missing);
  server.setScript([&](const Request&) {
    Reply reply{"HTTP/1.1 200 All\r\nX-Endless: x"};
    reply.endless = true;
    return reply;
  });
  EXPECT_TRUE(problemOf(server, {"manifest.json", 0, 0, false, 0}));
}

TEST_F(HttpTransportTest, CompressedRangesAreNone) {
  ScriptedServer server([](const Request& request) {
    return ScriptedServer::honest(request, file(), "Content-Encoding: gzip\r\n");
  });
  EXPECT_EQ(problemOf(server, rangeOf(100, 100)), FetchProblem::Fatal);
  EXPECT_NE(message_.find("compresses"), std::string::npos) << message_;
}

TEST_F(HttpTransportTest, RefusalsAreToldApart) {
  ScriptedServer server(
      [](const Request&) { return ScriptedServer::reply(503, "Retry-After: 7\r\n", "no"); });
  const auto transport = openTransport(server.url());
  const FetchAnswer busy = fetchOne(*transport, rangeOf(0, 10));
  ASSERT_TRUE(busy.failure);
  EXPECT_EQ(busy.failure->problem, FetchProblem::Busy);
  EXPECT_EQ(busy.failure->retryAfterSeconds, 7.0);
  server.setScript([](const Request&) { return ScriptedServer::reply(404, "", "nothing here"); });
  EXPECT_EQ(problemOf(*transport, rangeOf(0, 10)), FetchProblem::Missing);
  EXPECT_NE(message_.find(server.url() + "/elevation.pmtiles: the server answers 404"), std::string::npos)
      << message_;
}

TEST_F(HttpTransportTest, AnotherBuildBehindTheClientIsNoticed) {
  const auto build = [](const std::string& etag) {
    return [etag](const Request& request) {
      return ScriptedServer::honest(request, file(), "ETag: " + etag + "\r\n");
    };
  };
  ScriptedServer server(build("\"one\""));
  const auto transport = openTransport(server.url());
  EXPECT_FALSE(problemOf(*transport, rangeOf(0, 10)));
  EXPECT_FALSE(problemOf(*transport, rangeOf(10, 10)));
  server.setScript(build("\"two\""));
  EXPECT_EQ(problemOf(*transport, rangeOf(20, 10)), FetchProblem::Fatal);
  EXPECT_NE(message_.find("another build"), std::string::npos) << message_;
  // What was never asked for has no build yet.
  EXPECT_FALSE(problemOf(*transport, {"imagery.pmtiles", 0, 10, false, file().size()}));
  server.setScript([](const Request&) { return ScriptedServer::reply(404, "", ""); });
  EXPECT_EQ(problemOf(*transport, rangeOf(20, 10)), FetchProblem::Fatal);
  EXPECT_EQ(problemOf(*transport, {"imagery.pmtiles", 9, 1, false, file().size() + 1}), FetchProblem::Fatal);
}

TEST_F(HttpTransportTest, ALineThatBreaksMayBeTriedAgain) {
  auto server = std::make_unique<ScriptedServer>([](const Request&) {
    Reply reply;
    reply.resets = true;
    return reply;
  });
  const int port = server->port();
  const auto transport = openTransport(server->url());
  EXPECT_EQ(problemOf(*transport, rangeOf(0, 10)), FetchProblem::Unreachable);
  for (const bool resets : {true, false}) {
    server->setScript([resets](const Request& request) {
      Reply reply = ScriptedServer::honest(request, file());
      reply.bytes.resize(reply.bytes.size() - 1000);
      (resets ? reply.resets : reply.closes) = true;
      return reply;
    });
    EXPECT_EQ(problemOf(*transport, rangeOf(0, 100000)), FetchProblem::Malformed);
  }
  server.reset();
  EXPECT_EQ(problemOf(*transport, rangeOf(0, 10)), FetchProblem::Unreachable);
  EXPECT_NE(message_.find("127.0.0.1"), std::string::npos) << message_;
  server = std::make_unique<ScriptedServer>(
      [](const Request& request) { return ScriptedServer::honest(request, file()); }, port);
  EXPECT_EQ(textOf(fetchOne(*transport, rangeOf(5, 10))), file().substr(5, 10));
}

TEST_F(HttpTransportTest, AServerThatStandsStillIsGivenUp) {
  ScriptedServer server([](const Request& request) {
    Reply reply = ScriptedServer::honest(request, file());
    reply.bytes.resize(reply.bytes.size() / 2);
    reply.hangs = true;
    return reply;
  });
  const auto transport = openHttpTransport(server.url(), 8, 1.0);
  EXPECT_EQ(problemOf(*transport, rangeOf(0, 10000)), FetchProblem::Malformed);
}

TEST_F(HttpTransportTest, RedirectionsAreFollowedAFewAndOnlyOverHttp) {
  ScriptedServer other(
      [](const Request& request) { return ScriptedServer::honest(request, file(), "ETag: \"there\"\r\n"); });
  ScriptedServer server([&](const Request& request) {
    return ScriptedServer::reply(
        302, "ETag: \"here\"\r\nLocation: " + other.url("/far") + request.target + "\r\n", "go there");
  });
  const auto transport = openTransport(server.url());
  EXPECT_EQ(textOf(fetchOne(*transport, rangeOf(5, 10))), file().substr(5, 10));
  EXPECT_EQ(textOf(fetchOne(*transport, rangeOf(15, 10))), file().substr(15, 10));
  EXPECT_EQ(other.requests().back().target, "/far/made/elevation.pmtiles");
  for (const char* to : {"ftp://127.0.0.1/made", "file:///etc/passwd", "/made/elevation.pmtiles"}) {
    server.setScript([to](const Request&) {
      return ScriptedServer::reply(302, std::string("Location: ") + to + "\r\n", "");
    });
    EXPECT_EQ(problemOf(server, rangeOf(0, 10)), FetchProblem::Fatal) << to;
  }
}

TEST_F(HttpTransportTest, WhatIsCancelledNeverComes) {
  ScriptedServer server([](const Request& request) {
    if (request.field("range") == "bytes=5-14") return ScriptedServer::honest(request, file());
    Reply reply;
    reply.hangs = true;
    return reply;
  });
  const auto transport = openTransport(server.url());
  transport->start(1000, rangeOf(100, 10));
  while (server.requests().empty()) std::this_thread::yield();
  transport->cancel(1000);
  // The connection is free for another: fetchOne() would see the cancelled one's answer.
  EXPECT_EQ(textOf(fetchOne(*transport, rangeOf(5, 10))), file().substr(5, 10));
}

TEST_F(HttpTransportTest, AddressesThatAreNone) {
  for (const char* url : {"http://bad host/", "https://[::1"}) {
    const auto transport = openTransport(url);
    EXPECT_EQ(problemOf(*transport, rangeOf(0, 10)), FetchProblem::Fatal) << url;
  }
  const auto nowhere = openTransport("http://nowhere.invalid/made");
  EXPECT_EQ(problemOf(*nowhere, rangeOf(0, 10)), FetchProblem::Unreachable);
  EXPECT_NE(message_.find("nowhere.invalid"), std::string::npos) << message_;
}

}  // namespace
}  // namespace terrane
