#include "terrane/serve/metrics.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>

#include "terrane/serve/access_log.h"

namespace terrane::serve {
namespace {

TEST(Metrics, CountByRouteStatusAndTime) {
  Metrics metrics;
  metrics.count(Route::Tile, 200, 1000, 0.00005);
  metrics.count(Route::Tile, 200, 1000, 0.02);
  metrics.count(Route::Query, 413, 50, 100.0);
  metrics.connections = 3;
  const std::string text = metrics.text();
  for (const char* line :
       {"terrane_requests_total{route=\"tile\",status=\"200\"} 2\n",
        "terrane_requests_total{route=\"query\",status=\"413\"} 1\n", "terrane_sent_bytes_total 2050\n",
        "terrane_connections 3\n", "terrane_request_seconds_bucket{le=\"0.0001\"} 1\n",
        "terrane_request_seconds_bucket{le=\"0.03\"} 2\n", "terrane_request_seconds_bucket{le=\"10\"} 2\n",
        "terrane_request_seconds_bucket{le=\"+Inf\"} 3\n", "terrane_request_seconds_count 3\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "\n" << text;
}

TEST(AccessLog, LinesCannotBeBrokenByWhatIsSent) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  AccessLog log(ends[1]);
  log.write({"127.0.0.1", "GET", "/a\"b\nc\\d", 404, 17, 0.25});
  std::array<char, 500> text{};
  const ssize_t bytes = read(ends[0], text.data(), text.size());
  close(ends[0]);
  const std::string line(text.data(), static_cast<size_t>(std::max<ssize_t>(bytes, 0)));
  EXPECT_EQ(line.rfind("127.0.0.1 - - [", 0), 0U);
  EXPECT_NE(line.find("\"GET /a\\x22b\\x0ac\\x5cd HTTP/1.1\" 404 17 0.250000\n"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), line.size() - 1);
}

}  // namespace
}  // namespace terrane::serve
