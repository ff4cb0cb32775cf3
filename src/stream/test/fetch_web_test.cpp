#include <emscripten.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "terrane/stream/transport.h"

/// The browser's side of HTTP, against a server in the same node. What the answers mean is
/// http_answer_test.cpp's; here it is that they arrive as they are, and that nothing comes of what is not
/// wanted.

// A server whose first part of a path says how it answers. Every file has the same kServedBytes bytes.
// clang-format off
EM_JS(void, start_server, (int fileBytes), {
  const http = require("http");
  const file = Buffer.from(Uint8Array.from({ length: fileBytes }, (_, i) => (i * 37 + (i >> 8)) % 251));
  const state = Module["served"] = { underway: 0, most: 0, requests: 0, aborted: 0, cache: "", port: 0 };
  const answers = {
    "honest": (request, response, first, last) => {
      if (first === null) return response.writeHead(200, { "ETag": "\"one\"" }).end(file);
      response.writeHead(206, { "Content-Range": "bytes " + first + "-" + last + "/" + fileBytes, "ETag": "\"one\"" });
      response.end(file.subarray(first, last + 1));
    },
    "changing": (request, response, first, last) => {
      response.writeHead(206, { "Content-Range": "bytes " + first + "-" + last + "/" + fileBytes,
        "ETag": "\"" + state.requests + "\"" });
      response.end(file.subarray(first, last + 1));
    },
    "whole": (request, response) => response.writeHead(200).end(file),
    "other": (request, response, first, last) => {
      response.writeHead(206, { "Content-Range": "bytes " + (first + 1) + "-" + (last + 1) + "/" + fileBytes });
      response.end(file.subarray(first + 1, last + 2));
    },
    "silent": (request, response, first, last) => response.writeHead(206).end(file.subarray(first, last + 1)),
    "long": (request, response, first, last) => {
      response.writeHead(206, { "Content-Range": "bytes " + first + "-" + last + "/" + fileBytes });
      response.end(Buffer.concat([file.subarray(first, last + 1), file]));
    },
    "broken": (request, response, first, last) => {
      response.writeHead(206, { "Content-Range": "bytes " + first + "-" + last + "/" + fileBytes,
        "Content-Length": last - first + 1 });
      response.write(file.subarray(first, first + 100), () => response.destroy());
    },
    "missing": (request, response) => response.writeHead(404).end("no such file"),
    "busy": (request, response) => response.writeHead(503, { "Retry-After": "7" }).end(),
    "hanging": () => {},
  };
  const server = http.createServer((request, response) => {
    ++state.requests;
    state.most = Math.max(state.most, ++state.underway);
    state.cache = request.headers["cache-control"] || "";
    response.on("close", () => {
      --state.underway;
      if (!response.writableEnded) ++state.aborted;
    });
    const range = (request.headers["range"] || "").replace("bytes=", "").split("-");
    const answer = answers[request.url.split("/")[1]];
    if (range.length === 2) answer(request, response, Number(range[0]), Number(range[1]));
    else answer(request, response, null, null);
  });
  server.listen(0, "127.0.0.1", () => { state.port = server.address().port; });
});
EM_JS(int, server_number, (const char* name), { return Module["served"][UTF8ToString(name)]; });
EM_JS(bool, server_cache_is, (const char* value), { return Module["served"]["cache"] === UTF8ToString(value); });
// clang-format on

namespace terrane {
namespace {

constexpr int kServedBytes = 300000;

uint8_t servedByte(uint64_t i) {
  return static_cast<uint8_t>((i * 37 + (i >> 8)) % 251);
}
bool isServed(const std::vector<uint8_t>& bytes, uint64_t offset) {
  for (size_t i = 0; i < bytes.size(); ++i)
    if (bytes[i] != servedByte(offset + i)) return false;
  return true;
}

class FetchWebTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    start_server(kServedBytes);
    ASSERT_TRUE(until([] { return server_number("port") > 0; }));
  }
  /// What an earlier test has left must have ended.
  void SetUp() override {
    ASSERT_TRUE(until([] { return server_number("underway") == 0; }));
  }
  /// Gives way to the server and the answers until something is so; false after a minute.
  template <class Condition>
  static bool until(const Condition& isSo) {
    const double deadline = emscripten_get_now() + 60e3;
    while (!isSo()) {
      if (emscripten_get_now() > deadline) return false;
      emscripten_sleep(0);
    }
    return true;
  }
  static std::string url(const std::string& how) {
    return fmt::format("http://127.0.0.1:{}/{}/made.terrane", server_number("port"), how);
  }
  static FetchRequest rangeOf(uint64_t offset, uint64_t bytes) {
    return {"elevation.pmtiles", offset, bytes, false, kServedBytes};
  }
  static FetchAnswer fetch(Transport& transport, const FetchRequest& request) {
    static uint64_t lastId = 0;
    const uint64_t id = ++lastId;
    transport.start(id, request);
    std::vector<FetchAnswer> answers;
    EXPECT_TRUE(until([&] {
      answers = transport.poll(0.0);
      return !answers.empty();
    }));
    if (answers.size() != 1 || answers[0].id != id) {
      ADD_FAILURE() << answers.size() << " answers";
      return {};
    }
    return std::move(answers[0]);
  }
  static FetchFailure failureOf(const std::string& how, const FetchRequest& request,
                                double stallSeconds = 10.0) {
    const auto transport = openHttpTransport(url(how), 8, stallSeconds);
    const FetchAnswer answer = fetch(*transport, request);
    EXPECT_TRUE(answer.bytes.empty());
    if (answer.failure) return *answer.failure;
    ADD_FAILURE() << how << " is no failure";
    return {};
  }
};

