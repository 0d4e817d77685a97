// Programs of the graphics processor.

const HEAD = "#version 300 es\nprecision highp float;\nprecision highp sampler2D;\n";

/** The ground: a mesh of `mesh` vertices over the texture of heights. */
export const GROUND = [
  `${HEAD}
uniform mat4 camera;
uniform sampler2D heights;
uniform ivec2 mesh;
uniform vec2 size;
out vec3 place;
out vec2 across;
void main() {
  ivec2 vertex = ivec2(gl_VertexID % mesh.x, gl_VertexID / mesh.x);
  ivec2 texels = textureSize(heights, 0) - 1;
  ivec2 texel = vertex * texels / (mesh - 1);
  float height = texelFetch(heights, texel, 0).r;
  across = (vec2(texel) + 0.5) / vec2(texels + 1);
  place = vec3(vec2(texel) / vec2(texels) * size, height == height ? height : 0.0);
  gl_Position = camera * vec4(place, 1);
}`,
  `${HEAD}
uniform sampler2D slopes;
uniform vec3 sun;
uniform vec3 foot;
uniform float top;
uniform float contour;
in vec3 place;
in vec2 across;
out vec4 colour;
vec3 tint(float share) {
  vec3 ramp[5] = vec3[](vec3(.19, .37, .30), vec3(.42, .52, .30), vec3(.74, .62, .40), vec3(.60, .48, .42), vec3(.97, .96, .94));
  float at = clamp(share, 0.0, 1.0) * 3.999;
  return mix(ramp[int(at)], ramp[int(at) + 1], smoothstep(0.0, 1.0, fract(at)));
}
void main() {
  vec4 texel = texture(slopes, across);
  if (texel.a < 0.5) discard;
  vec2 level = texel.xy * 2.0 - 1.0;
  vec3 normal = vec3(level, sqrt(max(0.05, 1.0 - dot(level, level))));
  vec3 rock = vec3(.46, .42, .40);
  vec3 base = mix(tint(place.z / top), rock, smoothstep(0.45, 0.8, 1.0 - normal.z));
  float line = abs(fract(place.z / contour - 0.5) - 0.5) / max(fwidth(place.z / contour), 1e-5);
  base *= 1.0 - 0.16 * (1.0 - smoothstep(0.4, 1.4, line));
  float light = texel.b;
  float direct = max(dot(normal, normalize(sun)), 0.0);
  vec3 lit = base * (vec3(1.0, .93, .80) * 1.35 * direct * smoothstep(.25, .85, light) + vec3(.50, .58, .70) * (0.34 + 0.5 * light));
  // The pen's own shadow shows its height above the ground.
  float above = max(foot.z - place.z, 0.0);
  float spot = exp(-dot(place.xy - foot.xy, place.xy - foot.xy) / (4.0 + above * above * 0.4));
  lit *= 1.0 - 0.75 * spot / (1.0 + above * 0.12);
  colour = vec4(pow(lit, vec3(0.85)), 1);
}`,
];

/** Shapes of one colour with light, and the block's sides. */
export const SOLID = [
  `${HEAD}
uniform mat4 camera;
uniform mat4 model;
layout(location = 0) in vec3 at;
layout(location = 1) in vec3 normal;
out vec3 turned;
out float height;
void main() {
  turned = mat3(model) * normal;
  vec4 place = model * vec4(at, 1);
  height = place.z;
  gl_Position = camera * place;
}`,
  `${HEAD}
uniform vec4 tint;
uniform vec3 sun;
uniform float strata;
in vec3 turned;
in float height;
out vec4 colour;
void main() {
  float light = 0.55 + 0.45 * dot(normalize(turned), normalize(sun));
  float layer = 1.0 - strata * 0.07 * step(0.5, fract(height / 7.0));
  colour = vec4(tint.rgb * (0.45 + 0.75 * light) * layer, tint.a);
}`,
];

/** The path of the last seconds: points that fade. */
export const TRAIL = [
  `${HEAD}
uniform mat4 camera;
uniform float sizePx;
layout(location = 0) in vec4 at;
out float share;
void main() {
  share = at.w;
  gl_Position = camera * vec4(at.xyz, 1);
  gl_Position.z -= 0.002 * gl_Position.w;
  gl_PointSize = sizePx * (0.4 + 0.6 * at.w);
}`,
  `${HEAD}
in float share;
out vec4 colour;
void main() {
  float far = length(gl_PointCoord - 0.5);
  if (far > 0.5) discard;
  colour = vec4(1.0, .62, .25, 0.85 * share * smoothstep(0.5, 0.3, far));
}`,
];
