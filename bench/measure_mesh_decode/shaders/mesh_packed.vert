// Section 6 of Dick et al.: the index is the vertex, 10 bits of x, 10 of y, 12 of its height.

uniform int tile;

void main() {
  uint vertex = uint(gl_VertexID);
  vec4 here = tiles[tile];
  place(here, uvec2(vertex & 1023u, vertex >> 10 & 1023u), here.z + here.w * float(vertex >> 20));
}
