// The ground's colour: a ramp lit by sun and sky, or one of the other modes, with outlines and haze over it.
in vec3 vPlace;
in vec2 vShading;
flat in vec4 vShadingBox;
in vec2 vGrid;
flat in int vImagery;

uniform sampler2DArray uHeights;  // metres
uniform int uTemplate;

layout(location = 0) out vec4 oColor;

const int kShaded = 0;
const int kHeight = 1;
const int kSlope = 2;
const int kNormals = 3;
const int kTiles = 4;
const int kError = 5;
const int kOutlineWireframe = 1;
const int kOutlinePatches = 2;

// The ground's height at one sample a pixel, metres: where the geometry is coarse, coasts and colours are not.
float shadingHeight(vec2 cells) {
  vec2 cell = min(floor(cells), 255.0);
  vec2 inCell = cells - cell;
  ivec3 at = ivec3(ivec2(cell), vLayers.x);
  float north = mix(texelFetch(uHeights, at, 0).r, texelFetch(uHeights, at + ivec3(1, 0, 0), 0).r, inCell.x);
  float south = mix(texelFetch(uHeights, at + ivec3(0, 1, 0), 0).r, texelFetch(uHeights, at + ivec3(1, 1, 0), 0).r, inCell.x);
  return mix(north, south, inCell.y);
}

vec3 rampColor(float value) {
  float t = clamp(value * uRamp.x + uRamp.y, 0.0, 1.0);
  vec3 color = uStops[0].rgb;
  for (int i = 1; i < uStyle.w; ++i) {
    float share = clamp((t - uStops[i - 1].w) / max(uStops[i].w - uStops[i - 1].w, 1e-6), 0.0, 1.0);
    color = mix(color, uStops[i].rgb, share);
  }
  return color;
}

// How much of a line a pixel shows, at `pixels` from its middle.
float lineShare(float pixels) { return clamp(0.5 * uPixel.x + 0.5 - pixels, 0.0, 1.0); }

float outlineShare(vec2 gridDx, vec2 gridDy) {
  // A linear function of the grid changes by this much a pixel.
  #define PER_PIXEL(a, b) max(length(vec2((a) * gridDx.x + (b) * gridDx.y, (a) * gridDy.x + (b) * gridDy.y)), 1e-9)
  float n = float(uStyle.z);
  if (uStyle.y == kOutlinePatches) {
    float pixels = vGrid.y / PER_PIXEL(0.0, 1.0);
    if (uTemplate == 0) {
      pixels = min(pixels, vGrid.x / PER_PIXEL(1.0, 0.0));
      pixels = min(pixels, (n - vGrid.x - vGrid.y) / PER_PIXEL(1.0, 1.0));
    } else {
      pixels = min(pixels, (vGrid.x - vGrid.y) / PER_PIXEL(1.0, -1.0));
      pixels = min(pixels, (n - vGrid.x) / PER_PIXEL(1.0, 0.0));
    }
    return lineShare(max(pixels, 0.0));
  }
  // The wireframe: lines of the grid, and a diagonal that alternates from cell to cell.
  vec2 cell = floor(vGrid);
  vec2 inCell = vGrid - cell;
  vec2 perPixel = vec2(PER_PIXEL(1.0, 0.0), PER_PIXEL(0.0, 1.0));
  vec2 toLine = min(inCell, 1.0 - inCell) / perPixel;
  bool falls = mod(cell.x + cell.y, 2.0) < 0.5;
  float diagonal = falls ? abs(inCell.x - inCell.y) / PER_PIXEL(1.0, -1.0)
                         : abs(inCell.x + inCell.y - 1.0) / PER_PIXEL(1.0, 1.0);
  // Where triangles become as small as the lines, the lines fade instead of filling everything.
  float crowded = max(perPixel.x, perPixel.y);
  float fade = clamp(1.35 - 3.2 * crowded, 0.0, 1.0);
  return lineShare(min(min(toLine.x, toLine.y), diagonal)) * fade;
}

