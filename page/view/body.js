// @ts-check
// Points or a mesh as buffers of the graphics processor.

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  Points,
  Sphere,
} from "../vendor/three/three.module.min.js";
import { uniform } from "../model/examples.js";
import { medianOf, spacingsOf } from "../model/spacings.js";
import { inTurns, turn } from "../model/turns.js";
import { levelOf } from "./colours.js";
import { quantityMaterial } from "./material.js";

/** @import { ColourRange } from "../types.d.ts" */
/** @import { Tensor } from "../model/tensors.js" */

/** Stands for a value that there is not. Graphics processors may take NaN for a number. */
const UNKNOWN = -1e30;

/** Diameters of dots in spacings: on a surface they cover what is behind, on a curve they must not touch. */
const DOT = { surface: 2, curve: 0.4 };

/**
 * Positions as they are drawn: about their middle, since the graphics processor has 32 bits.
 *
 * @typedef {{
 *   n: number,
 *   dimension: number,
 *   middle: number[],
 *   low: number[],
 *   high: number[],
 *   places: Float32Array,
 *   order: Uint32Array | undefined,
 *   spacings: Float32Array,
 *   spacing: number,
 *   radius: number,
 * }} Arrangement
 */

/** @type {WeakMap<Tensor, Map<boolean, Arrangement>>} */
const arranged = new WeakMap();

/**
 * Arranges positions, once for each cloud. Points are shuffled, so that their beginning is a sample of all.
 *
 * @param {Tensor} positions
 * @param {boolean} isMesh
 * @returns {Promise<Arrangement>}
 */
export async function arrange(positions, isMesh) {
  const known = arranged.get(positions) ?? new Map();
  arranged.set(positions, known);
  if (!known.has(isMesh)) known.set(isMesh, await arrangement(positions, isMesh));
  return known.get(isMesh);
}

async function arrangement(positions, isMesh) {
  const [n, dimension] = positions.shape;
  const { low, high } = boundsOf(positions);
  const middle = low.map((x, axis) => 0.5 * (x + high[axis]));
  await turn();
  const order = isMesh ? undefined : await shuffled(n);
  const places = new Float32Array(3 * n);
  await inTurns(n, (from, to) => {
    for (let place = from; place < to; place++) {
      const row = (order ? order[place] : place) * dimension;
      for (let axis = 0; axis < dimension; axis++) {
        places[3 * place + axis] = positions.data[row + axis] - middle[axis];
      }
    }
  });
  const spacings = isMesh ? new Float32Array(n) : await spacingsOf(places, dimension);
  await turn();
  const sphere = new Box3().setFromBufferAttribute(new BufferAttribute(places, 3)).getBoundingSphere(new Sphere());
  const radius = sphere.radius || 1;
  const even = dimension === 2 ? (6 * radius) / n : (2.4 * radius) / Math.sqrt(n);
  const spacing = isMesh ? even : medianOf(spacings);
  return { n, dimension, middle, low, high, places, order, spacings, spacing, radius };
}

/** Ends of the coordinates. */
function boundsOf({ data, shape: [n, d] }) {
  const [low, high] = [
    [0, 0, 0],
    [0, 0, 0],
  ];
  for (let axis = 0; axis < d; axis++) [low[axis], high[axis]] = [Infinity, -Infinity];
  for (let row = 0; row < n; row++) {
    for (let axis = 0; axis < d; axis++) {
      const x = data[row * d + axis];
      if (x < low[axis]) low[axis] = x;
      if (x > high[axis]) high[axis] = x;
    }
  }
  return { low, high };
}

/** A fixed random order. */
async function shuffled(n) {
  const order = new Uint32Array(n);
  const random = uniform(7);
  await inTurns(n, (from, to) => {
    for (let at = from; at < to; at++) {
      const other = Math.floor(random() * (at + 1));
      order[at] = order[other];
      order[other] = at;
    }
  });
  return order;
}

