// The place under each pixel, relative to the eye, and the normal that it is lit with.
//
// note: not the interpolated place. Where a triangle is seen edge-on the pixel's middle may lie a hair outside
// of it, and what is interpolated there can be kilometres beyond its corners. The patch's own coordinates are
// kept within the triangle's neighbourhood, and the drawn surface is evaluated at them.
in vec2 vShading;
flat in vec4 vShadingBox;
in vec2 vGrid;
flat in ivec4 vLattice;
flat in ivec4 vTexel;
flat in float vMorph;
flat in vec2 vCorner;
layout(location = 0) out vec4 oPlace;

// A vertex of the patch's grid in template coordinates.
ivec2 templateFromGrid(ivec2 grid) { return uTemplate == 0 ? grid : ivec2(grid.x + grid.y, grid.x - grid.y); }

vec3 placeOf(ivec2 grid) {
  ivec2 vertex = templateFromGrid(grid);
  return placeVertex(vLattice.xy + rotateQuarters(vertex, vLattice.w) * vLattice.z,
                     morphedHeight(vertex, vLattice.w, vTexel, vMorph));
}

void main() {
  vec2 cellsDx = dFdx(vShading), cellsDy = dFdy(vShading);
  if (!isGround(clamp(vShading, vShadingBox.xy, vShadingBox.zw), vLayers.y)) discard;

  // Inside the triangle's neighbourhood, then inside the patch.
  float n = float(uStyle.z);
  vec2 grid = clamp(vGrid, vCorner - 1.0, vCorner + 1.0);
  if (uTemplate == 0) {
    grid = max(grid, 0.0);
    grid = max(grid - 0.5 * max(grid.x + grid.y - n, 0.0), 0.0);
    grid = min(grid, n - grid.yx);
  } else {
    grid.x = clamp(grid.x, 0.0, n);
    grid.y = clamp(grid.y, 0.0, grid.x);
  }

  // The triangle: cells are cut along diagonals that alternate. A corner outside the patch has no weight.
  vec2 cell = min(floor(grid), n - 1.0);
  vec2 inCell = grid - cell;
  ivec2 c = ivec2(cell);
  bool falls = ((c.x + c.y) & 1) == 0;
  ivec2 a, b, d;
  vec3 weights;
  if (falls) {
    bool first = inCell.x >= inCell.y;
    a = c;
    b = first ? c + ivec2(1, 0) : c + ivec2(0, 1);
    d = c + ivec2(1, 1);
    float large = max(inCell.x, inCell.y), small = min(inCell.x, inCell.y);
    weights = vec3(1.0 - large, large - small, small);
  } else {
    bool first = inCell.x + inCell.y <= 1.0;
    a = first ? c : c + ivec2(1, 1);
    b = c + ivec2(1, 0);
    d = c + ivec2(0, 1);
    weights = first ? vec3(1.0 - inCell.x - inCell.y, inCell.x, inCell.y)
                    : vec3(inCell.x + inCell.y - 1.0, 1.0 - inCell.y, 1.0 - inCell.x);
  }
  vec3 normal = shadingNormal(clamp(vShading, vShadingBox.xy, vShadingBox.zw), cellsDx, cellsDy);
  oPlace = vec4(placeOf(a) * weights.x + placeOf(b) * weights.y + placeOf(d) * weights.z, packedNormal(normal));
}
