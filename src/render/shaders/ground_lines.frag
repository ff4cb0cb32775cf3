// Lines that lie on the ground: each pixel finds the segments near the place under it, and blends those that cover it
// (docs/architecture.md, "Lines"; Thoeny, Billeter and Pajarola 2018). The C++ side is src/line_grid.h.
uniform sampler2D uPlaces;              // from the eye, metres; w: 0 is no ground
uniform isampler2DArray uLineCells;     // a hash table of cells
uniform isampler2DArray uLineEntries;   // their lists
uniform sampler2DArray uLineStyles;     // two texels a line: linear colour and opacity; half widths in pixels and metres
uniform ivec4 uLineTable;               // x: slots less one, y: levels, zw: the eye's cell of the finest level
uniform vec4 uLineEye;                  // xy: the eye in that cell, metres; z: that cell's size; w: half the widest line, metres
uniform float uLineReach;               // half the widest line, pixels
layout(location = 0) out vec4 oColor;   // multiplied by its opacity

const int kMostSegments = 2048;
const float kBent = 0.4;     // shares of the way to the next pixel
const float kTorn = 4.0;
const float kThrough = 0.8;  // pixels from the middle of one
const float kFlattest = 1.0 / 32.0;  // sine of the angle below which ground is taken to be seen no flatter

ivec4 cellAt(int index) { return texelFetch(uLineCells, ivec3(index & 1023, (index >> 10) & 63, index >> 16), 0); }
ivec4 entryAt(int index) { return texelFetch(uLineEntries, ivec3(index & 1023, (index >> 10) & 63, index >> 16), 0); }
vec4 styleAt(int index) { return texelFetch(uLineStyles, ivec3(index & 1023, (index >> 10) & 63, index >> 16), 0); }

// The cell's list: where it begins and how long it is.
ivec2 listOf(ivec2 cell, int level) {
  uint h = uint(cell.x) * 73856093u ^ uint(cell.y) * 19349663u ^ uint(level) * 83492791u;
  h ^= h >> 16;
  h *= 0x45d9f3bu;
  h ^= h >> 16;
  for (int probe = 0; probe < 64; ++probe) {
    ivec4 slot = cellAt(int((h + uint(probe)) & uint(uLineTable.x)));
    if ((slot.w & 0xfffff) == 0) return ivec2(0);
    if (slot.xy == cell && (slot.w >> 20) == level) return ivec2(slot.z, slot.w & 0xfffff);
  }
  return ivec2(0);
}

vec2 unpacked(int ends) { return vec2(float((ends << 16) >> 16), float(ends >> 16)); }

// The ways over the ground to a pixel's neighbours along an axis, both in the axis's direction; w: are they there?
void stepsAlong(vec3 place, ivec2 pixel, ivec2 axis, out vec4 ahead, out vec4 behind) {
  ivec2 size = textureSize(uPlaces, 0);
  ivec2 after = pixel + axis, before = pixel - axis;
  vec4 a = all(lessThan(after, size)) ? texelFetch(uPlaces, after, 0) : vec4(0.0);
  vec4 b = all(greaterThanEqual(before, ivec2(0))) ? texelFetch(uPlaces, before, 0) : vec4(0.0);
  ahead = vec4(a.xyz - place, a.w);
  behind = vec4(place - b.xyz, b.w);
}
// The one on which the ground goes on.
vec3 betterStep(vec4 ahead, vec4 behind) {
  bool useAhead = ahead.w > 0.0 && (behind.w == 0.0 || dot(ahead.xyz, ahead.xyz) <= dot(behind.xyz, behind.xyz));
  return useAhead ? ahead.xyz : behind.w > 0.0 ? behind.xyz : vec3(0.0);
}
// How much the ground bends between the two, as the picture shows it: as a share of the way to the nearer one.
float bendBetween(vec4 ahead, vec4 behind) {
  if (ahead.w == 0.0 || behind.w == 0.0) return 1e9;
  vec3 change = ahead.xyz - behind.xyz;
  return length(change) / max(min(length(ahead.xyz), length(behind.xyz)), 1e-20);
}

