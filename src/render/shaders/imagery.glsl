// Imagery over a patch. Its page (src/imagery_store.cpp) is a run of entries: a head, the heads of its levels, finest
// first, and for each level a table of the tiles that it spans.
uniform highp sampler2DArray uImagery;       // 258 x 258: a tile's texels and one of border around them
uniform highp sampler2DArray uImageryPages;  // 256 x 64 entries a layer

vec4 imageryEntry(int index) {
  return texelFetch(uImageryPages, ivec3(index & 255, (index >> 8) & 63, index >> 14), 0);
}

// Colour (not multiplied by alpha) and alpha at texels of a level that is `coarser` than the page's finest one.
vec4 imageryOfLevel(int page, vec2 texels, int coarser) {
  vec4 head = imageryEntry(page + 1 + coarser);
  vec2 levelTexels = texels * exp2(-float(coarser));
  float high = floor(head.w / 64.0);
  vec2 size = vec2(head.w - 64.0 * high, high);
  vec2 tile = clamp(floor(levelTexels / 256.0) - head.yz, vec2(0.0), size - 1.0);
  vec4 entry = imageryEntry(page + int(head.x) + int(tile.y) * int(size.x) + int(tile.x));
  if (entry.x < 0.0) return vec4(0.0);
  vec2 inTile = clamp(levelTexels * entry.y + entry.zw, 0.0, 256.0);
  return textureLod(uImagery, vec3((inTile + 1.0) / 258.0, entry.x), 0.0);
}

// The imagery at a point of the shading tile, averaged over what the pixel covers.
vec4 imageryColor(int page, vec2 cells, vec2 cellsDx, vec2 cellsDy) {
  vec4 head = imageryEntry(page);
  vec2 texels = cells * head.y + head.zw;
  vec2 dx = cellsDx * head.y;
  vec2 dy = cellsDy * head.y;
  float longer = max(dot(dx, dx), dot(dy, dy));
  float area = abs(dx.x * dy.y - dx.y * dy.x);
  // note: seen at a flat angle a pixel covers a long strip; its width counts, up to a quarter of its length.
  float footprint = max(area * inversesqrt(max(longer, 1e-12)), 0.25 * sqrt(longer));
  float level = clamp(log2(max(footprint, 1e-6)), 0.0, head.x);
  int finer = int(level);
  vec4 color = imageryOfLevel(page, texels, finer);
  float share = level - float(finer);
  if (share > 0.0 && finer < int(head.x)) {
    vec4 coarse = imageryOfLevel(page, texels, finer + 1);
    float alpha = mix(color.a, coarse.a, share);
    vec3 blended = mix(color.rgb * color.a, coarse.rgb * coarse.a, share);
    color = vec4(alpha > 0.0 ? blended / alpha : color.rgb, alpha);
  }
  return color;
}
