// The heights of a patch's vertices, morphed (docs/architecture.md, "Morphing").
//
// The vertices that a patch has and its bintree parent lacks, every other one, stand in the middle of a hypotenuse of
// the parent's triangles: at morph 0 they are the mean of its ends, at 1 themselves, exactly. Both patches at an edge
// that has such vertices have the same morph and add the same two ends, so they agree bit for bit.
uniform sampler2DArray uHeights;
uniform int uTemplate;  // 0: right-angle, 1: hypotenuse

float sampleHeight(ivec2 vertex, int quarters, ivec4 texel) {
  return texelFetch(uHeights, ivec3(texel.xy + rotateQuarters(vertex, quarters) * texel.z, texel.w), 0).r;
}

// `vertex`: in template units; `texel`: the patch's aTexel.
float morphedHeight(ivec2 vertex, int quarters, ivec4 texel, float morph) {
  float own = sampleHeight(vertex, quarters, texel);
  bool isNew = ((uTemplate == 0 ? vertex.x + vertex.y : vertex.x) & 1) != 0;
  if (!isNew || morph >= 1.0) return own;
  // From the vertex to one end of its hypotenuse; the other lies opposite.
  ivec2 toEnd;
  if (uTemplate == 0)
    toEnd = (vertex.x & 1) != 0 ? ivec2(1, 0) : ivec2(0, 1);
  else
    toEnd = (((vertex.x + vertex.y) >> 1) & 1) != 0 ? ivec2(1, 1) : ivec2(1, -1);
  float coarse = 0.5 * (sampleHeight(vertex - toEnd, quarters, texel) + sampleHeight(vertex + toEnd, quarters, texel));
  return coarse + morph * (own - coarse);
}
