// A line as a strip, already in clip space.
layout(location = 0) in vec4 aClip;
layout(location = 1) in vec2 aSide;  // x: pixels from the line's middle, y: half its width in pixels
layout(location = 2) in vec4 aColor; // linear, with opacity
out vec2 vSide;
out vec4 vColor;

void main() {
  gl_Position = aClip;
  vSide = aSide;
  vColor = aColor;
}
