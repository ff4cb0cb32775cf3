// What is the same for all that one frame draws; the C++ side is FrameBlock in src/frame_block.h.
layout(std140) uniform FrameBlock {
  vec4 uViewRight;    // xyz: the camera's axis, w: clip x at view x = 1, depth 1
  vec4 uViewUp;       // xyz: the camera's axis, w: clip y at view y = 1, depth 1
  vec4 uViewForward;  // xyz: the camera's axis
  vec4 uPlace;        // xy: metres between lattice points, zw: the eye east and north of the anchor, metres
  vec4 uHeight;       // x: height of the anchor, y: exaggeration, z: the eye above the anchor, drawn metres
  vec4 uDepth;        // clip z = x * view depth + y; z: clip z of what is infinitely far, per w
  vec4 uGradient;     // xy: finest data cells in a metre, z: exaggeration
  vec4 uSunDirection; // xyz: towards the sun
  vec4 uHaze;         // x: density a metre at the base height (0: none), y: falloff a metre, z: the eye above the base
  vec4 uRamp;         // colour position = x * value + y; z: water level in metres, w: how far below it ground is water; 0: none
  ivec4 uStyle;       // x: colour mode, y: outline, z: cells along a patch's side, w: colour stops
  vec4 uPixel;        // x: line width in pixels, y: 1 / tau, zw: size of the picture in pixels
  vec4 uImageryLight; // x: how much of light and shade pictures take, y: their brightness
  vec4 uStops[12];    // xyz: linear colour, w: position
};
