// @ts-check
// Points of a file that no surface can be computed from: without a position, or equal to earlier ones.

import { Tensor } from "../model/tensors.js";

/** @import { Cloud } from "../types.d.ts" */

/**
 * Rows of a tensor with a number that is missing or infinite.
 *
 * @param {Tensor} tensor
 */
export function gapsOf({ data, rows, width }) {
  const gaps = [];
  for (let row = 0; row < rows; row++) {
    for (let at = row * width; at < (row + 1) * width; at++) {
      if (Number.isFinite(data[at])) continue;
      gaps.push(row);
      break;
    }
  }
  return Uint32Array.from(gaps);
}

/**
 * Rows of normals that have no direction.
 *
 * @param {Tensor} normals
 */
export function undirectedOf({ data, rows, width }) {
  const found = [];
  for (let row = 0; row < rows; row++) {
    let size = 0;
    for (let at = row * width; at < (row + 1) * width; at++) size += Math.abs(data[at]);
    if (!(size > 0 && size < Infinity)) found.push(row);
  }
  return Uint32Array.from(found);
}

/**
 * Rows that are equal to an earlier one.
 *
 * @param {Tensor} points
 */
export function repeatsOf({ data, rows, width }) {
  const size = 2 ** Math.ceil(Math.log2(2 * rows + 1));
  // Rows by the hash of their coordinates, in a table with open addressing. 0 is an empty place.
  const places = new Uint32Array(size);
  const scratch = new Float64Array(1);
  const bits = new Uint32Array(scratch.buffer);
  const isEqual = (a, b) => {
    for (let axis = 0; axis < width; axis++) if (data[a * width + axis] !== data[b * width + axis]) return false;
    return true;
  };
  const repeats = [];
  for (let row = 0; row < rows; row++) {
    let hash = 0x811c9dc5;
    for (let axis = 0; axis < width; axis++) {
      // −0 is equal to 0, and adding makes it so.
      scratch[0] = data[row * width + axis] + 0;
      hash = Math.imul(hash ^ bits[0], 0x85ebca6b);
      hash = Math.imul(hash ^ (hash >>> 15) ^ bits[1], 0xc2b2ae35);
      hash ^= hash >>> 13;
    }
    let place = (hash >>> 0) % size;
    while (places[place] !== 0 && !isEqual(places[place] - 1, row)) place = (place + 1) % size;
    if (places[place] === 0) places[place] = row + 1;
    else repeats.push(row);
  }
  return Uint32Array.from(repeats);
}

/**
 * A cloud without some of its rows, which are in ascending order.
 *
 * @param {Cloud} cloud
 * @param {Uint32Array} rows
 * @returns {Cloud}
 */
export function without(cloud, rows) {
  const { points, normals, values, nLeftOut = 0 } = cloud;
  return {
    ...cloud,
    points: kept(points, rows),
    ...(normals ? { normals: kept(normals, rows) } : {}),
    values: new Map([...values].map(([name, numbers]) => [name, keptNumbers(numbers, 1, rows)])),
    nLeftOut: nLeftOut + rows.length,
  };
}

function kept(tensor, rows) {
  return new Tensor(keptNumbers(tensor.data, tensor.width, rows), [tensor.rows - rows.length, tensor.width]);
}

/** Numbers in rows of a width, without some rows. */
function keptNumbers(numbers, width, rows) {
  const left = new numbers.constructor(numbers.length - width * rows.length);
  let [from, to] = [0, 0];
  for (const row of rows) {
    left.set(numbers.subarray(from, row * width), to);
    to += row * width - from;
    from = (row + 1) * width;
  }
  left.set(numbers.subarray(from), to);
  return left;
}
