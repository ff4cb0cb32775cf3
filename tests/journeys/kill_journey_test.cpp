#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "function_source.h"
#include "job_log.h"
#include "terrane/dataset/dataset.h"

/// The program itself, killed with SIGKILL at random moments and run again: the result has the same bytes as
/// that of a build that was left alone, what was done is not done again, and what stood there before stands
/// until the new dataset takes its place.
namespace terrane {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::string bytesOf(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A run of the program; its standard output goes to a file.
class BuildProcess {
 public:
  BuildProcess(const std::vector<std::string>& arguments, const fs::path& output) {
    std::vector<std::string> all = {TERRANE_PROGRAM};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& argument : all) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0644);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    EXPECT_EQ(posix_spawn(&process_, TERRANE_PROGRAM, &actions, nullptr, pointers.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
  }
  ~BuildProcess() {
    if (running()) kill(process_, SIGKILL), wait();
  }
  BuildProcess(const BuildProcess&) = delete;
  BuildProcess& operator=(const BuildProcess&) = delete;

  /// Looks, and lets the program have the processor for a moment.
  bool running() {
    usleep(200);
    if (!ended_ && waitpid(process_, &status_, WNOHANG) == process_) ended_ = true;
    return !ended_;
  }
  /// The exit status; -1 for a program that was killed.
  int wait() {
    if (!ended_) waitpid(process_, &status_, 0);
    ended_ = true;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
  }
  void signal(int number) const { kill(process_, number); }

 private:
  pid_t process_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

/// All files below a folder, by name.
std::map<std::string, std::string> filesBelow(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) out[fs::relative(entry.path(), folder).string()] = bytesOf(entry.path());
  }
  return out;
}

/// One input, the dataset that a build left alone makes of it, and what that took.
struct Case {
  std::vector<std::string> inputs;
  std::vector<std::string> options;
  std::map<std::string, std::string> expected;
  int64_t jobs = 0;
  uintmax_t logBytes = 0;
  double seconds = 0.0;
};

class KillJourney : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("terrane_kill_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path target() const { return folder_ / "made.terrane"; }
  fs::path work() const { return folder_ / "made.terrane.partial"; }

  /// Writes rough country with a lake of nodata, as a grid of floats that GDAL reads. All share their middle.
  void makeRaster(const std::string& name, int cols, int rows, double spacing, uint64_t seed) const {
    std::ofstream header(path(name + ".hdr"));
    header << "ncols " << cols << "\nnrows " << rows << "\nxllcorner " << 500000.0 - cols / 2 * spacing
           << "\nyllcorner " << 5200000.0 - rows / 2 * spacing << "\ncellsize " << spacing
           << "\nNODATA_value -9999\nbyteorder LSBFIRST\n";
    std::vector<float> heights;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < cols; ++x) {
        const bool lake = std::hypot(x - cols / 3, y - rows / 3) < rows / 8;
        heights.push_back(lake ? -9999.0F : roughGround(x, y, seed));
      }
    }
    std::ofstream(path(name + ".flt"), std::ios::binary)
        .write(reinterpret_cast<const char*>(heights.data()),
               static_cast<std::streamsize>(heights.size() * sizeof(float)));
  }
  std::vector<std::string> command(const Case& made, int threads, bool overwrite) const {
    std::vector<std::string> out = {"build"};
    for (const std::string& input : made.inputs) out.push_back(path(input + ".flt"));
    out.insert(out.end(), {"--source-crs", "EPSG:32632", "-o", target().string(), "--json", "--threads",
                           std::to_string(threads)});
    out.insert(out.end(), made.options.begin(), made.options.end());
    if (overwrite) out.emplace_back("--overwrite");
    return out;
  }
  /// The last line of what the last program said.
  nlohmann::json said() const {
    std::ifstream in(folder_ / "said.txt");
    nlohmann::json last;
    for (std::string line; std::getline(in, line);) last = nlohmann::json::parse(line);
    return last;
  }

  /// Builds a case twice without a kill, to know what there is to be done and how long it takes.
  Case makeCase(std::vector<std::string> inputs, std::vector<std::string> options = {}) {
    Case made;
    made.inputs = std::move(inputs);
    made.options = std::move(options);
    for (int round = 0; round < 2; ++round) {
      fs::remove_all(target());
      const auto begin = Clock::now();
      BuildProcess program(command(made, 2, false), folder_ / "said.txt");
      // The log vanishes with the work; its size is seen before.
      while (program.running()) made.logBytes = std::max(made.logBytes, logSize());
      EXPECT_EQ(program.wait(), 0);
      made.seconds = secondsSince(begin);
      made.jobs = said().at("jobs_done");
      EXPECT_EQ(said().at("jobs_resumed"), 0);
    }
    made.expected = filesBelow(target());
    // A manifest and an archive, or one for each of three layers.
    const bool layered = std::count(made.options.begin(), made.options.end(), "--layers") > 0;
    EXPECT_EQ(made.expected.size(), layered ? 4U : 2U);
    EXPECT_FALSE(fs::exists(work()));
    fs::remove_all(target());
    return made;
  }

  uintmax_t logSize() const {
    std::error_code code;
    const uintmax_t size = fs::file_size(work() / "jobs", code);
    return code ? 0 : size;
  }
  /// How many jobs an ended program has left as done.
  int64_t jobsInLog() const {
    if (!fs::exists(work() / "jobs")) return 0;
    // Every record names its stage, so the stages are known from a complete build's report.
    const auto log = JobLog::open((work() / "jobs").string());
    EXPECT_TRUE(log.ok());
    int64_t jobs = 0;
    for (const std::string& stage : log->stages()) jobs += static_cast<int64_t>(log->finished(stage).size());
    return jobs;
  }

  /// When a program is to be killed.
  struct Moment {
    double seconds = -1.0;         ///< after it began, or
    uintmax_t logBytes = 0;        ///< when its log has so many bytes, or
    bool beforeTheRename = false;  ///< when all is written
  };
  /// Runs the build and kills it then; false if it had ended before.
  bool runAndKill(const Case& made, int threads, bool overwrite, const Moment& moment) {
    const auto begin = Clock::now();
    BuildProcess program(command(made, threads, overwrite), folder_ / "said.txt");
    while (program.running()) {
      const bool now = moment.beforeTheRename
                           ? bytesOf(work() / "plan").find("\ncommitted ") != std::string::npos
                       : moment.seconds >= 0.0 ? secondsSince(begin) >= moment.seconds
                                               : logSize() >= moment.logBytes;
      if (now) break;
    }
    program.signal(SIGKILL);
    return program.wait() == -1;
  }
  /// Runs the build to its end, and checks that it did what was left and nothing else.
  void resume(const Case& made, int threads, bool overwrite) {
    const int64_t done = jobsInLog();
    BuildProcess program(command(made, threads, overwrite), folder_ / "said.txt");
    ASSERT_EQ(program.wait(), 0);
    const nlohmann::json report = said();
    if (report.at("jobs_done") != 0 || report.at("jobs_resumed") != 0) {
      EXPECT_EQ(report.at("jobs_resumed"), done);
      EXPECT_EQ(report.at("jobs_done"), made.jobs - done);
    }
    EXPECT_TRUE(filesBelow(target()) == made.expected);
    EXPECT_FALSE(fs::exists(work()));
  }

  fs::path folder_;
};

