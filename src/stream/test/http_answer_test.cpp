#include "http_answer.h"

#include <gtest/gtest.h>

#include "dataset_url.h"

namespace terrane {
namespace {

TEST(DatasetUrl, FilesLieBesideTheManifestAndKeepTheQuery) {
  for (const char* url :
       {"https://host:8/a/b.terrane", "https://host:8/a/b.terrane/", "https://host:8/a/b.terrane//",
        "https://host:8/a/b.terrane/manifest.json", "https://host:8/a/b.terrane/manifest.json#top"}) {
    EXPECT_EQ(parseDatasetUrl(url).fileUrl("x"), "https://host:8/a/b.terrane/x") << url;
  }
  for (const char* url :
       {"http://host/b?key=1/2&t=3", "http://host/b/?key=1/2&t=3", "http://host/b/manifest.json?key=1/2&t=3"})
    EXPECT_EQ(parseDatasetUrl(url).fileUrl("x"), "http://host/b/x?key=1/2&t=3") << url;
  EXPECT_EQ(parseDatasetUrl("http://host").fileUrl("x"), "http://host/x");
  EXPECT_EQ(parseDatasetUrl("http://host/").fileUrl("x"), "http://host/x");
  EXPECT_EQ(parseDatasetUrl("http://host/manifest.json").fileUrl("x"), "http://host/x");
  EXPECT_EQ(parseDatasetUrl("http://").fileUrl("x"), "http:///x");
}

TEST(DatasetUrl, WhatMayBeSecretIsNotShown) {
  EXPECT_EQ(parseDatasetUrl("https://me:pass@host/a@b/?signature=s").shown, "https://host/a@b");
  EXPECT_EQ(parseDatasetUrl("https://me:pass@host/a").fileUrl("x"), "https://me:pass@host/a/x");
  EXPECT_EQ(parseDatasetUrl("https://host/a@b").shown, "https://host/a@b");
}

TEST(ContentRange, IsReadOrRefused) {
  const auto range = parseContentRange(" bytes 100-199/5000");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 100U);
  EXPECT_EQ(range->last, 199U);
  EXPECT_EQ(range->fileBytes, 5000U);
  EXPECT_FALSE(parseContentRange("bytes 0-9/*")->fileBytes);
  for (const char* wrong : {"", "bytes", "bytes */5000", "bytes 5-4/9", "bytes -4/9", "bytes 1/9",
                            "items 0-1/9", "bytes 99999999999999999999-3/9", "bytes 0-1"})
    EXPECT_FALSE(parseContentRange(wrong)) << wrong;
}

class HttpAnswerTest : public ::testing::Test {
 protected:
  static HttpAnswer part(uint64_t first, uint64_t bytes, uint64_t fileBytes,
                         const std::string& etag = "\"a\"") {
    HttpAnswer answer;
    answer.status = 206;
    answer.range = ContentRange{first, first + bytes - 1, fileBytes};
    answer.etag = etag;
    answer.bodyBytes = bytes;
    return answer;
  }
  static HttpAnswer withStatus(int status) {
    HttpAnswer answer;
    answer.status = status;
    return answer;
  }
  std::optional<FetchProblem> judge(const HttpAnswer& answer) {
    const auto failure = judgeHttpAnswer("there", request_, answer, known_);
    if (!failure) return {};
    EXPECT_EQ(failure->message.rfind("there: ", 0), 0U);
    return failure->problem;
  }

  FetchRequest request_{"elevation.pmtiles", 100, 50, false, 5000};
  KnownFile known_;
};

TEST_F(HttpAnswerTest, ARangeIsTheOneThatWasAskedFor) {
  EXPECT_FALSE(judge(part(100, 50, 5000)));
  EXPECT_TRUE(known_.hasRanges);
  EXPECT_EQ(judge(part(101, 50, 5000)), FetchProblem::Malformed);
  EXPECT_EQ(judge(part(100, 49, 5000)), FetchProblem::Malformed);
  HttpAnswer wrong = part(100, 50, 5000);
  wrong.bodyBytes = 49;
  EXPECT_EQ(judge(wrong), FetchProblem::Malformed);
  wrong = part(100, 50, 5000);
  wrong.isCutOff = true;
  EXPECT_EQ(judge(wrong), FetchProblem::Malformed);
  wrong.range.reset();
  EXPECT_EQ(judge(wrong), FetchProblem::Malformed);
}

TEST_F(HttpAnswerTest, AServerWithoutRangesIsHopelessOneThatForgotThemOnceIsNot) {
  HttpAnswer whole = withStatus(200);
  whole.isCutOff = true;
  EXPECT_EQ(judge(whole), FetchProblem::Fatal);
  HttpAnswer packed = part(100, 50, 5000);
  packed.isEncoded = true;
  EXPECT_EQ(judge(packed), FetchProblem::Fatal);
  EXPECT_FALSE(judge(part(100, 50, 5000)));
  EXPECT_EQ(judge(whole), FetchProblem::Malformed);
  EXPECT_EQ(judge(packed), FetchProblem::Malformed);
  // All of a small file is a whole file.
  request_ = {"elevation.pmtiles", 0, 5000, false, 5000};
  whole.isCutOff = false;
  whole.bodyBytes = 5000;
  EXPECT_FALSE(judge(whole));
  request_.bytes = 4000;
  whole.bodyBytes = 4000;
  EXPECT_EQ(judge(whole), FetchProblem::Malformed);
}

TEST_F(HttpAnswerTest, AnotherBuildIsNeverMixedIn) {
  EXPECT_EQ(judge(part(100, 50, 5001)), FetchProblem::Fatal);
  EXPECT_FALSE(judge(part(100, 50, 5000, "\"a\"")));
  EXPECT_FALSE(judge(part(100, 50, 5000, "W/\"a\"")));
  EXPECT_EQ(judge(part(100, 50, 5000, "\"b\"")), FetchProblem::Fatal);
  EXPECT_EQ(judge(part(100, 50, 5001, "\"a\"")), FetchProblem::Fatal);
  for (const int gone : {404, 410, 416}) EXPECT_EQ(judge(withStatus(gone)), FetchProblem::Fatal);

  // Where there are no entity tags, the date tells.
  known_ = {};
  HttpAnswer dated = part(100, 50, 5000, "");
  dated.lastModified = "Mon, 23 Nov 2026 10:00:00 GMT";
  EXPECT_FALSE(judge(dated));
  dated.lastModified = "Mon, 23 Nov 2026 10:00:01 GMT";
  EXPECT_EQ(judge(dated), FetchProblem::Fatal);
}

TEST_F(HttpAnswerTest, RefusalsSayWhetherToTryAgain) {
  for (const int missing : {400, 401, 403, 404, 410, 416, 304, 302, 204})
    EXPECT_EQ(judge(withStatus(missing)), FetchProblem::Missing) << missing;
  for (const int busy : {408, 429, 500, 502, 503, 504})
    EXPECT_EQ(judge(withStatus(busy)), FetchProblem::Busy) << busy;
  EXPECT_FALSE(judge(part(100, 50, 5000)));
  EXPECT_EQ(judge(withStatus(403)), FetchProblem::Busy);
  HttpAnswer later = withStatus(503);
  later.retryAfterSeconds = 1e9;
  EXPECT_EQ(judgeHttpAnswer("there", request_, later, known_)->retryAfterSeconds, 120.0);
}

}  // namespace
}  // namespace terrane
