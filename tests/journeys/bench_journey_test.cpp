#include <nlohmann/json.hpp>

#include "http_dataset.h"

/// `terrane bench --policy`: a flight over a simulated line.
namespace terrane {
namespace {

class BenchJourney : public HttpDatasetTest {
 protected:
  static nlohmann::json bench(const std::string& policy, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {
        "bench",
        directory(),
        "--flight",
        std::string(TERRANE_SOURCE_DIR) + "/bench/measure_stream/flight.json",
        "--policy",
        policy,
        "--json",
        "--size",
        "320x180",
        "--fps",
        "5",
        "-o",
        folder_->file(policy + ".json"),
        "--overwrite",
        "--software"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Program program(arguments, Program::Hears::Errors);
    const std::string said = program.everything();
    EXPECT_EQ(program.wait(), 0) << said;
    return nlohmann::json::parse(readWholeFile(folder_->file(policy + ".json")), nullptr, false);
  }
};

TEST_F(BenchJourney, PoliciesAreFlownOverTheSameLine) {
  const auto available = bench("available"), progressive = bench("progressive"),
             allAtOnce = bench("all-at-once");
  EXPECT_EQ(available["policy"], "available");
  EXPECT_EQ(available["line"]["bytes_per_second"], 5e6);
  EXPECT_EQ(available["line"]["latency_s"], 0.05);
  EXPECT_EQ(available["frames"].size(), 51U);
  const double debt = available["summary"]["debt_px_s"];
  EXPECT_GT(debt, 0.0);
  EXPECT_LT(debt, 0.7 * progressive["summary"]["debt_px_s"].get<double>());
  EXPECT_LT(debt, 0.7 * allAtOnce["summary"]["debt_px_s"].get<double>());
  // Simulated time is the same in every run.
  EXPECT_EQ(bench("available")["frames"], available["frames"]);
  // A thinner line owes more.
  const auto thin = bench("available", {"--line", "500kbit/s,0.2s"});
  EXPECT_EQ(thin["line"]["bytes_per_second"], 62500.0);
  EXPECT_GT(thin["summary"]["debt_px_s"].get<double>(), debt);
  EXPECT_LT(thin["summary"]["bytes"], available["summary"]["bytes"]);
}

TEST_F(BenchJourney, DrawnFramesHaveNoCracks) {
  const auto drawn =
      bench("available", {"--reference", "--reference-every", "2", "--line", "300kbit/s,50ms"});
  EXPECT_EQ(drawn["summary"]["cracks"], 0);
  EXPECT_GT(drawn["summary"]["crack_pixels"], 100000);
  EXPECT_GT(drawn["summary"]["true_px_s"], 0.0);
}

}  // namespace
}  // namespace terrane
