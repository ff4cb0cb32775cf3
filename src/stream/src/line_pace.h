#pragma once

#include <algorithm>
#include <cstdint>

namespace terrane {

/// Where the line cannot keep up, the target is loosened until the debt stops growing: better all of the
/// picture a little coarse than its first part perfect. A plain value.
class LinePace {
 public:
  /// `debt`: pixels of error above target times the pixels that have them; `wishedBytes`: not fetched yet.
  void update(double nowSeconds, double debt, uint64_t wishedBytes, double bytesPerSecond) {
    if (nowSeconds < lastSeconds_ + kStepSeconds) return;
    lastSeconds_ = nowSeconds;
    const double backlogSeconds =
        bytesPerSecond > 0.0 ? static_cast<double>(wishedBytes) / bytesPerSecond : 0.0;
    if (backlogSeconds > 1.0 && debt > lastDebt_ * 1.01)
      looseness_ = std::min(looseness_ * 1.2, kMost);
    else if (backlogSeconds < 0.5 || debt < lastDebt_ * 0.9)
      looseness_ = std::max(looseness_ / 1.15, 1.0);
    lastDebt_ = debt;
  }
  /// What targets are multiplied by; 1: the line keeps up.
  double looseness() const { return looseness_; }

 private:
  static constexpr double kStepSeconds = 0.25;
  static constexpr double kMost = 32.0;
  double lastSeconds_ = 0.0;
  double lastDebt_ = 0.0;
  double looseness_ = 1.0;
};

}  // namespace terrane
