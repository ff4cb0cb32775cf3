#pragma once

#include "terrane/dataset/manifest.h"
#include "terrane/render/render_style.h"

namespace terrane {

/// The style that suits a dataset: the ramp over its heights, the colours of its ground (grey on worlds
/// without meadows), water at 0 where it seems to have a sea.
RenderStyle defaultStyle(const Manifest& manifest);

}  // namespace terrane
