// The place under each pixel, relative to the eye, and the normal that it is lit with.
//
// note: not the interpolated place, which may be kilometres off where a triangle is seen edge-on (see
// patch_position.frag). The triangle is looked up, and its surface evaluated at a point that is within it. OpenGL ES 3.0
// has no such look-up: there the interpolated place must do.
in vec3 vPlace;
in vec2 vShading;
flat in vec4 vShadingBox;
in vec2 vSample;
flat in int vSlot;
layout(location = 0) out vec4 oPlace;

#ifndef GL_ES
layout(std430, binding = 1) readonly buffer MeshVertices { uint meshVertices[]; };  // three a vertex
layout(std430, binding = 2) readonly buffer MeshIndices { uint meshIndices[]; };

vec2 sampleOf(uint vertex) {
  uint place = meshVertices[3u * vertex];
  return vec2(float(place & 511u), float((place >> 9) & 511u));
}
vec3 placeOf(uint vertex, MeshPatch patch_) {
  float height = meshHeight(uintBitsToFloat(uvec2(meshVertices[3u * vertex + 1u], meshVertices[3u * vertex + 2u])),
                            intBitsToFloat(patch_.imagery.y));
  return placeVertex(patch_.lattice.xy + ivec2(sampleOf(vertex)) * patch_.lattice.z, height);
}
float doubleArea(vec2 a, vec2 b, vec2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }
#endif

void main() {
  vec2 cellsDx = dFdx(vShading), cellsDy = dFdy(vShading);
  vec2 cells = clamp(vShading, vShadingBox.xy, vShadingBox.zw);
  if (!isGround(cells, vLayers.y)) discard;
  float normal = packedNormal(shadingNormal(cells, cellsDx, cellsDy));
#ifdef GL_ES
  oPlace = vec4(vPlace, normal);
#else
  MeshPatch patch_ = meshPatch(vSlot);
  uint first = uint(patch_.lattice.w + 3 * gl_PrimitiveID);
  uvec3 corner = uvec3(meshIndices[first], meshIndices[first + 1u], meshIndices[first + 2u]);
  vec2 a = sampleOf(corner.x), b = sampleOf(corner.y), c = sampleOf(corner.z);
  vec3 weights = max(vec3(doubleArea(vSample, b, c), doubleArea(a, vSample, c), doubleArea(a, b, vSample)), 0.0);
  weights /= weights.x + weights.y + weights.z;
  oPlace = vec4(placeOf(corner.x, patch_) * weights.x + placeOf(corner.y, patch_) * weights.y +
                placeOf(corner.z, patch_) * weights.z, normal);
#endif
}
