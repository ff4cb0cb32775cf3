// A vertex's place is one function of integers (docs/architecture.md): its lattice coordinates relative to the anchor,
// an integer point near the camera, and its height. Patches that share a vertex share these numbers, whatever
// their tile, level or rotation, so they share its pixels. The result is relative to the eye, in metres: east,
// north, up; its error is that of one rounding each of the distance, the spacing and the sum.
vec3 placeVertex(ivec2 latticeFromAnchor, float heightMeters) {
  vec2 eastSouth = vec2(latticeFromAnchor) * uPlace.xy;
  return vec3(eastSouth.x - uPlace.z, -eastSouth.y - uPlace.w, (heightMeters - uHeight.x) * uHeight.y - uHeight.z);
}

// By quarter turns from x towards y.
ivec2 rotateQuarters(ivec2 p, int quarters) {
  if (quarters == 0) return p;
  if (quarters == 1) return ivec2(-p.y, p.x);
  if (quarters == 2) return -p;
  return ivec2(p.y, -p.x);
}

vec4 clipFromEye(vec3 place) {
  float depth = dot(place, uViewForward.xyz);
  return vec4(dot(place, uViewRight.xyz) * uViewRight.w, dot(place, uViewUp.xyz) * uViewUp.w,
              depth * uDepth.x + uDepth.y, depth);
}
