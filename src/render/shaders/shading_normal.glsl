flat in ivec4 vLayers;
flat in float vShadingScale;
uniform sampler2DArray uGradients;  // see tile_shading.h for where the levels lie

const float kCoarsest = 6.0;  // gradient level

// Gradient, in metres a cell of the shading tile, of a level of its gradient atlas.
vec2 gradientOfLevel(vec2 cells, float level) {
  vec2 origin = level < 0.5 ? vec2(0.0) : vec2(257.0, 256.0 - exp2(9.0 - level) + level - 1.0);
  vec2 texel = origin + cells * exp2(-level) + 0.5;
  return textureLod(uGradients, vec3(texel / vec2(386.0, 258.0), float(vLayers.x)), 0.0).rg;
}

// The ground's normal at one sample a pixel, averaged over what the pixel covers.
vec3 shadingNormal(vec2 cells, vec2 cellsDx, vec2 cellsDy) {
  float longer = max(dot(cellsDx, cellsDx), dot(cellsDy, cellsDy));
  float area = abs(cellsDx.x * cellsDy.y - cellsDx.y * cellsDy.x);
  // note: seen at a flat angle a pixel covers a long strip; its width counts, up to a quarter of its length.
  float footprint = max(area * inversesqrt(max(longer, 1e-12)), 0.25 * sqrt(longer));
  float level = clamp(log2(max(footprint, 1e-6)), 0.0, kCoarsest);
  float finer = floor(level);
  vec2 gradient = gradientOfLevel(cells, finer);
  if (level > finer) gradient = mix(gradient, gradientOfLevel(cells, finer + 1.0), level - finer);
  gradient *= uGradient.xy * (vShadingScale * uGradient.z);
  return normalize(vec3(-gradient.x, gradient.y, 1.0));
}

// The normal as one number of at least 1, which a float holds exactly; the normal points up.
float packedNormal(vec3 normal) {
  vec2 steps = floor((normal.xy * 0.5 + 0.5) * 4094.0 + 0.5);
  return 1.0 + steps.x * 4096.0 + steps.y;
}
