// One vertex of a patch's adaptive mesh: a sample of its tile, moved onto the lattice. Gives what patch.vert gives.
layout(location = 0) in uint aPlace;   // sample x in bits 0 to 8, y in 9 to 17, the patch's slot above
layout(location = 1) in vec2 aHeights; // metres: its own, and what the level before shows there

uniform float uNearer;  // 1; a little less to draw lines over the triangles that they belong to

out vec3 vPlace;    // from the eye, metres
out vec2 vShading;  // cells of the shading tile
out vec2 vGrid;     // along the legs of the right angle, in cells of a patch
out float vHeight;  // metres; for those who capture vertices
flat out vec4 vShadingBox;  // the patch's least and greatest cells
flat out ivec4 vLayers;
flat out int vImagery;
flat out float vShadingScale;
out vec2 vSample;   // of the tile
flat out int vSlot;
invariant gl_Position;

void main() {
  int slot = int(aPlace >> 18);
  ivec2 at = ivec2(aPlace & 511u, (aPlace >> 9) & 511u);
  MeshPatch patch_ = meshPatch(slot);
  float height = meshHeight(aHeights, intBitsToFloat(patch_.imagery.y));
  vec3 place = placeVertex(patch_.lattice.xy + at * patch_.lattice.z, height);
  gl_Position = clipFromEye(place * uNearer);
  vPlace = place;
  vHeight = height;
  vShading = patch_.shading.xy + vec2(at) * patch_.shading.z;
  ivec2 apex = meshPoint(patch_.corners.x), first = meshPoint(patch_.corners.y), second = meshPoint(patch_.corners.z);
  vShadingBox.xy = patch_.shading.xy + vec2(min(min(apex, first), second)) * patch_.shading.z;
  vShadingBox.zw = patch_.shading.xy + vec2(max(max(apex, first), second)) * patch_.shading.z;
  vec2 legs = vec2(float(uStyle.z)) / vec2(dot(vec2(first - apex), vec2(first - apex)), dot(vec2(second - apex), vec2(second - apex)));
  vGrid = legs * vec2(dot(vec2(at - apex), vec2(first - apex)), dot(vec2(at - apex), vec2(second - apex)));
  vLayers = patch_.layers;
  vImagery = patch_.imagery.x;
  vShadingScale = patch_.shading.w;
  vSample = vec2(at);
  vSlot = slot;
}
