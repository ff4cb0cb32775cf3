#include "terrane/dataset/hash.h"

#include <gtest/gtest.h>

namespace terrane {
namespace {

/// Messages of 0 to 299 bytes: one to five blocks, with the padding at every place. Python's hashlib says the
/// same of sha256 over "".join(sha256(bytes((7 * i + n) % 256 for i in range(n))).hexdigest() for n in
/// range(300)).
TEST(Sha256, KnowsMessagesOfEveryLength) {
  std::string digests;
  for (int n = 0; n < 300; ++n) {
    std::string message;
    for (int i = 0; i < n; ++i) message.push_back(static_cast<char>((7 * i + n) % 256));
    digests += sha256(message);
  }
  EXPECT_EQ(sha256(digests), "def85da8f53f8ad58eda585dce61c0d7bfbb3da6924badae49d32d11288c576f");
}

/// An example of FIPS 180-4's first edition.
TEST(Sha256, KnowsALongMessage) {
  EXPECT_EQ(sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace
}  // namespace terrane