TEST_F(KillJourney, KilledAtTwentyMomentsAndResumed) {
  makeRaster("plain", 1300, 1100, 10.0, 1);
  makeRaster("country", 700, 700, 20.0, 2);
  makeRaster("village", 500, 400, 5.0, 3);
  const std::vector<Case> cases = {makeCase({"plain"}), makeCase({"country", "village"}),
                                   makeCase({"plain"}, {"--max-error", "4", "--layers", "16,8"})};
  for (const Case& made : cases) ASSERT_GT(made.jobs, 100);

  std::mt19937 random(20);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int killed = 0;
  int resumedSome = 0;
  std::set<int64_t> states;
  for (int i = 0; i < 20; ++i) {
    const Case& made = cases[static_cast<size_t>(i) % cases.size()];
    const double share = (i + unit(random)) / 20.0;
    Moment moment;
    if (i % 7 == 6)
      moment.beforeTheRename = true;
    else if (i % 4 < 2)
      moment.seconds = share * made.seconds;
    else
      moment.logBytes = static_cast<uintmax_t>(share * static_cast<double>(made.logBytes));
    fs::remove_all(target());
    const bool wasKilled = runAndKill(made, 1 + i % 3, false, moment);
    killed += wasKilled ? 1 : 0;
    // The dataset is not there, or it is whole.
    if (fs::exists(target())) {
      EXPECT_TRUE(filesBelow(target()) == made.expected) << i;
    }
    if (!wasKilled || (fs::exists(target()) && !fs::exists(work()))) continue;
    const int64_t done = jobsInLog();
    resumedSome += done > 0 && done < made.jobs ? 1 : 0;
    states.insert(done);
    resume(made, 1 + (i + 1) % 3, false);
    if (HasFailure()) FAIL() << "at moment " << i;
  }
  std::printf("killed %d times, %d times with a part of the jobs done\n", killed, resumedSome);
  EXPECT_GE(killed, 12);
  EXPECT_GE(resumedSome, 8);
  EXPECT_GE(states.size(), 8U);
}