// A film's response (Narkowicz 2015): contrast in the middle, and bright ground rolls off instead of being cut.
vec3 filmColor(vec3 light) {
  vec3 c = 0.70 * light;
  return clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

// How much of the sun a surface gets, by the cosine of its angle.
float sunShare(float towardsSun) {
  float sun = clamp((towardsSun + 0.12) / 1.12, 0.0, 1.0);
  return sun * (sun * (3.0 - 2.0 * sun) * 0.35 + 0.65);
}
float flatSun() { return sunShare(uSunDirection.z); }

vec3 linearFromSrgb(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}

void main() {
  vec2 cellsDx = dFdx(vShading);
  vec2 cellsDy = dFdy(vShading);
  vec2 gridDx = dFdx(vGrid);
  vec2 gridDy = dFdy(vGrid);
  // note: where a triangle is seen edge-on, what is interpolated may lie far outside of the patch.
  vec2 cells = clamp(vShading, vShadingBox.xy, vShadingBox.zw);
  if (!isGround(cells, vLayers.y)) discard;

  vec3 normal = shadingNormal(cells, cellsDx, cellsDy);
  float towardsSun = dot(normal, uSunDirection.xyz);
  int mode = uStyle.x;

  // The ground's own colour.
  vec3 ground;
  float relief = 1.0;  // how much of the light and shade to show
  bool water = false;
  float height = mode == kShaded || mode == kHeight ? shadingHeight(cells) : 0.0;
  if (mode == kShaded) {
    water = height <= uRamp.z + min(uRamp.w, 0.01) && height > uRamp.z - uRamp.w;
    ground = rampColor(height);
    // Steep ground is bare rock.
    float steep = smoothstep(0.30, 0.62, 1.0 - normal.z);
    ground = mix(ground, vec3(dot(ground, vec3(0.30, 0.50, 0.20))) * vec3(1.06, 0.98, 0.90) * 0.92, 0.75 * steep);
    if (water) ground = mix(vec3(0.06, 0.19, 0.27), vec3(0.015, 0.06, 0.14), clamp((uRamp.z - height) / 300.0, 0.0, 1.0));
  } else if (mode == kHeight) {
    ground = rampColor(height);
    relief = 0.55;
  } else if (mode == kSlope) {
    ground = rampColor(degrees(acos(clamp(normal.z, 0.0, 1.0))));
    relief = 0.25;
  } else if (mode == kNormals) {
    ground = pow(normal * 0.5 + 0.5, vec3(2.2));
    relief = 0.0;
  } else if (mode == kTiles) {
    ground = vec3(float(vLayers.z & 255), float((vLayers.z >> 8) & 255), float((vLayers.z >> 16) & 255)) / 255.0;
    ground *= ground;
    relief = 0.7;
  } else {
    ground = rampColor(intBitsToFloat(vLayers.w) * uPixel.y);
    relief = 0.4;
  }

  // Sun with a soft terminator, sky from above, a little light back from the ground.
  float sun = sunShare(towardsSun);
  float sky = 0.5 + 0.5 * normal.z;
  vec3 light = vec3(1.72, 1.54, 1.27) * sun + vec3(0.22, 0.29, 0.42) * sky + vec3(0.07, 0.06, 0.05) * (1.0 - sky);
  vec3 color = ground * mix(vec3(1.0), light, relief);
  if (mode == kShaded) color = filmColor(color);
  vec3 direction = normalize(vPlace);
  float pictured = 0.0;
  if (mode == kShaded && vImagery >= 0) {
    // A picture over the ground. Photos bring light and shade of their own: the sun is only hinted at, and flat ground
    // stays as it is in the picture.
    vec4 picture = imageryColor(vImagery, cells, cellsDx, cellsDy);
    vec3 flatLight = vec3(1.72, 1.54, 1.27) * flatSun() + vec3(0.22, 0.29, 0.42);
    vec3 tint = mix(vec3(1.0), light / flatLight, uImageryLight.x);
    pictured = picture.a;
    color = mix(color, min(linearFromSrgb(picture.rgb) * tint * uImageryLight.y, vec3(1.0)), pictured);
  }
  if (water && pictured < 1.0) {
    // Still water mirrors the sky, more so at a flat angle.
    float facing = clamp(-direction.z, 0.0, 1.0);
    float mirror = 0.03 + 0.75 * pow(1.0 - facing, 5.0);
    color = mix(color, skyColor(vec3(direction.xy, abs(direction.z))), mirror * (1.0 - pictured));
  }

  if (uStyle.y != 0) {
    vec3 ink = mode == kShaded || mode == kNormals || mode == kTiles ? vec3(0.006, 0.008, 0.012) : vec3(0.01);
    float share = outlineShare(gridDx, gridDy);
    color = mix(color, ink, share * (uStyle.y == kOutlinePatches ? 0.95 : 0.68));
  }
  color = mix(color, hazeColor(direction), hazeShare(vPlace));
  oColor = vec4(color, 1.0);
}
