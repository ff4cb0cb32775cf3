#include "terrane/base/result.h"

#include <gtest/gtest.h>

#include "terrane/base/format_number.h"

namespace terrane {
namespace {

Result<int> parseDigit(char c) {
  if (c < '0' || c > '9') return makeError("'{}' is not a digit", c);
  return c - '0';
}

Result<int> addDigits(char a, char b) {
  TERRANE_ASSIGN(const int first, parseDigit(a));
  TERRANE_ASSIGN(const int second, parseDigit(b));
  return first + second;
}

Status checkDigit(char c) {
  TERRANE_TRY(parseDigit(c));
  return {};
}

TEST(Result, CarriesValuesAndErrorsThroughCallers) {
  EXPECT_EQ(*addDigits('3', '4'), 7);
  ASSERT_FALSE(addDigits('3', 'x').ok());
  EXPECT_EQ(addDigits('3', 'x').error().message, "'x' is not a digit");
  EXPECT_TRUE(checkDigit('1').ok());
  EXPECT_FALSE(checkDigit('?').ok());
}

TEST(FormatNumber, ReadsWell) {
  EXPECT_EQ(formatBytes(17), "17 bytes");
  EXPECT_EQ(formatBytes(1500), "1.50 kB");
  EXPECT_EQ(formatBytes(999'999), "1.00 MB");
  EXPECT_EQ(formatBytes(312'000'000), "312 MB");
  EXPECT_EQ(formatDuration(0.85), "850 ms");
  EXPECT_EQ(formatDuration(200), "3 min 20 s");
  EXPECT_EQ(formatCount(12345678), "12,345,678");
  EXPECT_EQ(formatCount(-1234), "-1,234");
  EXPECT_EQ(formatCount(12), "12");
}

}  // namespace
}  // namespace terrane