TEST_F(FetchWebTest, RangesAndWholeFilesCome) {
  const auto transport = openHttpTransport(url("honest") + "/");
  const FetchAnswer part = fetch(*transport, rangeOf(70000, 5000));
  EXPECT_FALSE(part.failure) << part.failure->message;
  EXPECT_EQ(part.bytes.size(), 5000U);
  EXPECT_TRUE(isServed(part.bytes, 70000));
  EXPECT_TRUE(server_cache_is(""));
  const FetchAnswer whole = fetch(*transport, {"manifest.json", 0, 0, false, 0});
  EXPECT_EQ(whole.bytes.size(), static_cast<size_t>(kServedBytes));
  EXPECT_TRUE(isServed(whole.bytes, 0));
  FetchRequest fresh = rangeOf(0, 10);
  fresh.fresh = true;
  EXPECT_EQ(fetch(*transport, fresh).bytes.size(), 10U);
  EXPECT_TRUE(server_cache_is("no-cache"));
}

TEST_F(FetchWebTest, ManyAtOnceAreEachTheirOwnAndNoMoreThanAllowed) {
  const int before = server_number("requests");
  const auto transport = openHttpTransport(url("honest"), 4);
  for (uint64_t id = 0; id < 100; ++id) transport->start(id, rangeOf(id * 2900, 1000 + id));
  std::map<uint64_t, size_t> come;
  ASSERT_TRUE(until([&] {
    for (const FetchAnswer& answer : transport->poll(0.0)) {
      EXPECT_FALSE(answer.failure) << answer.failure->message;
      EXPECT_TRUE(isServed(answer.bytes, answer.id * 2900)) << answer.id;
      come[answer.id] = answer.bytes.size();
    }
    return come.size() == 100;
  }));
  for (const auto& [id, bytes] : come) EXPECT_EQ(bytes, 1000 + id);
  EXPECT_EQ(server_number("requests"), before + 100);
  EXPECT_LE(server_number("most"), 4);
}

TEST_F(FetchWebTest, AnswersThatCannotBeUsedAreTold) {
  EXPECT_EQ(failureOf("missing", rangeOf(0, 100)).problem, FetchProblem::Missing);
  EXPECT_EQ(failureOf("whole", rangeOf(5000, 100)).problem, FetchProblem::Fatal);
  EXPECT_EQ(failureOf("other", rangeOf(0, 100)).problem, FetchProblem::Malformed);
  EXPECT_EQ(failureOf("long", rangeOf(0, 100)).problem, FetchProblem::Malformed);
  EXPECT_EQ(failureOf("broken", rangeOf(0, 5000)).problem, FetchProblem::Malformed);
  const FetchFailure busy = failureOf("busy", rangeOf(0, 100));
  EXPECT_EQ(busy.problem, FetchProblem::Busy);
  EXPECT_EQ(busy.retryAfterSeconds, 7.0);
  EXPECT_NE(busy.message.find("/busy/made.terrane/elevation.pmtiles"), std::string::npos) << busy.message;
}

TEST_F(FetchWebTest, AnotherBuildIsNoticed) {
  const auto transport = openHttpTransport(url("changing"));
  EXPECT_FALSE(fetch(*transport, rangeOf(0, 100)).failure);
  const FetchAnswer second = fetch(*transport, rangeOf(0, 100));
  ASSERT_TRUE(second.failure);
  EXPECT_EQ(second.failure->problem, FetchProblem::Fatal);
}

TEST_F(FetchWebTest, AServerThatIsAwayOrStandsStillIsUnreachable) {
  const auto transport = openHttpTransport("http://127.0.0.1:1/made.terrane");
  const FetchAnswer away = fetch(*transport, rangeOf(0, 100));
  ASSERT_TRUE(away.failure);
  EXPECT_EQ(away.failure->problem, FetchProblem::Unreachable);
  const FetchFailure still = failureOf("hanging", rangeOf(0, 100), 0.05);
  EXPECT_EQ(still.problem, FetchProblem::Unreachable);
  EXPECT_NE(still.message.find("0.05 s"), std::string::npos) << still.message;
}

TEST_F(FetchWebTest, WhatIsCancelledNeverComesAndMakesRoom) {
  const int aborted = server_number("aborted");
  const auto transport = openHttpTransport(url("hanging"), 1);
  const int before = server_number("requests");
  transport->start(1, rangeOf(0, 100));
  transport->start(2, rangeOf(100, 100));
  ASSERT_TRUE(until([&] { return server_number("requests") == before + 1; }));
  transport->cancel(1);
  // The connection ends, and the next one begins.
  ASSERT_TRUE(until([&] { return server_number("aborted") == aborted + 1; }));
  ASSERT_TRUE(until([&] { return server_number("requests") == before + 2; }));
  EXPECT_TRUE(transport->poll(0.0).empty());
  transport->cancel(2);
  ASSERT_TRUE(until([&] { return server_number("aborted") == aborted + 2; }));
  EXPECT_TRUE(transport->poll(0.0).empty());
}

TEST_F(FetchWebTest, ATransportEndsWithItsRequests) {
  const int aborted = server_number("aborted");
  const int before = server_number("requests");
  {
    const auto transport = openHttpTransport(url("hanging"), 8);
    for (uint64_t id = 0; id < 8; ++id) transport->start(id, rangeOf(0, 100));
    // As many as a browser would let run.
    ASSERT_TRUE(until([&] { return server_number("requests") == before + 6; }));
  }
  ASSERT_TRUE(until([&] { return server_number("aborted") == aborted + 6; }));
}

}  // namespace
}  // namespace terrane
