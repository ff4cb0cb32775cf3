#include "synth_window.h"

#include <cmath>

#include "synth_noise.h"

namespace terrane::synth {

// Works on the run of samples within one noise cell at a time, so that the inner loop is plain arithmetic.
void addNoise(const Window& window, double wavelength, float strength, uint32_t seed,
              std::vector<float>& out) {
  std::vector<float> fx(static_cast<size_t>(window.cols)), sx(static_cast<size_t>(window.cols));
  std::vector<int32_t> cell(static_cast<size_t>(window.cols));
  for (int col = 0; col < window.cols; ++col) {
    const size_t c = static_cast<size_t>(col);
    const double u = window.x[c] / wavelength;
    const double floorU = std::floor(u);
    const float f = static_cast<float>(u - floorU);
    cell[c] = static_cast<int32_t>(floorU);
    fx[c] = f;
    sx[c] = f * f * f * (f * (f * 6.0f - 15.0f) + 10.0f);
  }
  const float scale = 1.6f * strength;
  for (int row = 0; row < window.rows; ++row) {
    const double v = window.y[static_cast<size_t>(row)] / wavelength;
    const double floorV = std::floor(v);
    const float fy = static_cast<float>(v - floorV);
    const float sy = fy * fy * fy * (fy * (fy * 6.0f - 15.0f) + 10.0f);
    const int32_t y0 = static_cast<int32_t>(floorV);
    float* line = out.data() + window.at(0, row);
    for (int begin = 0; begin < window.cols;) {
      const int32_t x0 = cell[static_cast<size_t>(begin)];
      int end = begin + 1;
      while (end < window.cols && cell[static_cast<size_t>(end)] == x0) ++end;
      // Along a row each corner's part is linear in fx: a + b * fx.
      float a[4];
      float b[4];
      for (int corner = 0; corner < 4; ++corner) {
        const int dx = corner & 1;
        const int dy = corner >> 1;
        const uint32_t h = hashCell(x0 + dx, y0 + dy, seed);
        const float gx = unitLow(h) * 2.0f - 1.0f;
        const float gy = unitHigh(h) * 2.0f - 1.0f;
        a[corner] = gy * (fy - static_cast<float>(dy)) - gx * static_cast<float>(dx);
        b[corner] = gx;
      }
      const float westA = lerp(a[0], a[2], sy) * scale;
      const float westB = lerp(b[0], b[2], sy) * scale;
      const float eastA = lerp(a[1], a[3], sy) * scale;
      const float eastB = lerp(b[1], b[3], sy) * scale;
      const float* __restrict f = fx.data();
      const float* __restrict s = sx.data();
      float* __restrict to = line;
      for (int col = begin; col < end; ++col) {
        const float west = westA + westB * f[col];
        const float east = eastA + eastB * f[col];
        to[col] += west + (east - west) * s[col];
      }
      begin = end;
    }
  }
}

}  // namespace terrane::synth