float distanceToSegment(vec2 a, vec2 b) {
  vec2 along = b - a;
  float t = clamp(-dot(a, along) / max(dot(along, along), 1e-20), 0.0, 1.0);
  return length(a + t * along);
}

// The lines around the place under a pixel, as they cover the pixel `shift` beside it. `bent`: the plane around does not
// tell all that there is.
vec4 linesAround(ivec2 pixel, vec2 shift, out bool bent) {
  bent = false;
  if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, textureSize(uPlaces, 0)))) return vec4(0.0);
  vec4 here = texelFetch(uPlaces, pixel, 0);
  vec3 place = here.xyz;
  float depth = dot(place, uViewForward.xyz);
  float pixelsPerTangent = 0.5 * uPixel.w * uViewUp.w;
  if (here.w == 0.0 || depth <= 0.0) return vec4(0.0);

  // The plane of the ground around: the drawn triangle's, as neighbouring pixels show it, never quite edge-on.
  vec3 towardsEye = -normalize(place);
  vec4 right, left, above, below;
  stepsAlong(place, pixel, ivec2(1, 0), right, left);
  stepsAlong(place, pixel, ivec2(0, 1), above, below);
  float bend = max(bendBetween(right, left), bendBetween(above, below));
  bent = bend > kBent;
  vec3 across = cross(betterStep(right, left), betterStep(above, below));
  float area = length(across);
  vec3 normal = area > 0.0 ? across / area : vec3(0.0, 0.0, 1.0);
  if (normal.z < 0.0) normal = -normal;
  float facing = dot(normal, towardsEye);
  if (facing < kFlattest) {
    normal = normalize(normal + (kFlattest - facing) * towardsEye);
    facing = kFlattest;
  }
  vec2 slope = normal.xy / max(normal.z, 0.1);

  // The finest level whose lists hold all that can touch this pixel.
  float reach = (uLineReach + 0.75) * depth / pixelsPerTangent / facing;
  int level = clamp(int(ceil(log2(2.0 * reach / uLineEye.z))), 0, uLineTable.y - 1);
  float cellSize = uLineEye.z * exp2(float(level));
  ivec2 eyeCell = uLineTable.zw >> level;
  vec2 eyeInCell = vec2(uLineTable.zw - (eyeCell << level)) * uLineEye.z + uLineEye.xy;
  vec2 at = place.xy + eyeInCell;
  vec2 offset = floor(at / cellSize);
  vec2 inCell = at - (offset + 0.5) * cellSize;  // from the cell's middle
  ivec2 list = listOf(eyeCell + ivec2(offset), level);
  if (list.y == 0) return vec4(0.0);
  float quantum = (2.25 * cellSize + 2.0 * uLineEye.w) / 65000.0;

  // How the picture changes with a step east or north over the plane, in pixels a metre.
  vec3 east = vec3(1.0, 0.0, -slope.x), north = vec3(0.0, 1.0, -slope.y);
  vec2 middle = vec2(dot(place, uViewRight.xyz), dot(place, uViewUp.xyz));
  vec2 eastPixels = pixelsPerTangent / depth * (vec2(dot(east, uViewRight.xyz), dot(east, uViewUp.xyz)) - middle * (dot(east, uViewForward.xyz) / depth));
  vec2 northPixels = pixelsPerTangent / depth * (vec2(dot(north, uViewRight.xyz), dot(north, uViewUp.xyz)) - middle * (dot(north, uViewForward.xyz) / depth));
  float turn = eastPixels.x * northPixels.y - eastPixels.y * northPixels.x;
  turn = abs(turn) > 1e-20 ? turn : 1e-20;

  // Later lines first, each by what of it is nearest, until nothing more would be seen.
  vec4 color = vec4(0.0);
  int line = -1;
  vec4 paint = vec4(0.0);
  vec2 half_ = vec2(0.0);
  float cover = 0.0;
  int count = min(list.y, kMostSegments);
  for (int k = 0; k <= count; ++k) {
    ivec4 entry = k < count ? entryAt(list.x + k) : ivec4(0, 0, -1, 0);
    if (entry.z != line) {
      float alpha = cover * paint.a * (1.0 - color.a);
      color += vec4(paint.rgb * alpha, alpha);
      if (k == count || color.a > 0.996) break;
      line = entry.z;
      cover = 0.0;
      paint = styleAt(2 * line);
      half_ = styleAt(2 * line + 1).xy;
    }
    vec2 a = unpacked(entry.x) * quantum - inCell;
    vec2 b = unpacked(entry.y) * quantum - inCell;
    vec2 along = b - a;
    vec2 toLine = a + clamp(-dot(a, along) / max(dot(along, along), 1e-20), 0.0, 1.0) * along;
    float meters = length(toLine);
    if (meters > reach + half_.y) continue;
    if (half_.y > 0.0) {
      // Metres on the ground: how many pixels is the line's edge away? The place under the pixel itself tells.
      if (shift != vec2(0.0)) continue;
      vec2 direction = meters > 1e-6 ? toLine / meters : normalize(vec2(-along.y, along.x) + vec2(1e-20, 0.0));
      // The gradient of the distance over the picture.
      vec2 gradient = vec2(direction.x * northPixels.y - direction.y * eastPixels.y,
                           direction.y * eastPixels.x - direction.x * northPixels.x) / turn;
      float perPixel = max(length(gradient), 1e-20);
      cover = max(cover, clamp(min(0.5 - (meters - half_.y) / perPixel, 2.0 * half_.y / perPixel), 0.0, 1.0));
    } else {
      // Pixels: the segment on the plane, as the picture shows it.
      vec3 a3 = a.x * east + a.y * north, b3 = b.x * east + b.y * north;
      float depthA = depth + dot(a3, uViewForward.xyz), depthB = depth + dot(b3, uViewForward.xyz);
      float least = 0.1 * depth;
      if (depthA < least && depthB < least) continue;
      if (depthA < least) {
        float t = (least - depthA) / (depthB - depthA);
        a3 = mix(a3, b3, t);
        depthA = least;
      } else if (depthB < least) {
        float t = (least - depthB) / (depthA - depthB);
        b3 = mix(b3, a3, t);
        depthB = least;
      }
      // note: differences, so that what is small does not come out of what is large.
      vec2 aPixels = pixelsPerTangent * (vec2(dot(a3, uViewRight.xyz), dot(a3, uViewUp.xyz)) - middle * (dot(a3, uViewForward.xyz) / depth)) / depthA;
      vec2 bPixels = pixelsPerTangent * (vec2(dot(b3, uViewRight.xyz), dot(b3, uViewUp.xyz)) - middle * (dot(b3, uViewForward.xyz) / depth)) / depthB;
      // note: at the ground's edges, and of a neighbour, a line counts that runs through the pixel: planes end there.
      if ((bend > kTorn || shift != vec2(0.0)) && distanceToSegment(aPixels, bPixels) > kThrough) continue;
      float pixels = distanceToSegment(aPixels - shift, bPixels - shift);
      cover = max(cover, clamp(min(half_.x + 0.5 - pixels, 2.0 * half_.x), 0.0, 1.0));
    }
  }
  return color;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  bool bent, ignored;
  vec4 color = linesAround(pixel, vec2(0.0), bent);
  // Where the ground bends or ends, a neighbour may be nearer to a line that reaches over to this pixel.
  if (bent && color.a < 0.996) {
    for (int side = 0; side < 4; ++side) {
      ivec2 offset = ivec2(side < 2 ? 1 - 2 * side : 0, side < 2 ? 0 : 5 - 2 * side);
      vec4 other = linesAround(pixel + offset, -vec2(offset), ignored);
      if (other.a > color.a) color = other;
    }
  }
  if (color.a == 0.0) discard;
  oColor = color;
}
