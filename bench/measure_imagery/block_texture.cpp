#include "block_texture.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace terrane {

namespace {

using Color = std::array<float, 3>;

/// As sixteen bits keep it: 5, 6 and 5 of them.
Color as565(const Color& color) {
  Color out;
  for (size_t c = 0; c < 3; ++c) {
    const int most = c == 1 ? 63 : 31;
    const int step =
        static_cast<int>(std::clamp(color[c], 0.0F, 255.0F) * static_cast<float>(most) / 255.0F + 0.5F);
    out[c] = c == 1 ? static_cast<float>(step << 2 | step >> 4) : static_cast<float>(step << 3 | step >> 2);
  }
  return out;
}

float distance(const Color& a, const Color& b) {
  float sum = 0.0F;
  for (size_t c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

void packBlock(std::array<Color, 16>& block) {
  // The direction in which the colours vary most, by a few steps of the power method.
  Color mean{};
  for (const Color& color : block)
    for (size_t c = 0; c < 3; ++c) mean[c] += color[c] / 16.0F;
  Color axis = {1.0F, 1.0F, 1.0F};
  for (int step = 0; step < 8; ++step) {
    Color next{};
    for (const Color& color : block) {
      float along = 0.0F;
      for (size_t c = 0; c < 3; ++c) along += (color[c] - mean[c]) * axis[c];
      for (size_t c = 0; c < 3; ++c) next[c] += along * (color[c] - mean[c]);
    }
    const float most = std::max({std::abs(next[0]), std::abs(next[1]), std::abs(next[2])});
    if (most < 1e-6F) break;
    for (size_t c = 0; c < 3; ++c) axis[c] = next[c] / most;
  }
  // The outermost colours along it are the ends of the line.
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  Color lowest{}, highest{};
  for (const Color& color : block) {
    float along = 0.0F;
    for (size_t c = 0; c < 3; ++c) along += color[c] * axis[c];
    if (along < low) {
      low = along;
      lowest = color;
    }
    if (along > high) {
      high = along;
      highest = color;
    }
  }
  std::array<Color, 4> line = {as565(lowest), as565(highest), {}, {}};
  for (size_t c = 0; c < 3; ++c) {
    line[2][c] = (2.0F * line[0][c] + line[1][c]) / 3.0F;
    line[3][c] = (line[0][c] + 2.0F * line[1][c]) / 3.0F;
  }
  for (Color& color : block) {
    color = *std::min_element(line.begin(), line.end(), [&](const Color& a, const Color& b) {
      return distance(a, color) < distance(b, color);
    });
  }
}

}  // namespace

std::vector<uint8_t> throughBc1(const std::vector<uint8_t>& rgba, int width, int height) {
  std::vector<uint8_t> out = rgba;
  for (int y = 0; y + 4 <= height; y += 4) {
    for (int x = 0; x + 4 <= width; x += 4) {
      std::array<Color, 16> block;
      const auto at = [&](int i) {
        return static_cast<size_t>(4) * static_cast<size_t>((y + i / 4) * width + x + i % 4);
      };
      for (int i = 0; i < 16; ++i)
        for (size_t c = 0; c < 3; ++c) block[static_cast<size_t>(i)][c] = rgba[at(i) + c];
      packBlock(block);
      for (int i = 0; i < 16; ++i)
        for (size_t c = 0; c < 3; ++c)
          out[at(i) + c] = static_cast<uint8_t>(block[static_cast<size_t>(i)][c] + 0.5F);
    }
  }
  return out;
}

}  // namespace terrane
