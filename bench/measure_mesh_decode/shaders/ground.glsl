// What both ways of drawing share: where a tile's sample is on screen.

const int kMostTiles = 512;
layout(std140) uniform DrawBlock {
  mat4 clipFromLocal;
  vec4 tiles[kMostTiles];  // west, north, and heightMeters = z + w * its packed form
  vec4 samples;            // x: metres between those of a tile
};

out float shade;

void place(vec4 tile, uvec2 inTile, float heightMeters) {
  vec2 ground = tile.xy + samples.x * vec2(float(inTile.x), -float(inTile.y));
  shade = heightMeters;
  gl_Position = clipFromLocal * vec4(ground, heightMeters, 1.0);
}
