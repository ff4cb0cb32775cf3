// The place under each pixel, relative to the eye.
in vec3 vPlace;
in vec2 vShading;
flat in ivec4 vLayers;
layout(location = 0) out vec4 oPlace;

void main() {
  if (!isGround(vShading, vLayers.y)) discard;
  oPlace = vec4(vPlace, 1.0);
}
