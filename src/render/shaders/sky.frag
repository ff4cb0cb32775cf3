in vec2 vClip;
layout(location = 0) out vec4 oColor;

void main() {
  vec3 direction = uViewForward.xyz + uViewRight.xyz * (vClip.x / uViewRight.w) + uViewUp.xyz * (vClip.y / uViewUp.w);
  oColor = vec4(skyColor(normalize(direction)), 1.0);
}
