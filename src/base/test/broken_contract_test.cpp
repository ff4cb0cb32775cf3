#include <gtest/gtest.h>

#include "terrane/base/result.h"

namespace terrane {
namespace {

TEST(Result, AskingAFailedResultForItsValueIsABrokenContract) {
  const Result<int> failed = makeError("'{}' is not a digit", 'x');
  EXPECT_DEATH((void)failed.value(), "'x' is not a digit");
}

}  // namespace
}  // namespace terrane
