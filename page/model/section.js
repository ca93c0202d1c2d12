// @ts-check
// Level regions of the function u whose level 1 is the surface, on a plane.

import { Tensor } from "./tensors.js";
import { compute } from "./service.js";

/** Samples along a side of the plane. */
export const WIDTH = 200;

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
