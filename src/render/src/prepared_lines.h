#pragma once

#include <glm/vec4.hpp>
#include <vector>

#include "line_grid.h"
#include "terrane/render/prepare_lines.h"

namespace terrane {

/// See prepare_lines.h.
struct PreparedLines {
  LineGrid grid;
  /// Of each line: linear colour and opacity; half its width in pixels, in metres, and nothing.
  std::vector<glm::vec4> styles;
};

}  // namespace terrane
