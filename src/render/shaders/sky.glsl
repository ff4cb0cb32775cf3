// Linear colours of the air: the sky seen along a direction, and the haze in front of the ground.
const vec3 kHorizon = vec3(0.62, 0.74, 0.86);
const vec3 kZenith = vec3(0.105, 0.245, 0.53);
const vec3 kSunGlow = vec3(1.0, 0.80, 0.52);

vec3 sunGlow(vec3 direction, float strength) {
  float towardsSun = max(dot(direction, uSunDirection.xyz), 0.0);
  return kSunGlow * (strength * (0.25 * pow(towardsSun, 6.0) + 0.5 * pow(towardsSun, 60.0)));
}

vec3 skyColor(vec3 direction) {
  // Both gradients begin softly, so that the horizon is no line.
  float up = max(direction.z, 0.0);
  up *= up / (up + 0.05);
  vec3 color = mix(kHorizon, kZenith, 1.0 - exp(-4.0 * up));
  // Below the horizon lies haze that darkens slowly, so that an island of data stands on something.
  float down = max(-direction.z, 0.0);
  down *= down / (down + 0.10);
  color = mix(color, vec3(0.27, 0.36, 0.47), 1.0 - exp(-1.8 * down));
  return color + sunGlow(direction, 0.35 * exp(-4.0 * down));
}

// The colour of the haze towards a direction: that of the sky at the horizon.
vec3 hazeColor(vec3 direction) {
  vec2 flat2 = direction.xy;
  float len = max(length(flat2), 1e-4);
  return kHorizon + sunGlow(normalize(vec3(flat2 / len, 0.08)), 0.3);
}

// Share of the light from `place` (from the eye) that haze replaces: its density falls off with height.
float hazeShare(vec3 place) {
  if (uHaze.x <= 0.0) return 0.0;
  float climb = place.z * uHaze.y;
  float mean = abs(climb) < 1e-3 ? 1.0 - 0.5 * climb : (1.0 - exp(-climb)) / climb;
  float depth = uHaze.x * length(place) * exp(-uHaze.z * uHaze.y) * mean;
  return 1.0 - exp(-depth);
}
