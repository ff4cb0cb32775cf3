// What a caller's pass is given of a pixel (TerrainRenderer::setPass; docs/architecture.md, "Passes").
struct Ground {
  vec3 color;      // linear light, what is drawn so far
  vec3 place;      // metres east, north and up from the pass's origin; heights as the data has them
  vec3 fromEye;    // metres from the eye in the world as it is drawn, heights exaggerated
  float distance;  // its length
  float depth;     // its part along the camera's axis, metres
  vec3 normal;     // unit, of the ground as it is drawn: east, north, up
  bool isGround;   // false: sky, a million kilometres away, with a normal straight up
};