/** Points or a mesh that is coloured by a quantity. */
export class Body {
  /**
   * @param {Arrangement} arrangement
   * @param {Tensor | undefined} cells
   */
  constructor(arrangement, cells) {
    this.arrangement = arrangement;
    const { n, places, spacings, spacing, dimension } = arrangement;
    this.isMesh = cells !== undefined && dimension === 3;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(places, 3));
    geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * n), 3));
    geometry.setAttribute("value", new BufferAttribute(new Float32Array(n), 1));
    geometry.setAttribute("deviation", new BufferAttribute(new Float32Array(n), 1));
    // Dots on a curve show where its points are, and need not cover it.
    const isEven = cells || dimension === 2;
    geometry.setAttribute("spacing", new BufferAttribute(isEven ? new Float32Array(n).fill(spacing) : spacings, 1));
    geometry.setAttribute("paint", new BufferAttribute(new Uint8Array(3 * n), 3, true));
    this.geometry = geometry;
    this.material = quantityMaterial(!this.isMesh);
    this.object = this.isMesh ? new Mesh(geometry, this.material) : new Points(geometry, this.material);
    this.object.frustumCulled = false;
    /** The place of each point, once it has been looked for.
     *
     * @type {Uint32Array | undefined}
     */
    this.places = undefined;
    this.dot = dimension === 2 ? DOT.curve : DOT.surface;
    if (!cells) return;
    if (this.isMesh) geometry.setIndex(new BufferAttribute(Uint32Array.from(cells.data), 1));
    else this.object.add(lines(geometry, cells.data, 0x8899aa));
  }

  /** The point of the cloud at a place of the buffers. */
  pointAt(place) {
    return this.arrangement.order ? this.arrangement.order[place] : place;
  }

  /** Where points of the cloud are in the buffers. */
  placeOf() {
    const { order, n } = this.arrangement;
    if (!order) return (point) => point;
    const places = this.places ?? new Uint32Array(n);
    if (!this.places) for (const [place, point] of order.entries()) places[point] = place;
    this.places = places;
    return (point) => places[point];
  }

  /** @param {Tensor | undefined} normals */
  async turn(normals) {
    const { n, dimension } = this.arrangement;
    this.material.uniforms.isFlat.value = dimension === 2 || !normals;
    if (!normals) return;
    const { normal } = this.geometry.attributes;
    await inTurns(n, (from, to) => {
      for (let place = from; place < to; place++) {
        const row = this.pointAt(place) * dimension;
        for (let axis = 0; axis < dimension; axis++) {
          const c = normals.data[row + axis];
          normal.array[3 * place + axis] = Number.isFinite(c) ? c : 0;
        }
      }
    });
    normal.needsUpdate = true;
  }

  /**
   * Fills the buffers of values and deviations.
   *
   * @param {{ values: ArrayLike<number>, deviations?: ArrayLike<number> } | undefined} quantity
   * @param {ColourRange} range
   * @param {() => boolean} isWanted
   */
  async fill(quantity, { low, high, isLogarithmic }, isWanted) {
    const { value, deviation } = this.geometry.attributes;
    const [from, to] = [low, high].map((end) => levelOf(end, isLogarithmic));
    const { values, deviations } = quantity ?? {};
    await inTurns(this.arrangement.n, (first, end) => {
      if (!isWanted()) return;
      for (let place = first; place < end; place++) {
        const point = this.pointAt(place);
        // Relative to the range, since these have 32 bits. What is not known has numbers of its own.
        const share = values ? (levelOf(values[point], isLogarithmic) - from) / (to - from) : 0;
        const off = deviations ? deviations[point] : 0;
        value.array[place] = Number.isNaN(share) ? UNKNOWN : share;
        deviation.array[place] = Number.isFinite(off) ? off : -UNKNOWN;
      }
    });
    value.needsUpdate = true;
    deviation.needsUpdate = true;
  }

  /**
   * Fills the buffer of colours of their own.
   *
   * @param {ArrayLike<number>[]} channels red, green and blue, 0 to 255
   */
  async paint(channels) {
    const { paint } = this.geometry.attributes;
    await inTurns(this.arrangement.n, (from, to) => {
      for (let place = from; place < to; place++) {
        const point = this.pointAt(place);
        for (let of = 0; of < 3; of++) paint.array[3 * place + of] = channels[of][point];
      }
    });
    paint.needsUpdate = true;
  }

  dispose() {
    this.object.traverse((/** @type {any} */ { geometry, material }) => {
      geometry?.dispose();
      material?.dispose();
    });
  }
}

/** Lines between points of a geometry. */
function lines(points, cells, colour) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", points.attributes.position);
  geometry.setIndex(new BufferAttribute(Uint32Array.from(cells), 1));
  return new LineSegments(geometry, new LineBasicMaterial({ color: colour }));
}
