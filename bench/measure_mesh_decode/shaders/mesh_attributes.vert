// A vertex as the renderer keeps it, PatchVertex with a slot.

layout(location = 0) in uint placeAndSlot;
layout(location = 1) in vec2 ownAndCoarse;

void main() {
  uvec2 inTile = uvec2(placeAndSlot & 511u, placeAndSlot >> 9 & 511u);
  place(tiles[placeAndSlot >> 18], inTile, ownAndCoarse.x);
}
