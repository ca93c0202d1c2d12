// @ts-check
// Level regions of a function on a plane, and the line of one level, drawn for every pixel of the picture.

import {
  DataTexture,
  DataUtils,
  DoubleSide,
  HalfFloatType,
  LinearFilter,
  Mesh,
  PlaneGeometry,
  RedFormat,
  ShaderMaterial,
} from "../vendor/three/three.module.min.js";

/** Width of a region of levels. */
const STEP = 0.05;

const VERTEX = `
  varying vec2 place;
  void main() {
    // Samples lie in the middles of the texture's elements, and on the edges of the plane.
    place = (uv * (WIDTH - 1.0) + 0.5) / WIDTH;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }
`;

/** Shades of green from low to high levels, and a line at that of the surface, as in Guidotti's paper. */
const FRAGMENT = `
  uniform sampler2D levels;
  varying vec2 place;
  void main() {
    float u = texture2D(levels, place).r;
    float region = floor(u / STEP + 0.5);
    float edge = u / STEP + 0.5 - region;
    float width = max(fwidth(u / STEP), 1e-6);
    // Neighbouring regions blend over a pixel.
    float blend = region - 1.0 + clamp(0.5 + edge / width, 0.5, 1.0) + clamp(0.5 - (1.0 - edge) / width, 0.0, 0.5);
    float share = clamp(0.5 + blend * STEP / 1.6, 0.0, 1.0);
    vec3 colour = mix(vec3(0.88, 0.95, 0.86), vec3(0.05, 0.35, 0.15), share);
    float line = 1.0 - smoothstep(0.75, 1.5, abs(u) / max(fwidth(u), 1e-9));
    gl_FragColor = vec4(mix(colour, vec3(0.85, 0.1, 0.1), line), 0.85);
  }
`;

/**
 * A square of two units about the origin that shows the levels of u − level, sampled row by row.
 *
 * @param {{ values: Float64Array, level: number }} levels
 * @param {number} width samples of a side
 */
export function levelPlane({ values, level }, width) {
  const halves = Uint16Array.from(values, (u) => DataUtils.toHalfFloat(Math.min(Math.max(u - level, -60000), 60000)));
  const texture = new DataTexture(halves, width, width, RedFormat, HalfFloatType);
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  const material = new ShaderMaterial({
    uniforms: { levels: { value: texture } },
    defines: { WIDTH: width.toFixed(1), STEP },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side: DoubleSide,
    transparent: true,
  });
  return new Mesh(new PlaneGeometry(2, 2), material);
}
