// Sides of an adaptive mesh's triangles, over the shaded ground.
in vec3 vPlace;
in vec2 vShading;
flat in vec4 vShadingBox;
flat in ivec4 vLayers;
layout(location = 0) out vec4 oColor;

void main() {
  if (!isGround(clamp(vShading, vShadingBox.xy, vShadingBox.zw), vLayers.y)) discard;
  oColor = vec4(0.006, 0.008, 0.012, 0.55 * (1.0 - hazeShare(vPlace)));
}
