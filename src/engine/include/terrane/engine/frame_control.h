#pragma once

#include <algorithm>
#include <cmath>

namespace terrane {

/// Lets tau follow a frame time, within bounds: coarser where frames take too long, finer where there is
/// room. A plain value.
class FrameControl {
 public:
  struct Options {
    double targetSeconds = 1.0 / 60.0;  ///< of a frame
    double leastTau = 1.0;              ///< pixels; where both bounds are equal tau is fixed
    double mostTau = 1.0;
    double deadBand = 0.05;     ///< shares of the target that frames may be off without any change
    double slewPerSecond = 0.1; ///< tau changes by at most this share a second, so that morphing hides it
  };
  FrameControl() : FrameControl(Options{}) {}
  explicit FrameControl(const Options& options) : options_(options), tau_(options.leastTau) {}

  /// A frame took `frameSeconds` of work, `elapsedSeconds` after the one before.
  void frameTook(double frameSeconds, double elapsedSeconds) {
    if (options_.leastTau >= options_.mostTau || !(frameSeconds > 0.0) || !(elapsedSeconds > 0.0)) return;
    // One slow frame says little.
    average_ = average_ > 0.0 ? average_ + kFollow * (frameSeconds - average_) : frameSeconds;
    const double ratio = average_ / options_.targetSeconds;
    if (std::abs(ratio - 1.0) <= options_.deadBand) return;
    const double wanted = std::pow(ratio, kExponent);
    const double most = 1.0 + options_.slewPerSecond * std::min(elapsedSeconds, 1.0);
    tau_ = std::clamp(tau_ * std::clamp(wanted, 1.0 / most, most), options_.leastTau, options_.mostTau);
  }
  /// Pixels.
  double tau() const { return tau_; }

 private:
  static constexpr double kFollow = 0.15;
  static constexpr double kExponent = 0.4;
  Options options_;
  double tau_;
  double average_ = 0.0;
};

}  // namespace terrane
