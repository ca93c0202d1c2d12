// @ts-check
// Level regions of the function u whose level 1 is the surface, on a plane.

import { Tensor } from "./tensors.js";
import { compute } from "./service.js";

/** Pixels of a side. */
export const WIDTH = 200;

/** Width of a region of levels. */
const STEP = 0.05;

/** Shades of green from low to high levels, and the line of the surface's level, as in Guidotti's paper. */
const LOW = [0.88, 0.95, 0.86];
const HIGH = [0.05, 0.35, 0.15];
const LINE = [0.85, 0.1, 0.1];

/**
 * The plane through a cloud at right angles to an axis, at a part of the cloud's extent. Flat clouds are
 * their own. Returns the centre and two half edges.
 *
 * @param {Tensor} points
 * @param {number} axis
 * @param {number} share
 */
export function planeOf(points, axis, share) {
  const d = points.width;
  const range = (at) => {
    let [least, greatest] = [Infinity, -Infinity];
    for (let row = 0; row < points.rows; row++) {
      least = Math.min(least, points.data[row * d + at]);
      greatest = Math.max(greatest, points.data[row * d + at]);
    }
    return [least, greatest];
  };
  const ranges = [0, 1, 2].map((at) => (at < d ? range(at) : [0, 0]));
  const centre = ranges.map(([least, greatest]) => 0.5 * (least + greatest));
  const half = 0.6 * Math.max(...ranges.map(([least, greatest]) => greatest - least));
  const normal = d === 2 ? 2 : axis;
  if (d === 3) centre[axis] = ranges[axis][0] + share * (ranges[axis][1] - ranges[axis][0]);
  const unit = (at) => [0, 1, 2].map((other) => (other === at ? half : 0));
  const [first, second] = [
    [1, 2],
    [2, 0],
    [0, 1],
  ][normal];
  return { centre, along: unit(first), up: unit(second) };
}

/** Values of u on a plane, row by row, and the level of the surface: their mean at the points. */
export async function valuesOn(plane, { cloudId, points, request, used, signal }) {
  const d = points.width;
  const n = points.rows;
  const queries = new Float64Array((WIDTH * WIDTH + n) * d);
  queries.set(points.data, WIDTH * WIDTH * d);
  for (let row = 0; row < WIDTH; row++) {
    for (let column = 0; column < WIDTH; column++) {
      const [a, b] = [column, row].map((at) => (2 * at) / (WIDTH - 1) - 1);
      for (let axis = 0; axis < d; axis++) {
        queries[(row * WIDTH + column) * d + axis] = plane.centre[axis] + a * plane.along[axis] + b * plane.up[axis];
      }
    }
  }
  const tensors = {
    values: new Tensor(new Float64Array(n).fill(1), [n]),
    queries: new Tensor(queries, [WIDTH * WIDTH + n, d]),
  };
  // The function of 1 with the kernel that served the answer, and without a mean, which would be 1 itself.
  /** @type {Record<string, any>} */
  const members = { mean: "zero" };
  for (const name of ["kernel", "alpha"]) {
    const value = request[name] ?? (used?.solver === "local" ? undefined : used?.[name]);
    if (value !== undefined) members[name] = value;
  }
  if (request.duplicates) members.duplicates = request.duplicates;
  const body = { cloud: { id: cloudId }, ...members };
  const answer = await compute("v1/interpolation", body, { nPoints: 0, signal, tensors });
  const found = Float64Array.from(answer.tensors.values.data);
  const level = found.subarray(WIDTH * WIDTH).reduce((sum, u) => sum + u, 0) / n;
  return { values: found.subarray(0, WIDTH * WIDTH), level };
}

/** Pixels of the level regions, with a line where u has the level of the surface. */
export function pixelsOf({ values, level }) {
  const pixels = new Uint8Array(4 * WIDTH * WIDTH);
  values.forEach((u, at) => {
    const neighbours = [
      (at + 1) % WIDTH === 0 ? u : values[at + 1],
      at + WIDTH < values.length ? values[at + WIDTH] : u,
    ];
    const isOnSurface = neighbours.some((next) => (u - level) * (next - level) < 0);
    const share = Math.min(Math.max(0.5 + (Math.round((u - level) / STEP) * STEP) / 1.6, 0), 1);
    const colour = isOnSurface ? LINE : LOW.map((channel, of) => channel + share * (HIGH[of] - channel));
    pixels.set([...colour.map((channel) => Math.round(255 * channel)), 255], 4 * at);
  });
  return pixels;
}
