#include "terrane/measure/bench_result.h"

#include <gtest/gtest.h>

namespace terrane {
namespace {

BenchResult result() {
  BenchResult out;
  out.bench = "error";
  out.rows = {{{"dataset", "alps"}, {"tau", 1.0}, {"pixels", 12345}},
              {{"dataset", "sea"}, {"tau", 2.0}, {"pixels", 9}}};
  out.bars = {{"max_error_over_tau", 0.93, "", 1.0}, {"cracks_resident", 1, "pixels", 0}};
  return out;
}

TEST(BenchResult, HasTheAgreedMembers) {
  const auto json = result().toJson();
  EXPECT_EQ(json["bench"], "error");
  EXPECT_FALSE(json["machine"].get<std::string>().empty());
  EXPECT_EQ(json["rows"].size(), 2U);
  EXPECT_EQ(json["bars"][0]["name"], "max_error_over_tau");
  EXPECT_EQ(json["bars"][0]["holds"], true);
  EXPECT_EQ(json["bars"][1]["value"], 1.0);
  EXPECT_EQ(json["bars"][1]["bar"], 0.0);
  EXPECT_EQ(json["bars"][1]["unit"], "pixels");
  EXPECT_EQ(json["bars"][1]["holds"], false);
  EXPECT_FALSE(result().allHold());
}

TEST(BenchResult, PrintsATable) {
  EXPECT_EQ(result().toTable(),
            "dataset  tau  pixels\n"
            "alps       1  12,345\n"
            "sea        2       9\n"
            "\n"
            "bar                    value   at most\n"
            "max_error_over_tau      0.93         1  holds\n"
            "cracks_resident     1 pixels  0 pixels  DOES NOT HOLD\n");
}

}  // namespace
}  // namespace terrane
