#include "imagery_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "terrane/codec/imagery_codec.h"

namespace terrane {
namespace {

/// A box in local coordinates, heights exaggerated.
struct Box {
  glm::dvec3 low, high;
};

double distanceTo(const Box& box, glm::dvec3 point) {
  return glm::length(glm::max(glm::max(box.low - point, point - box.high), glm::dvec3(0.0)));
}

bool maySee(const Camera& camera, const Box& box) {
  std::array<bool, 5> outside = {true, true, true, true, true};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at((corner & 1) != 0 ? box.high.x : box.low.x,
                        (corner & 2) != 0 ? box.high.y : box.low.y,
                        (corner & 4) != 0 ? box.high.z : box.low.z);
    const glm::dvec3 view = camera.viewFromLocal(at);
    const double x = view.z * camera.tanHalfX();
    const double y = view.z * camera.tanHalfY();
    const std::array<bool, 5> out = {view.z < 0.0, view.x<-x, view.x> x, view.y<-y, view.y> y};
    for (size_t i = 0; i < outside.size(); ++i) outside[i] = outside[i] && out[i];
  }
  return std::none_of(outside.begin(), outside.end(), [](bool is) { return is; });
}

class Choice {
 public:
  Choice(const ImageryView& view, size_t most, double texelPixels)
      : view_(view), most_(most), texelPixels_(texelPixels) {}

  /// False: there would be too many.
  bool collect(std::vector<ImageryNeed>& out) {
    const Manifest& manifest = view_.manifest;
    return add(TileId{}, {manifest.minHeight, manifest.maxHeight}, out);
  }

 private:
  struct Range {
    double low, high;
  };

  bool add(TileId id, Range range, std::vector<ImageryNeed>& out) {
    if (out.size() >= most_) return false;
    const double texel = texelPixelsOf(id, boxOf(id, range));
    const double side = std::min(texel, 1e3) * kImageryTileSide;
    const double picture = static_cast<double>(view_.camera.width) * view_.camera.height;
    out.push_back({id, texel, std::min(side * side, picture)});
    if (texel <= texelPixels_ || !view_.hasDeeper(id)) return true;
    const Tile* tile = view_.heights.find(id);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      Range below = range;
      if (tile != nullptr) {
        // What the elevation knows of the quadrant; nothing but void has no range of its own.
        const ChildSummary& child = tile->children[static_cast<size_t>(quadrant)];
        const ElevationScale& scale = view_.manifest.scale;
        if (child.low <= child.high)
          below = {scale.heightFromRangeCode(child.low), scale.heightFromRangeCode(child.high)};
      }
      // A quadrant is looked at by itself: farther away than the tile's nearest, its own texels may do.
      const TileId at = id.child(quadrant);
      const Box box = boxOf(at, below);
      if (!maySee(view_.camera, box) || 2.0 * texelPixelsOf(at, box) <= texelPixels_) continue;
      if (!add(at, below, out)) return false;
    }
    return true;
  }

  /// About the size on screen of a tile's nearest texel.
  double texelPixelsOf(TileId id, const Box& box) const {
    const Frame& frame = view_.manifest.frame;
    const double cells = std::ldexp(1.0, frame.finestLevel - id.level);
    const double texelMeters = frame.spacingXMeters() * cells;
    const double distance = std::max(distanceTo(box, view_.camera.eyeLocal), 1e-3);
    return texelMeters * view_.camera.pixelsPerTangent() / distance;
  }

  Box boxOf(TileId id, Range range) const {
    const Frame& frame = view_.manifest.frame;
    const double cells = std::ldexp(kImageryTileSide, frame.finestLevel - id.level);
    const glm::dvec2 northWest = frame.localFromSample({id.col * cells, id.row * cells});
    const glm::dvec2 southEast = frame.localFromSample({(id.col + 1) * cells, (id.row + 1) * cells});
    return {{northWest.x, southEast.y, range.low * view_.exaggeration},
            {southEast.x, northWest.y, range.high * view_.exaggeration}};
  }

  const ImageryView& view_;
  size_t most_;
  double texelPixels_;
};

}  // namespace

std::vector<ImageryNeed> selectImagery(const ImageryView& view, size_t most) {
  std::vector<ImageryNeed> out;
  // note: ends, since beyond some size of a texel only the root is left.
  for (double texelPixels = 1.0; !Choice(view, std::max<size_t>(most, 1), texelPixels).collect(out);
       texelPixels *= 1.4)
    out.clear();
  std::sort(out.begin(), out.end(),
            [](const ImageryNeed& a, const ImageryNeed& b) { return a.tile < b.tile; });
  return out;
}

}  // namespace terrane
