// A scene of several pixels a side for each of the picture's, averaged: linear light, as large as the picture.
uniform sampler2D uScene;
uniform int uShrink;  // pixels of the scene along one pixel's side
layout(location = 0) out vec4 oColor;

void main() {
  ivec2 corner = ivec2(gl_FragCoord.xy) * uShrink;
  vec3 sum = vec3(0.0);
  for (int y = 0; y < uShrink; ++y)
    for (int x = 0; x < uShrink; ++x) sum += texelFetch(uScene, corner + ivec2(x, y), 0).rgb;
  oColor = vec4(sum / float(uShrink * uShrink), 1.0);
}
