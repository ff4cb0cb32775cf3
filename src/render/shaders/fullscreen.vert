// One triangle over the whole picture, infinitely far away.
out vec2 vClip;

void main() {
  vClip = vec2(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0);
  gl_Position = vec4(vClip, uDepth.z, 1.0);
}
