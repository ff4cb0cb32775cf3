#include "terrane/serve/request_target.h"

#include <gtest/gtest.h>

namespace terrane::serve {
namespace {

using Path = std::vector<std::string>;

TEST(RequestTarget, IsTakenApartAndDecodedOnce) {
  const auto target = readTarget("/d/mont%20blanc/elevation?points=1%2C2;3,4&crs=EPSG:4326&empty=&alone");
  ASSERT_TRUE(target.ok()) << target.error().message;
  EXPECT_EQ(target->path, (Path{"d", "mont blanc", "elevation"}));
  ASSERT_NE(target->find("points"), nullptr);
  EXPECT_EQ(*target->find("points"), "1,2;3,4");
  EXPECT_EQ(*target->find("crs"), "EPSG:4326");
  EXPECT_EQ(*target->find("empty"), "");
  EXPECT_EQ(*target->find("alone"), "");
  EXPECT_EQ(target->find("point"), nullptr);

  EXPECT_EQ(readTarget("/")->path, Path{});
  EXPECT_EQ(readTarget("http://example.org/healthz")->path, Path{"healthz"});
  EXPECT_TRUE(readTarget("/d/a/")->trailingSlash);
  // Decoded once: "%252e" is a name with a percent sign, and there is none of it.
  EXPECT_EQ(readTarget("/d/%252e%252e/x")->path, (Path{"d", "%2e%2e", "x"}));
}

TEST(RequestTarget, RefusesWhatCouldClimbOrMislead) {
  for (const char* text : {"",
                           "d/a",
                           "*",
                           "//",
                           "/d//a",
                           "/d/a//",
                           "/../etc/passwd",
                           "/d/../../etc/passwd",
                           "/d/./a",
                           "/d/%2e%2e/a",
                           "/d/..%2fa",
                           "/d/a%2Fb",
                           "/d/a%5cb",
                           "/d/a\\b",
                           "/d/%00",
                           "/d/a%0d%0aX: y",
                           "/d/%",
                           "/d/%4",
                           "/d/%zz",
                           "/d/a#b",
                           "/d/a?x=%",
                           "/d/a?x=1&x=2",
                           "/d/a?x=%00",
                           "http://example.org",
                           "ftp://example.org/a",
                           "/1/2/3/4/5/6/7/8/9/10/11/12/13/14/15/16/17"})
    EXPECT_FALSE(readTarget(text).ok()) << text;
  std::string many = "/a?";
  for (int i = 0; i < 17; ++i) many += "p" + std::to_string(i) + "=1&";
  EXPECT_FALSE(readTarget(many).ok());
}

}  // namespace
}  // namespace terrane::serve
