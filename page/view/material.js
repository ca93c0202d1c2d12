// @ts-check
// Shaders of points and meshes. A value and its deviation are attributes, so a change of range costs nothing.

import {
  Color,
  DataTexture,
  DoubleSide,
  LinearFilter,
  RGBAFormat,
  ShaderMaterial,
} from "../vendor/three/three.module.min.js";
import { textureOf } from "./colours.js";

const VERTEX = `
  attribute float value;
  attribute float deviation;
  uniform float low, high, full, hide, size, height;
  uniform bool isFlat;
  varying float t, s, dropped;
  varying vec3 n;
  void main() {
    t = (value - low) / (high - low);
    s = full > 0.0 ? min(deviation / full, 1.0) : 0.0;
    dropped = (value < -1e29 || deviation > hide) ? 1.0 : 0.0;
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    n = isFlat || dot(normal, normal) < 0.25 ? vec3(0.0, 0.0, 1.0) : normalize(normalMatrix * normal);
    gl_Position = projectionMatrix * place;
    gl_PointSize = clamp(size * projectionMatrix[1][1] * height / gl_Position.w, 1.5, 40.0);
  }
`;

const FRAGMENT = `
  uniform sampler2D colours;
  uniform bool isPoint, hasLines;
  uniform vec3 plain;
  uniform float isPlain;
  varying float t, s, dropped;
  varying vec3 n;
  void main() {
    if (dropped > 0.5 && isPlain < 0.5) discard;
    if (isPoint && length(gl_PointCoord - 0.5) > 0.5) discard;
    vec3 colour = texture2D(colours, vec2(0.002 + 0.996 * clamp(t, 0.0, 1.0), clamp(s, 0.0, 0.999))).rgb;
    // Isolines: ten regions between the ends of the colours.
    float place = 10.0 * t;
    if (hasLines && !isPoint && abs(fract(place + 0.5) - 0.5) < fwidth(place)) colour *= 0.55;
    // Lit from the viewer, on both sides: a shade tells the shape, and must not change the hue.
    float light = 0.55 + 0.45 * abs(normalize(n).z);
    gl_FragColor = vec4(mix(colour, plain, isPlain) * light, 1.0);
  }
`;

/** A material for points or triangles that are coloured by a quantity. */
export function quantityMaterial(isPoint) {
  const uniforms = {
    low: { value: 0 },
    high: { value: 1 },
    full: { value: 0 },
    hide: { value: Infinity },
    size: { value: 0.02 },
    height: { value: 600 },
    isFlat: { value: false },
    isPoint: { value: isPoint },
    hasLines: { value: false },
    isPlain: { value: 0 },
    plain: { value: new Color(0.55, 0.6, 0.68) },
    colours: { value: null },
  };
  return new ShaderMaterial({ uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: DoubleSide });
}

export function colours(isSigned) {
  const { data, width, height } = textureOf(isSigned);
  const texture = new DataTexture(data, width, height, RGBAFormat);
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

const RING_VERTEX = `
  uniform float size, height;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    gl_PointSize = clamp(2.2 * size * projectionMatrix[1][1] * height / gl_Position.w, 6.0, 40.0);
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
  const uniforms = { size: { value: 0.02 }, height: { value: 600 }, colour: { value: new Color(...colour) } };
  return new ShaderMaterial({ uniforms, vertexShader: RING_VERTEX, fragmentShader: RING_FRAGMENT });
}
