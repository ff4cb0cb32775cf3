uniform usampler2DArray uCoverage;  // 32 x 256 bytes, one bit a cell

// Is the cell under a point of the shading tile ground?
bool isGround(vec2 cells, int coverageLayer) {
  if (coverageLayer < 0) return true;
  ivec2 cell = clamp(ivec2(floor(cells)), 0, 255);
  uint bits = texelFetch(uCoverage, ivec3(cell.x >> 3, cell.y, coverageLayer), 0).r;
  return ((bits >> uint(cell.x & 7)) & 1u) != 0u;
}
