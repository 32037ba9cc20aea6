/** The shaders that draw splats from the integers of the state (SPEC 10.1 to 10.3). */

import { ROW_BITS } from "./slot-textures.js";

/** Number of splats that an instance draws; each has four vertices, its corners. */
export const INSTANCE_SPLATS = 16;

/** Names of the samplers of the vertex shader, in the order of their texture units. */
export function samplerNames(shDegree: number): readonly string[] {
  const names = ["positions", "rotations", "shapes", "base", ...(shDegree > 0 ? ["rest0", "rest1"] : [])];
  return [...names, ...names.map((name) => `${name}Before`)]; // the values of the previous frame
}

/** Return the source of the vertex shader. A vertex is a corner of the box around the ellipse where alpha is 1/255. */
export function splatVertexShader(shDegree: number): string {
  return `#version 300 es
precision highp float;
precision highp int;
precision highp isampler2D;
uniform isampler2D ${samplerNames(shDegree).join(", ")};
uniform mat3 rotation;    // R
uniform vec3 translation; // t
uniform vec3 center;      // position of the eye in the world
uniform vec2 focal, principal, size;
uniform vec2 magnification; // of the picture, relative to pictures of the capture
uniform vec3 captureCenter; // mean center of the cameras of the capture
uniform float nearest;
uniform float unit;       // world units per lattice unit
uniform vec4 steps;       // log-scale, opacity, SH DC, SH rest
uniform uint count;       // number of splats
uniform float progress;   // of the motion to this frame: 0 is the previous frame, 1 is this one
layout(location = 0) in uvec4 slots0;
layout(location = 1) in uvec4 slots1;
layout(location = 2) in uvec4 slots2;
layout(location = 3) in uvec4 slots3;
out vec2 place;           // 1 on the ellipse
flat out vec4 paint;      // color, opacity
flat out float reach;     // the exponent on the ellipse

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);
const float LARGEST = 3.0e38;
const float LOW_PASS = 0.3;     // variance of the low-pass filter, pixels
const float MAX_APPROACH = 4.0; // the filter follows the distance up to this factor

mat3 turn(vec4 q) { // q is x, y, z and w of the quaternion
  vec3 d = q.xyz * q.xyz, s = q.yzx * q.zxy, t = q.xyz * q.w;
  return mat3(
    1.0 - 2.0 * (d.y + d.z), 2.0 * (s.z + t.z), 2.0 * (s.y - t.y),
    2.0 * (s.z - t.z), 1.0 - 2.0 * (d.x + d.z), 2.0 * (s.x + t.x),
    2.0 * (s.y + t.y), 2.0 * (s.x - t.x), 1.0 - 2.0 * (d.x + d.y));
}

// The values of a slot between the previous frame and this one.
vec4 valuesOf(isampler2D values, isampler2D valuesBefore, ivec2 at) {
  vec4 now = vec4(texelFetch(values, at, 0));
  return progress < 1.0 ? mix(vec4(texelFetch(valuesBefore, at, 0)), now, progress) : now;
}

vec4 rotationOf(ivec2 at) {
  vec4 now = normalize(vec4(texelFetch(rotations, at, 0)));
  if (progress >= 1.0) return now;
  vec4 before = normalize(vec4(texelFetch(rotationsBefore, at, 0)));
  return normalize(mix(dot(before, now) < 0.0 ? -before : before, now, progress));
}

float activate(int code) {
  return min(0.99, 1.0 / (1.0 + exp(min(80.0, -steps.y * float(code))))); // without overflow
}

float opacityOf(ivec2 at) {
  float now = activate(texelFetch(shapes, at, 0).w);
  return progress < 1.0 ? mix(activate(texelFetch(shapesBefore, at, 0).w), now, progress) : now;
}

vec3 colorOf(ivec2 at, vec3 world) {
  vec4 base4 = valuesOf(base, baseBefore, at);
  vec3 color = 0.5 + 0.28209479177387814 * steps.z * base4.xyz;
${shDegree > 0 ? SH_DEGREE_1_COLOR : ""}
  return max(color, 0.0);
}

void main() {
  gl_Position = NOWHERE;
  int corner = gl_VertexID & 3, splat = gl_VertexID >> 2;
  if (uint(${INSTANCE_SPLATS} * gl_InstanceID + splat) >= count) return;
  uint slot = (splat < 8 ? splat < 4 ? slots0 : slots1 : splat < 12 ? slots2 : slots3)[splat & 3];
  ivec2 at = ivec2(slot & ${(1 << ROW_BITS) - 1}u, slot >> ${ROW_BITS});
  vec3 world = unit * valuesOf(positions, positionsBefore, at).xyz;
  vec3 seen = rotation * world + translation;
  float opacity = opacityOf(at);
  reach = log(255.0 * opacity);
  if (!(seen.z > nearest && reach > 0.0)) return;

  // S = (R M D) (R M D)', and its projection.
  mat3 axes = transpose(rotation * turn(rotationOf(at).yzwx));
  vec3 deviations = exp(steps.x * valuesOf(shapes, shapesBefore, at).xyz);
  vec2 margin = 0.15 * size;
  vec2 slope = clamp(seen.xy / seen.z, (-margin - principal) / focal, (size + margin - principal) / focal);
  vec3 u = focal.x / seen.z * (axes[0] - slope.x * axes[2]) * deviations;
  vec3 v = focal.y / seen.z * (axes[1] - slope.y * axes[2]) * deviations;
  float approach = distance(world, captureCenter) / distance(world, center);
  vec2 scales = magnification * clamp(approach, 1.0 / MAX_APPROACH, MAX_APPROACH);
  vec2 trainedLowPass = LOW_PASS * scales * scales;
  vec2 lowPass = max(vec2(LOW_PASS), trainedLowPass);
  float a = dot(u, u), b = dot(u, v), c = dot(v, v);
  float trainedDet = (a + trainedLowPass.x) * (c + trainedLowPass.y) - b * b;
  a += lowPass.x;
  c += lowPass.y;
  float det = a * c - b * b;
  if (!(det > 0.0 && det < LARGEST)) return;
  if (lowPass != trainedLowPass) { // wider than in training
    opacity *= sqrt(clamp(trainedDet / det, 0.0, 1.0));
    reach = log(255.0 * opacity);
    if (!(reach > 0.0)) return;
  }

  // The axes of the ellipse. Two formulas give the longer axis; use the formula without cancellation.
  float half_ = 0.5 * (a - c), root = length(vec2(half_, b));
  float longer = 0.5 * (a + c) + root, shorter = det / longer;
  vec2 along = half_ >= 0.0 ? vec2(half_ + root, b) : vec2(b, root - half_);
  along = root > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  place = vec2(corner & 1, corner >> 1) * 2.0 - 1.0;
  vec2 extent = place * sqrt(2.0 * reach * vec2(longer, shorter));
  vec2 pixel = focal * seen.xy / seen.z + principal
    + extent.x * along + extent.y * vec2(-along.y, along.x);

  paint = vec4(colorOf(at, world), opacity);
  if (!(paint.r + paint.g + paint.b < LARGEST)) return;
  gl_Position = vec4(2.0 * pixel / size - 1.0, 0.0, 1.0) * vec4(1.0, -1.0, 1.0, 1.0);
}`;
}

// The SH coefficients 1, 2 and 3 of red, green and blue: the last component of `base`, then `rest0` and `rest1`.
const SH_DEGREE_1_COLOR = `  vec3 toward = normalize(world - center);
  vec4 first = valuesOf(rest0, rest0Before, at), second = valuesOf(rest1, rest1Before, at);
  vec3 s1 = vec3(base4.w, first.xy), s2 = vec3(first.zw, second.x), s3 = second.yzw;
  color += 0.4886025119029199 * steps.w * (toward.z * s2 - toward.y * s1 - toward.x * s3);`;

/** The source of the fragment shader; it outputs colors multiplied by alpha. */
export const SPLAT_FRAGMENT_SHADER = `#version 300 es
precision highp float;
in vec2 place;
flat in vec4 paint;
flat in float reach;
out vec4 pixel;
void main() {
  float far = dot(place, place);
  if (far > 1.0) discard;
  float alpha = paint.a * exp(-reach * far);
  pixel = vec4(paint.rgb * alpha, alpha);
}`;
