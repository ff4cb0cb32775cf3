// One vertex of one K-patch: the template's vertex, turned and moved onto the lattice.
layout(location = 0) in ivec2 aTemplate;  // in template units, see PatchPlacement
layout(location = 1) in ivec4 aLattice;   // xy: origin from the anchor, z: unit, w: quarter turns
layout(location = 2) in ivec4 aTexel;     // xy: origin in the height tile, z: unit there, w: layer
layout(location = 3) in vec4 aShading;    // xy: origin in the shading tile, z: unit there, w: its cells in a finest data cell
layout(location = 4) in ivec4 aLayers;    // x: shading layer, y: coverage layer (-1: all ground), z: colour, w: error in pixels as float bits
layout(location = 5) in ivec4 aImagery;   // x: page of its imagery (-1: none), y: morph as float bits

out vec3 vPlace;    // from the eye, metres
out vec2 vShading;  // cells of the shading tile
out vec2 vGrid;     // cells of the patch: the right angle's legs are its axes in both templates
out float vHeight;  // metres; for those who capture vertices
flat out vec4 vShadingBox;  // the patch's least and greatest cells
flat out ivec4 vLayers;
flat out int vImagery;
flat out float vShadingScale;
flat out ivec4 vLattice;
flat out ivec4 vTexel;
flat out float vMorph;
flat out vec2 vCorner;  // one of the triangle's corners, like vGrid
invariant gl_Position;

void main() {
  ivec2 turned = rotateQuarters(aTemplate, aLattice.w);
  float morph = intBitsToFloat(aImagery.y);
  float height = morphedHeight(aTemplate, aLattice.w, aTexel, morph);
  vec3 place = placeVertex(aLattice.xy + turned * aLattice.z, height);
  gl_Position = clipFromEye(place);
  vPlace = place;
  vHeight = height;
  vShading = aShading.xy + vec2(turned) * aShading.z;
  int n = uStyle.z;
  vec2 end = aShading.xy + vec2(rotateQuarters(uTemplate == 0 ? ivec2(n) : ivec2(2 * n, n), aLattice.w)) * aShading.z;
  vShadingBox = vec4(min(aShading.xy, end), max(aShading.xy, end));
  vGrid = uTemplate == 0 ? vec2(aTemplate) : vec2(aTemplate.x + aTemplate.y, aTemplate.x - aTemplate.y) * 0.5;
  vLayers = aLayers;
  vImagery = aImagery.x;
  vShadingScale = aShading.w;
  vLattice = aLattice;
  vTexel = aTexel;
  vMorph = morph;
  vCorner = vGrid;
}
