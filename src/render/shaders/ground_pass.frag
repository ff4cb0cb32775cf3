// Around a caller's pass: what it is given, and what becomes of its colour.
uniform sampler2D terraneScene;
uniform sampler2D terranePlaces;
uniform vec4 terraneEye;         // xyz: the eye from the pass's origin, metres, heights as the data has them; w: exaggeration
uniform vec3 terraneViewRight;   // the camera's axes, the first two so long that the picture's edge is at 1
uniform vec3 terraneViewUp;
uniform vec3 terraneViewForward;
in vec2 vClip;
layout(location = 0) out vec4 terraneColor;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 here = texelFetch(terranePlaces, pixel, 0);
  Ground ground;
  ground.color = texelFetch(terraneScene, pixel, 0).rgb;
  ground.isGround = here.w > 0.0;
  if (ground.isGround) {
    ground.fromEye = here.xyz;
    float steps = here.w - 1.0;
    float high = floor(steps / 4096.0);
    vec2 flat_ = vec2(high, steps - 4096.0 * high) / 4094.0 * 2.0 - 1.0;
    ground.normal = vec3(flat_, sqrt(max(1.0 - dot(flat_, flat_), 0.0)));
  } else {
    ground.fromEye = 1e9 * normalize(terraneViewForward + vClip.x * terraneViewRight + vClip.y * terraneViewUp);
    ground.normal = vec3(0.0, 0.0, 1.0);
  }
  ground.distance = length(ground.fromEye);
  ground.depth = dot(ground.fromEye, terraneViewForward);
  ground.place = vec3(ground.fromEye.xy, ground.fromEye.z / terraneEye.w) + terraneEye.xyz;
  vec3 color = apply(ground);
  // What is no colour leaves the picture as it was.
  if (any(isnan(color)) || any(isinf(color))) color = ground.color;
  terraneColor = vec4(clamp(color, 0.0, 64.0), 1.0);
}
