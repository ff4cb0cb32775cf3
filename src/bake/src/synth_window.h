#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::synth {

/// The samples under work: the asked rectangle and a border, positions in metres from the world's centre.
struct Window {
  int cols = 0;
  int rows = 0;
  std::vector<double> x, y;  ///< of columns, of rows
  size_t at(int col, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(cols) + static_cast<size_t>(col);
  }
  size_t count() const { return static_cast<size_t>(cols) * static_cast<size_t>(rows); }
};

/// Adds strength * gradient noise of a wavelength (metres) to every sample of `out`.
void addNoise(const Window& window, double wavelength, float strength, uint32_t seed,
              std::vector<float>& out);

}  // namespace terrane::synth
