#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>

#include "random_bytes.h"
#include "temporary_directory.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

TEST(Pmtiles, ADiskThatIsFullIsAnErrorAndLeavesNothing) {
  TemporaryDirectory directory;
  const std::string path = directory.file("large.pmtiles");
  std::mt19937 random(9);

  // A limit on the size of files stands for the disk; the signal that comes with it is not wanted.
  const auto oldHandler = ::signal(SIGXFSZ, SIG_IGN);
  rlimit oldLimit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &oldLimit), 0);
  const rlimit tight{50'000, oldLimit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  Status status;
  {
    auto writer = PmtilesWriter::create(path);
    ASSERT_TRUE(writer.ok());
    for (uint64_t id = 0; id < 100 && status.ok(); ++id) {
      const auto place = writer->add(tileIdFromPmtiles(id), randomBytes(1000, random));
      if (!place.ok()) status = place.error();
    }
    if (status.ok()) status = writer->finish("{}");
  }
  ::setrlimit(RLIMIT_FSIZE, &oldLimit);
  ::signal(SIGXFSZ, oldHandler);

  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("large.pmtiles: cannot write"), std::string::npos)
      << status.error().message;
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace terrane
