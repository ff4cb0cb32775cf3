#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "http_client.h"
#include "program.h"

/// The program itself: `terrane view`, from rasters to an address in the browser.
namespace terrane {
namespace {

namespace fs = std::filesystem;
using serve::HttpClient;

class ViewJourney : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new TemporaryDirectory();
    ASSERT_EQ(Program({"synth", "-o", made_->file("made.tif"), "--size", "257", "-q"}).wait(), 0);
    // What `./dev build web` makes, or an installed program has beside it.
    fs::create_directory(made_->file("viewer"));
    writeWholeFile(made_->file("viewer/index.html"), "<!doctype html><title>viewer</title>");
  }
  static void TearDownTestSuite() { delete made_; }
  void SetUp() override {
    setenv("XDG_CACHE_HOME", folder_.file("cache").c_str(), 1);
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    fs::copy_file(made_->file("made.tif"), raster());
  }
  /// A command line of `terrane view` for tests: its own viewer, any port.
  static std::vector<std::string> view(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {"view", "--viewer", made_->file("viewer"), "--port", "0", "-q"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return all;
  }
  std::string raster() const { return folder_.file("my alps.tif"); }

  /// The address of a view, and what it serves; the program ends with Ctrl-C.
  nlohmann::json viewed(const std::vector<std::string>& arguments) const {
    Program program(view(arguments));
    const std::string url = program.firstLine();
    if (url.empty()) return {};
    HttpClient client(portOf(url));
    const auto answer = client.get("/datasets.json");
    program.signal(SIGINT);
    EXPECT_EQ(program.wait(), 0);
    return answer ? nlohmann::json::parse(answer->body, nullptr, false)["datasets"] : nlohmann::json();
  }

  /// What the cache holds.
  std::vector<fs::path> places() const {
    std::vector<fs::path> out;
    std::error_code trouble;
    for (const auto& entry : fs::directory_iterator(folder_.file("cache/terrane"), trouble))
      out.push_back(entry.path());
    return out;
  }
  static void makeOld(const std::string& path, int days) {
    const time_t then = std::time(nullptr) - days * 86400;
    const timespec times[2] = {{then, 0}, {then, 0}};
    ASSERT_EQ(utimensat(AT_FDCWD, path.c_str(), times, 0), 0);
  }

  TemporaryDirectory folder_;

 private:
  static TemporaryDirectory* made_;
};
TemporaryDirectory* ViewJourney::made_ = nullptr;

TEST_F(ViewJourney, RastersAreBuiltOnceAndAgainWhenTheyChange) {
  const nlohmann::json first = viewed({raster()});
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0]["name"], "my-alps");
  ASSERT_EQ(places().size(), 1U);
  const std::string manifest = (places()[0] / "my-alps.terrane/manifest.json").string();
  const auto built = fs::last_write_time(manifest);

  EXPECT_EQ(viewed({raster()})[0]["hash"], first[0]["hash"]);
  EXPECT_EQ(fs::last_write_time(manifest), built);
  EXPECT_EQ(places().size(), 1U);

  // Other options, another raster under the same name, one more file that says where it lies.
  EXPECT_EQ(viewed({raster(), "--max-error", "5"}).size(), 1U);
  EXPECT_EQ(places().size(), 2U);
  ASSERT_EQ(Program({"synth", "-o", raster(), "--size", "257", "--seed", "9", "--overwrite", "-q"}).wait(),
            0);
  EXPECT_NE(viewed({raster()})[0]["hash"], first[0]["hash"]);
  EXPECT_EQ(places().size(), 3U);
  writeWholeFile(folder_.file("my alps.tfw"), "10\n0\n0\n-10\n500005\n6700005\n");
  EXPECT_EQ(viewed({raster()}).size(), 1U);
  EXPECT_EQ(places().size(), 4U);
}

TEST_F(ViewJourney, ADatasetThatThisProgramRefusesIsBuiltAgain) {
  const nlohmann::json first = viewed({raster()});
  ASSERT_EQ(places().size(), 1U);
  writeWholeFile((places()[0] / "my-alps.terrane/manifest.json").string(), "{}");
  const nlohmann::json again = viewed({raster()});
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0]["hash"], first[0]["hash"]);
}

TEST_F(ViewJourney, DatasetsAreViewedAsTheyAre) {
  const std::string dataset = folder_.file("made.terrane");
  ASSERT_EQ(Program({"build", raster(), "-o", dataset, "-q"}).wait(), 0);
  EXPECT_EQ(viewed({dataset})[0]["name"], "made");
  EXPECT_TRUE(places().empty());
  EXPECT_EQ(Program(view({dataset, raster()})).wait(), 2);
  EXPECT_EQ(Program(view({dataset, "--max-error", "1"})).wait(), 2);
}

TEST_F(ViewJourney, WhatCannotBeBuiltIsSaid) {
  Program program(view({folder_.file("nowhere.tif")}), Program::Hears::Errors);
  EXPECT_NE(program.everything().find("nowhere.tif: there is no such file"), std::string::npos);
  EXPECT_EQ(program.wait(), 1);
  writeWholeFile(folder_.file("broken.tif"), "II*");
  EXPECT_EQ(Program(view({folder_.file("broken.tif")})).wait(), 1);
}

TEST_F(ViewJourney, TheBrowserIsAskedToOpenTheAddress) {
  const std::string opened = folder_.file("opened");
  const std::string programs = folder_.file("programs");
  fs::create_directory(programs);
  writeWholeFile(programs + "/xdg-open",
                 "#!/bin/sh\necho \"$1\" > '" + opened + ".new'\nmv '" + opened + ".new' '" + opened + "'\n");
  fs::permissions(programs + "/xdg-open", fs::perms::owner_all);
  setenv("DISPLAY", ":99", 1);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (programs + ":" + path).c_str(), 1);
  Program program(view({raster()}));
  setenv("PATH", path.c_str(), 1);
  const std::string url = program.firstLine();
  for (int turn = 0; turn < 1000 && !fs::exists(opened); ++turn) usleep(10000);
  EXPECT_EQ(readWholeFile(opened), url + "\n");
}

TEST_F(ViewJourney, WhatNobodyUsesIsForgotten) {
  viewed({raster()});
  ASSERT_EQ(places().size(), 1U);
  const fs::path unused = places()[0];
  // Not a place of the cache, however old.
  const std::string other = folder_.file("cache/terrane/photos");
  fs::create_directory(other);
  writeWholeFile(other + "/used", "");
  makeOld(other + "/used", 400);

  makeOld(unused / "used", 29);
  viewed({raster(), "--max-error", "5"});
  EXPECT_TRUE(fs::exists(unused));
  // In use by a program that has run for long.
  Program program(view({raster()}));
  ASSERT_FALSE(program.firstLine().empty());
  makeOld(unused / "used", 31);
  viewed({raster(), "--max-error", "5"});
  EXPECT_TRUE(fs::exists(unused));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  makeOld(unused / "used", 31);
  viewed({raster(), "--max-error", "5"});
  EXPECT_FALSE(fs::exists(unused));
  EXPECT_TRUE(fs::exists(other));
  EXPECT_EQ(places().size(), 2U);
}

}  // namespace
}  // namespace terrane
