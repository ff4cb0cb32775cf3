#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "temporary_directory.h"

namespace terrane {

/// A run of a program, by itself the one that was built. What it prints is read through a pipe, or with
/// `hears` what it says on standard error.
class Program {
 public:
  enum class Hears { Output, Errors };
  explicit Program(const std::vector<std::string>& arguments, Hears hears = Hears::Output,
                   const std::string& path = TERRANE_PROGRAM) {
    std::vector<std::string> all = {path};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& argument : all) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    const int heard = hears == Hears::Output ? STDOUT_FILENO : STDERR_FILENO;
    const int unheard = hears == Hears::Output ? STDERR_FILENO : STDOUT_FILENO;
    posix_spawn_file_actions_adddup2(&actions, ends[1], heard);
    posix_spawn_file_actions_addopen(&actions, unheard, "/dev/null", O_WRONLY, 0);
    EXPECT_EQ(posix_spawn(&process_, path.c_str(), &actions, nullptr, pointers.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    output_ = ends[0];
  }
  ~Program() {
    if (!ended_) kill(process_, SIGKILL), wait();
    close(output_);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// The first line; empty where the program ends without one.
  std::string firstLine() const {
    std::string line;
    char c = 0;
    while (read(output_, &c, 1) == 1 && c != '\n') line += c;
    return line;
  }
  /// All of it, until the program ends.
  std::string everything() const {
    std::string text;
    char c = 0;
    while (read(output_, &c, 1) == 1) text += c;
    return text;
  }
  void signal(int number) const { kill(process_, number); }
  /// The exit status; -1 for a program that was killed.
  int wait() {
    if (!ended_) waitpid(process_, &status_, 0);
    ended_ = true;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
  }
  bool hasEnded() {
    if (!ended_) ended_ = waitpid(process_, &status_, WNOHANG) == process_;
    return ended_;
  }
  std::string procFile(const std::string& name) const {
    return readWholeFile("/proc/" + std::to_string(process_) + "/" + name);
  }
  int64_t residentKilobytes() const {
    const std::string status = procFile("status");
    return std::atoll(status.c_str() + status.find("VmRSS:") + 6);
  }

 private:
  pid_t process_ = -1;
  int output_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

/// Of an address that ends with its port, perhaps with a slash behind it.
inline int portOf(const std::string& url) {
  return std::atoi(url.c_str() + url.rfind(':') + 1);
}

}  // namespace terrane
