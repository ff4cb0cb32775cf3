// What a frame says of a patch's mesh, by its slot; the C++ side is MeshRecord in src/mesh_drawer.h.
uniform isampler2DArray uMeshRecords;

struct MeshPatch {
  ivec4 lattice;  // xy: the tile's origin from the anchor, z: lattice cells a sample, w: first index
  ivec4 corners;  // apex and ends of the hypotenuse, x | y << 16
  vec4 shading;   // xy: the tile's origin in the shading tile, z: a sample there, w: its cells in a finest data cell
  ivec4 layers;   // x: shading layer, y: coverage layer (-1: all ground), z: colour, w: error in pixels as float bits
  ivec4 imagery;  // x: page of its imagery (-1: none), y: morph as float bits
};

MeshPatch meshPatch(int slot) {
  ivec3 at = ivec3((slot & 63) * 5, slot >> 6, 0);
  MeshPatch patch_;
  patch_.lattice = texelFetch(uMeshRecords, at, 0);
  patch_.corners = texelFetch(uMeshRecords, at + ivec3(1, 0, 0), 0);
  patch_.shading = intBitsToFloat(texelFetch(uMeshRecords, at + ivec3(2, 0, 0), 0));
  patch_.layers = texelFetch(uMeshRecords, at + ivec3(3, 0, 0), 0);
  patch_.imagery = texelFetch(uMeshRecords, at + ivec3(4, 0, 0), 0);
  return patch_;
}

ivec2 meshPoint(int packed_) { return ivec2(packed_ & 0xffff, packed_ >> 16); }

// The height of a vertex whose own and coarse heights these are. At morph 0 it is where the level before shows it, at 1
// it is itself, exactly.
float meshHeight(vec2 heights, float morph) {
  return morph >= 1.0 ? heights.x : heights.y + morph * (heights.x - heights.y);
}
