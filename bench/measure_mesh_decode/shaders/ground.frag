in float shade;
out vec4 color;

void main() {
  color = vec4(0.25 + 0.5 * fract(shade * 0.01), 0.6, 0.4, 1.0);
}
