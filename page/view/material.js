// @ts-check
// Shaders of points and meshes. A value and its deviation are attributes, so a change of range costs nothing.

import {
  Color,
  DataTexture,
  DoubleSide,
  LinearFilter,
  RGBAFormat,
  ShaderMaterial,
  Vector3,
} from "../vendor/three/three.module.min.js";
import { textureOf } from "./colours.js";

/** @import { Scale } from "../types.d.ts" */

/** The share of a scale at which a value is, as shareOf in colours.js has it. */
const SHARE = `
  uniform float low, middle, high, full;
  uniform bool isDiverging;
  float shareOf(float value) {
    if (!isDiverging) return (value - low) / (high - low);
    return value < middle ? 0.5 * (value - low) / (middle - low) : 0.5 + 0.5 * (value - middle) / (high - middle);
  }
`;

const VERTEX = `
  attribute float value, deviation, spacing;
  attribute vec3 paint;
  uniform float hide, size, height, isPlain;
  uniform bool isPoint, isFlat, hidesAway;
  uniform vec3 boxLow, boxHigh;
  varying float v, s, dropped, radius, depth;
  varying vec3 n, own, at;
  uniform float full;
  void main() {
    v = value;
    s = full > 0.0 ? min(deviation / full, 1.0) : 0.0;
    own = paint;
    at = position;
    dropped = (value < -1e29 || deviation > hide) && isPlain < 0.5 ? 1.0 : 0.0;
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    depth = place.z;
    bool isTurned = !isFlat && dot(normal, normal) > 0.25;
    n = isTurned ? normalize(normalMatrix * normal) : vec3(0.0, 0.0, 1.0);
    gl_Position = projectionMatrix * place;
    if (!isPoint) return;
    // The radius of a dot as it is drawn: dots of a pixel or so grow to be seen.
    float pixels = size * spacing * projectionMatrix[1][1] * height / gl_Position.w;
    gl_PointSize = clamp(pixels, 2.0, 96.0);
    radius = 0.5 * size * spacing * gl_PointSize / max(pixels, 1e-6);
    vec3 toEye = isOrthographic ? vec3(0.0, 0.0, 1.0) : -normalize(place.xyz);
    bool isAway = hidesAway && isTurned && dot(n, toEye) < -0.05;
    bool isOutside = any(lessThan(position, boxLow)) || any(greaterThan(position, boxHigh));
    if (isAway || isOutside || dropped > 0.5) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
`;

const FRAGMENT = `
  uniform mat4 projectionMatrix;
  uniform sampler2D colours;
  uniform bool isPoint, hasLines, isPainted;
  uniform vec3 plain, boxLow, boxHigh;
  uniform float isPlain;
  varying float v, s, dropped, radius, depth;
  varying vec3 n, own, at;
  ${SHARE}
  void main() {
    vec3 facing = normalize(n);
    gl_FragDepth = gl_FragCoord.z;
    if (isPoint) {
      // A disc that lies in the surface. One that is seen from the side stays wide enough to be seen.
      vec2 c = vec2(2.0, -2.0) * (gl_PointCoord - 0.5);
      float across = facing.z < 0.0 ? min(facing.z, -0.3) : max(facing.z, 0.3);
      float rise = -dot(facing.xy, c) / across;
      float square = dot(c, c) + rise * rise;
      if (square > 1.0) discard;
      // Bent away from the eye, so that of two discs the nearer one has each place.
      float z = depth + radius * (rise - 0.3 * square);
      vec2 clip = vec2(projectionMatrix[2][2], projectionMatrix[2][3]) * z
        + vec2(projectionMatrix[3][2], projectionMatrix[3][3]);
      gl_FragDepth = 0.5 * clip.x / clip.y + 0.5;
    } else if (dropped > 0.5 || any(lessThan(at, boxLow)) || any(greaterThan(at, boxHigh))) discard;
    float t = shareOf(v);
    vec3 colour = texture2D(colours, vec2(0.002 + 0.996 * clamp(t, 0.0, 1.0), clamp(s, 0.0, 0.999))).rgb;
    // Lines between ten equal regions of the colours, two pixels wide at any zoom.
    float place = 10.0 * t;
    if (hasLines && !isPoint && abs(fract(place + 0.5) - 0.5) < fwidth(place)) colour *= 0.55;
    colour = mix(isPainted ? own : colour, plain, isPlain);
    // Lit from the viewer, on both sides: a shade tells the shape, and must not change the hue.
    gl_FragColor = vec4(colour * (0.55 + 0.45 * abs(facing.z)), 1.0);
  }
`;

/**
 * A material for points or triangles that are coloured by a quantity.
 *
 * @param {boolean} isPoint
 */
export function quantityMaterial(isPoint) {
  const uniforms = {
    low: { value: 0 },
    middle: { value: 0 },
    high: { value: 1 },
    isDiverging: { value: false },
    full: { value: 0 },
    hide: { value: Infinity },
    size: { value: 1 },
    height: { value: 600 },
    isFlat: { value: false },
    isPoint: { value: isPoint },
    hidesAway: { value: false },
    hasLines: { value: false },
    isPainted: { value: false },
    isPlain: { value: 0 },
    plain: { value: new Color(0.55, 0.6, 0.68) },
    colours: { value: null },
    boxLow: { value: new Vector3(-Infinity, -Infinity, -Infinity) },
    boxHigh: { value: new Vector3(Infinity, Infinity, Infinity) },
  };
  return new ShaderMaterial({ uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: DoubleSide });
}

/**
 * The colours of a scale as a texture.
 *
 * @param {Scale} scale
 */
export function colourTexture(scale) {
  const { data, width, height } = textureOf(scale);
  const texture = new DataTexture(data, width, height, RGBAFormat);
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

const RING_VERTEX = `
  uniform float size, height;
  uniform vec3 boxLow, boxHigh;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    // In front of the dot that it marks.
    gl_Position.z -= 2e-4 * gl_Position.w;
    gl_PointSize = clamp(2.2 * size * projectionMatrix[1][1] * height / gl_Position.w, 6.0, 40.0);
    bool isOutside = any(lessThan(position, boxLow)) || any(greaterThan(position, boxHigh));
    if (isOutside) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
`;

const RING_FRAGMENT = `
  uniform vec3 colour;
  void main() {
    float r = length(gl_PointCoord - 0.5);
    if (r > 0.5 || r < 0.34) discard;
    gl_FragColor = vec4(colour, 1.0);
  }
`;

/** Hollow marks at points without an answer. */
export function ringMaterial(colour) {
  const uniforms = {
    size: { value: 0.02 },
    height: { value: 600 },
    colour: { value: new Color(...colour) },
    boxLow: { value: new Vector3(-Infinity, -Infinity, -Infinity) },
    boxHigh: { value: new Vector3(Infinity, Infinity, Infinity) },
  };
  return new ShaderMaterial({ uniforms, vertexShader: RING_VERTEX, fragmentShader: RING_FRAGMENT });
}
