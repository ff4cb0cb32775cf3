#include "terrane/measure/bench_result.h"

#include <gtest/gtest.h>

#include <fstream>

#include "temporary_directory.h"

namespace terrane {
namespace {

BenchResult result() {
  BenchResult out;
  out.bench = "error";
  out.rows = {{{"dataset", "alps"}, {"tau", 1.0}, {"pixels", 12345}},
              {{"dataset", "sea"}, {"tau", 2.0}, {"pixels", 9}}};
  out.bars = {{"max_error_over_tau", 0.93, "", 1.0},
              {"cracks_resident", 1, "pixels", 0},
              {"speed", 9, "", 8, Bar::Side::AtLeast}};
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
  EXPECT_EQ(json["bars"][1]["side"], "at most");
  EXPECT_EQ(json["bars"][2]["side"], "at least");
  EXPECT_EQ(json["bars"][2]["holds"], true);
  EXPECT_FALSE(result().allHold());
}

TEST(BenchResult, PrintsATable) {
  EXPECT_EQ(result().toTable(),
            "dataset  tau  pixels\n"
            "alps       1  12,345\n"
            "sea        2       9\n"
            "\n"
            "bar                    value           must be\n"
            "max_error_over_tau      0.93         at most 1  holds\n"
            "cracks_resident     1 pixels  at most 0 pixels  DOES NOT HOLD\n"
            "speed                      9        at least 8  holds\n");
}

TEST(BenchResult, EndsWithAFileAndAnErrorWhereABarDoesNotHold) {
  const TemporaryDirectory folder;
  const std::string path = folder.file("error.json");
  EXPECT_FALSE(finishBench(result(), path, {{"best_k", 5}}).ok());
  std::ifstream file(path);
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["best_k"], 5);
  EXPECT_EQ(json["bench"], "error");
  BenchResult good = result();
  good.bars.pop_back();
  good.bars.pop_back();
  EXPECT_TRUE(finishBench(good, path).ok());
  EXPECT_FALSE(finishBench(good, folder.file("no/such/folder.json")).ok());
}

TEST(BenchResult, AProgramEndsWithAStatus) {
  char name[] = "bench", argument[] = "a";
  char* arguments[] = {name, argument};
  std::vector<std::string> given;
  const auto run = [&](const std::vector<std::string>& all) {
    given = all;
    return Status();
  };
  EXPECT_EQ(benchMain("bench", 2, arguments, run), 0);
  EXPECT_EQ(given, std::vector<std::string>{"a"});
  const auto fail = [](const std::vector<std::string>&) { return Status(makeError("no")); };
  EXPECT_EQ(benchMain("bench", 1, arguments, fail), 1);
}

TEST(Bar, HoldsOnItsSide) {
  EXPECT_TRUE((Bar{"a", 8.0, "", 8.0}.holds()));
  EXPECT_FALSE((Bar{"a", 8.1, "", 8.0}.holds()));
  EXPECT_TRUE((Bar{"a", 8.0, "", 8.0, Bar::Side::AtLeast}.holds()));
  EXPECT_FALSE((Bar{"a", 7.9, "", 8.0, Bar::Side::AtLeast}.holds()));
}

}  // namespace
}  // namespace terrane
