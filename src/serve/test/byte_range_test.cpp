#include "terrane/serve/byte_range.h"

#include <gtest/gtest.h>

#include <string>

namespace terrane::serve {
namespace {

using Kind = RangeAnswer::Kind;

void expectPart(std::string_view field, uint64_t size, uint64_t offset, uint64_t length) {
  const RangeAnswer answer = readRange(field, size);
  EXPECT_EQ(answer.kind, Kind::Part) << field;
  EXPECT_EQ(answer.offset, offset) << field;
  EXPECT_EQ(answer.length, length) << field;
}

TEST(ByteRange, GivesTheBytesThatAreAskedFor) {
  expectPart("bytes=0-0", 100, 0, 1);
  expectPart("bytes=10-19", 100, 10, 10);
  expectPart("bytes=90-", 100, 90, 10);
  expectPart("bytes=-7", 100, 93, 7);
  expectPart("bytes=-700", 100, 0, 100);
  expectPart("bytes=50-5000", 100, 50, 50);
  expectPart("Bytes = 1-2", 100, 1, 2);
  expectPart("bytes=5-99999999999999999999999999", 100, 5, 95);
  expectPart("bytes=-99999999999999999999999999", 100, 0, 100);
}

TEST(ByteRange, BeyondTheEndIsUnsatisfiable) {
  for (const char* field : {"bytes=100-", "bytes=100-200", "bytes=-0", "bytes=18446744073709551615-",
                            "bytes=99999999999999999999999-99999999999999999999999"})
    EXPECT_EQ(readRange(field, 100).kind, Kind::Unsatisfiable) << field;
  EXPECT_EQ(readRange("bytes=-5", 0).kind, Kind::Unsatisfiable);
  EXPECT_EQ(readRange("bytes=0-", 0).kind, Kind::Unsatisfiable);
}

TEST(ByteRange, WhatMakesNoSenseOrIsSeveralIsAnsweredWhole) {
  std::string many = "bytes=0-0";
  for (int i = 1; i < 10000; ++i) many += "," + std::to_string(i) + "-" + std::to_string(i);
  for (const std::string& field :
       {std::string(""), std::string("bytes"), std::string("bytes="), std::string("bytes=-"),
        std::string("bytes=a-b"), std::string("bytes=5"), std::string("bytes=9-5"), std::string("lines=1-2"),
        std::string("bytes=1-2-3"), std::string("bytes=+1-2"), std::string("bytes=0x1-0x2"),
        std::string("bytes=1-2,4-5"), many})
    EXPECT_EQ(readRange(field, 100).kind, Kind::Whole) << field.substr(0, 40);
}

TEST(EntityTags, MatchStronglyAndWeakly) {
  EXPECT_TRUE(matchesEtag("\"a\"", "\"a\"", false));
  EXPECT_TRUE(matchesEtag("\"b\" , \"a\"", "\"a\"", false));
  EXPECT_TRUE(matchesEtag("*", "\"a\"", false));
  EXPECT_TRUE(matchesEtag("W/\"a\"", "\"a\"", true));
  EXPECT_FALSE(matchesEtag("W/\"a\"", "\"a\"", false));
  EXPECT_FALSE(matchesEtag("\"ab\"", "\"a\"", true));
  EXPECT_FALSE(matchesEtag("a", "\"a\"", true));
  EXPECT_FALSE(matchesEtag("", "\"a\"", true));
  EXPECT_FALSE(matchesEtag(",,,", "\"a\"", true));
}

TEST(AcceptEncoding, TakesGzipWhereItIsNamed) {
  for (const char* field : {"gzip", "deflate, GZIP;q=0.5", "br,*;q=0.1", "x-gzip", "identity;q=0, *"})
    EXPECT_TRUE(acceptsGzip(field)) << field;
  for (const char* field : {"", "br", "gzip;q=0", "gzip; q=0.000", "*;q=0", "*, gzip;q=0", "gzipped"})
    EXPECT_FALSE(acceptsGzip(field)) << field;
}

}  // namespace
}  // namespace terrane::serve
