#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <utility>

#include "terrane/stream/transport.h"

namespace terrane {

/// Asks, and waits for the answer, whatever it is.
inline FetchAnswer fetchOne(Transport& transport, const FetchRequest& request) {
  static std::atomic<uint64_t> lastId{0};
  const uint64_t id = ++lastId;
  transport.start(id, request);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::chrono::steady_clock::now() < deadline) {
    transport.wait(1.0);
    for (FetchAnswer& answer : transport.poll(0.0)) {
      EXPECT_EQ(answer.id, id);
      return std::move(answer);
    }
  }
  ADD_FAILURE() << "no answer";
  return {};
}

inline std::string textOf(const FetchAnswer& answer) {
  return {answer.bytes.begin(), answer.bytes.end()};
}

}  // namespace terrane
