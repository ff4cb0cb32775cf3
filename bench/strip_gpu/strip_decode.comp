// Strip meshes to triangles (docs/format/strip-mesh-v1.md): one invocation follows one sub-strip, a row of work
// groups is a tile. What it reads was validated before: nothing is checked here.

layout(local_size_x = 64) in;

struct Tile {
  uint firstHeader;
  uint firstWord;
  uint heightBits;
  uint triangleCount;
  uint firstTriangle;
};
layout(std430, binding = 0) readonly buffer Tiles { Tile tiles[]; };
layout(std430, binding = 1) readonly buffer Headers { uint headers[]; };
layout(std430, binding = 2) readonly buffer Entries { uint words[]; };
layout(std430, binding = 3) writeonly buffer Vertices { uint vertices[]; };

const uint kStripLength = 16u;
const ivec2 kDirections[8] = ivec2[8](ivec2(0, 1), ivec2(1, 1), ivec2(1, 0), ivec2(1, -1), ivec2(0, -1), ivec2(-1, -1),
                                      ivec2(-1, 0), ivec2(-1, 1));

// note: every tile has one more word than its entries need, so that the second one is always there.
uint entryAt(Tile tile, uint index) {
  uint bits = 2u + tile.heightBits;
  uint bit = index * bits;
  uint word = tile.firstWord + (bit >> 5);
  uint shift = bit & 31u;
  uint low = words[word] >> shift;
  uint high = shift == 0u ? 0u : words[word + 1u] << (32u - shift);
  return (low | high) & ((1u << bits) - 1u);
}

uint packVertex(ivec2 position, uint entry) {
  return uint(position.x) | uint(position.y) << 10 | (entry >> 2) << 20;
}

void main() {
  Tile tile = tiles[gl_WorkGroupID.y];
  uint strip = gl_GlobalInvocationID.x;
  uint first = strip * kStripLength;
  if (first >= tile.triangleCount) return;

  // The edge across which the first triangle is entered, from v1 (left) to v2 (right).
  uint header = headers[tile.firstHeader + strip];
  ivec2 at1 = ivec2(bitfieldExtract(header, 0, 9), bitfieldExtract(header, 9, 9));
  ivec2 edge = kDirections[bitfieldExtract(header, 18, 3)] * (1 << bitfieldExtract(header, 21, 4));
  uint entry = first + 2u;
  uint far = entryAt(tile, entry - bitfieldExtract(header, 25, 3) - 2u);
  uint near = entryAt(tile, entry - 1u);
  bool farIsV2 = bitfieldExtract(header, 28, 1) != 0u;
  uint v1 = packVertex(at1, farIsV2 ? near : far);
  uint v2 = packVertex(at1 + edge, farIsV2 ? far : near);
  uint senseRight = bitfieldExtract(header, 29, 1) ^ (entryAt(tile, entry) & 1u);

  uint count = min(kStripLength, tile.triangleCount - first);
  uint target = (tile.firstTriangle + first) * 3u;
  for (uint i = 0u; i < count; ++i) {
    uint word = entryAt(tile, entry + i);
    uint isB = word & 1u;
    uint isC = (word >> 1) & 1u;
    // Ahead is the edge turned to the left. From v1 (A_L, B_R) or v2 (A_R, B_L) the new vertex is an edge's length
    // ahead; for C it is half of it ahead of the edge's middle.
    ivec2 ahead = ivec2(edge.y, -edge.x);
    ivec2 to3 = ((senseRight | isC) != 0u ? edge + ahead : ahead) >> int(isC);
    uint v3 = packVertex(at1 + to3, word);
    vertices[target] = v1;
    vertices[target + 1u] = v2;
    vertices[target + 2u] = v3;
    target += 3u;

    // Winding left the path turns about v1, and v3 is on the right from now on.
    uint right = senseRight ^ isB;
    if (right != 0u) {
      v1 = v3;
      at1 += to3;
      edge -= to3;
    } else {
      v2 = v3;
      edge = to3;
    }
    senseRight = right ^ isC;
  }
}
