in vec2 vSide;
in vec4 vColor;
layout(location = 0) out vec4 oColor;

void main() {
  float share = clamp(vSide.y - abs(vSide.x), 0.0, 1.0);
  oColor = vec4(vColor.rgb, vColor.a * share);
}