TEST_F(KillJourney, KilledFiveTimesInARow) {
  makeRaster("plain", 1300, 1100, 10.0, 1);
  const Case made = makeCase({"plain"});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int64_t before = 0;
  for (int i = 0; i < 5; ++i) {
    Moment moment;
    moment.logBytes = static_cast<uintmax_t>((i + unit(random)) / 5.5 * static_cast<double>(made.logBytes));
    runAndKill(made, 1 + i % 3, false, moment);
    ASSERT_FALSE(fs::exists(target()));
    EXPECT_GE(jobsInLog(), before);
    before = jobsInLog();
  }
  EXPECT_GT(before, 0);
  resume(made, 2, false);
}

TEST_F(KillJourney, AnOlderDatasetStandsUntilTheNewOneTakesItsPlace) {
  makeRaster("plain", 1300, 1100, 10.0, 1);
  makeRaster("old", 600, 500, 10.0, 9);
  const Case old = makeCase({"old"});
  const Case made = makeCase({"plain"});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 6; ++i) {
    fs::remove_all(target());
    resume(old, 2, false);
    Moment moment;
    if (i >= 4)
      moment.beforeTheRename = true;
    else
      moment.logBytes = static_cast<uintmax_t>((i + unit(random)) / 4.0 * static_cast<double>(made.logBytes));
    runAndKill(made, 1 + i % 3, true, moment);
    const auto there = filesBelow(target());
    EXPECT_TRUE(there == old.expected || (i >= 3 && there == made.expected)) << i;
    EXPECT_TRUE(Dataset::open(target().string()).ok());
    resume(made, 2, true);
    if (HasFailure()) FAIL() << "at moment " << i;
  }
}

TEST_F(KillJourney, MemoryFollowsTheBudgetNotTheInput) {
  makeRaster("country", 2000, 2000, 20.0, 2);
  makeRaster("village", 3000, 3000, 10.0, 3);
  Case made;
  made.inputs = {"country", "village"};
  std::vector<std::string> arguments = command(made, 2, false);
  arguments.insert(arguments.end(), {"--memory", "32M"});
  BuildProcess program(arguments, folder_ / "said.txt");
  ASSERT_EQ(program.wait(), 0);
  EXPECT_LT(said().at("peak_rss_bytes"), 332'000'000);
  EXPECT_GT(said().at("samples"), 12'000'000);
}

TEST_F(KillJourney, AnInterruptedBuildSaysHowToGoOn) {
  makeRaster("plain", 1300, 1100, 10.0, 1);
  const Case made = makeCase({"plain"});
  for (const int number : {SIGINT, SIGTERM}) {
    fs::remove_all(target());
    BuildProcess program(command(made, 1, false), folder_ / "said.txt");
    while (program.running() && logSize() < made.logBytes / 4) continue;
    program.signal(number);
    ASSERT_EQ(program.wait(), 1);
    const std::string error = said().at("error");
    EXPECT_NE(error.find("interrupted; run the same command again to go on, or delete"), std::string::npos)
        << error;
    EXPECT_NE(error.find(work().string()), std::string::npos) << error;
    EXPECT_FALSE(fs::exists(target()));
    EXPECT_GT(jobsInLog(), 0);
    resume(made, 2, false);
  }
}

