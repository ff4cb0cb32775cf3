// From linear light to the picture's bytes: average the larger picture's pixels, encode as sRGB, dither.
uniform sampler2D uScene;
uniform int uShrink;  // pixels of the scene along one pixel's side
layout(location = 0) out vec4 oColor;

vec3 srgbFromLinear(vec3 c) {
  vec3 low = c * 12.92;
  vec3 high = 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  return mix(low, high, step(vec3(0.0031308), c));
}

void main() {
  ivec2 corner = ivec2(gl_FragCoord.xy) * uShrink;
  vec3 sum = vec3(0.0);
  for (int y = 0; y < uShrink; ++y)
    for (int x = 0; x < uShrink; ++x) sum += texelFetch(uScene, corner + ivec2(x, y), 0).rgb;
  vec3 color = clamp(sum / float(uShrink * uShrink), 0.0, 1.0);
  // Less than half a step of noise hides the bands of the sky.
  float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
  oColor = vec4(srgbFromLinear(color) + noise * (0.9 / 255.0), 1.0);
}