TEST_F(KillJourney, AddingToADatasetLeavesItAloneUntilTheEnd) {
  const auto makeIntegers = [&](const std::string& name, int col, int row, int cols, int rows,
                                uint64_t seed) {
    std::ofstream header(path(name + ".hdr"));
    header << "nrows " << rows << "\nncols " << cols
           << "\nnbands 1\nnbits 16\npixeltype signedint\nbyteorder i\n"
           << "layout bil\nulxmap " << 500000 + 10 * col << "\nulymap " << 5200000 - 10 * row
           << "\nxdim 10\nydim 10\n";
    std::vector<int16_t> heights;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < cols; ++x)
        heights.push_back(static_cast<int16_t>(std::lround(roughGround(col + x, row + y, seed))));
    }
    std::ofstream(path(name + ".bil"), std::ios::binary)
        .write(reinterpret_cast<const char*>(heights.data()),
               static_cast<std::streamsize>(heights.size() * sizeof(int16_t)));
  };
  makeIntegers("old", 0, 0, 1300, 1100, 1);
  makeIntegers("new", 900, 700, 500, 300, 2);
  const auto command = [&](const std::vector<std::string>& inputs, const std::string& threads, bool append) {
    std::vector<std::string> out = {"build"};
    for (const std::string& input : inputs) out.push_back(path(input + ".bil"));
    out.insert(out.end(),
               {"--source-crs", "EPSG:32632", "-o", target().string(), "--json", "--threads", threads});
    if (append) out.emplace_back("--append");
    return out;
  };
  const auto run = [&](const std::vector<std::string>& inputs, const std::string& threads, bool append) {
    BuildProcess program(command(inputs, threads, append), folder_ / "said.txt");
    uintmax_t bytes = 0;
    while (program.running()) bytes = std::max(bytes, logSize());
    EXPECT_EQ(program.wait(), 0);
    EXPECT_FALSE(fs::exists(work()));
    return bytes;
  };
  run({"old", "new"}, "2", false);
  const auto expected = filesBelow(target());
  fs::remove_all(target());
  run({"old"}, "2", false);
  const auto before = filesBelow(target());
  fs::copy(target(), folder_ / "before.terrane");
  const uintmax_t logBytes = run({"new"}, "2", true);
  EXPECT_TRUE(filesBelow(target()) == expected);
  const int64_t jobs = said().at("jobs_done");
  EXPECT_GT(said().at("tiles_copied"), 0);
  EXPECT_EQ(said().at("tiles_copied").get<int>() + said().at("tiles_encoded").get<int>(), said().at("tiles"));
  const nlohmann::json copied = said().at("tiles_copied");

  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int resumedSome = 0;
  for (int i = 0; i < 9; ++i) {
    fs::remove_all(target());
    fs::copy(folder_ / "before.terrane", target());
    {
      BuildProcess program(command({"new"}, std::to_string(1 + i % 3), true), folder_ / "said.txt");
      const auto enough = static_cast<uintmax_t>((i + unit(random)) / 9.0 * static_cast<double>(logBytes));
      while (program.running()) {
        const bool now = i % 4 == 3 ? bytesOf(work() / "plan").find("\ncommitted ") != std::string::npos
                                    : logSize() >= enough;
        if (now) break;
      }
      program.signal(SIGKILL);
      if (program.wait() != -1) continue;
    }
    const auto now = filesBelow(target());
    ASSERT_TRUE(now == before || now == expected) << i;
    if (now == expected && !fs::exists(work())) continue;
    const int64_t done = jobsInLog();
    resumedSome += done > 0 && done < jobs ? 1 : 0;
    run({"new"}, std::to_string(1 + (i + 1) % 3), true);
    ASSERT_TRUE(filesBelow(target()) == expected) << i;
    if (said().at("jobs_done") == 0 && said().at("jobs_resumed") == 0) continue;
    EXPECT_EQ(said().at("jobs_resumed"), done);
    EXPECT_EQ(said().at("jobs_done"), jobs - done);
    EXPECT_EQ(said().at("tiles_copied"), copied);
  }
  std::printf("%d times with a part of the jobs done\n", resumedSome);
  EXPECT_GE(resumedSome, 3);
}

}  // namespace
}  // namespace terrane
