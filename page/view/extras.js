// @ts-check
// What is drawn over points and meshes: marks, arrows, curves, lines.

import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Line,
  LineBasicMaterial,
  LineSegments,
  Points,
  Vector3,
} from "../vendor/three/three.module.min.js";
import { ringMaterial } from "./material.js";

/** @import { Body } from "./body.js" */

const MAX_ARROWS = 3000;

export class Extras {
  constructor() {
    this.group = new Group();
  }

  clear() {
    for (const child of [...this.group.children]) {
      this.group.remove(child);
      child.traverse((/** @type {any} */ { geometry, material }) => {
        geometry?.dispose();
        material?.uniforms?.levels?.value.dispose();
        material?.dispose();
      });
    }
  }

  /**
   * Marks points without an answer.
   *
   * @param {Body} body
   * @param {{ points: number[], colour: number[] }} marks
   */
  mark(body, { points, colour }) {
    const { places: all, spacing } = body.arrangement;
    const material = ringMaterial(colour);
    material.uniforms.size.value = 0.5 * spacing;
    const places = new Float32Array(3 * points.length);
    const at = body.placeOf();
    points.forEach((point, row) => {
      places.set(all.subarray(3 * at(point), 3 * at(point) + 3), 3 * row);
    });
    const marks = new Points(geometryOf(places), material);
    marks.frustumCulled = false;
    this.group.add(marks);
  }

  /**
   * Arrows along vectors `[n, …]` at points, `offset` the vector's part of each row, both ways for
   * directions.
   *
   * @param {Body} body
   * @param {{ width: number, data: ArrayLike<number> }} tensor
   */
  arrows(body, tensor, { offset = 0, isBothWays = false, colour = 0x4477aa } = {}) {
    const { n, dimension: d, places, spacing } = body.arrangement;
    const every = Math.max(1, Math.ceil(n / MAX_ARROWS));
    const length = (isBothWays ? 0.6 : 1.6) * spacing * Math.sqrt(every);
    const ends = [];
    for (let at = 0; at < n; at += every) {
      const row = body.pointAt(at) * tensor.width + offset;
      const along = Array.from({ length: 3 }, (_, axis) => (axis < d ? length * tensor.data[row + axis] : 0));
      if (!along.every(Number.isFinite)) continue;
      const place = places.subarray(3 * at, 3 * at + 3);
      ends.push(
        ...along.map((c, axis) => place[axis] - (isBothWays ? c : 0)),
        ...along.map((c, axis) => place[axis] + c),
      );
    }
    this.segments(Float32Array.from(ends), colour);
  }

  /**
   * A polyline in the plane.
   *
   * @param {Body} body
   * @param {number[][]} rows
   * @param {number} colour
   */
  curve(body, rows, colour) {
    const [a, b] = body.arrangement.middle;
    const places = Float32Array.from(rows.flatMap(([x, y]) => [x - a, y - b, 0]));
    this.group.add(new Line(geometryOf(places), new LineBasicMaterial({ color: colour })));
  }

  /** Lines between pairs of places. */
  segments(places, colour) {
    const lines = new LineSegments(geometryOf(places), new LineBasicMaterial({ color: colour }));
    lines.frustumCulled = false;
    this.group.add(lines);
  }

  /**
   * A square of two units on a plane that two half edges span about a centre.
   *
   * @param {Body} body
   * @param {import("../vendor/three/three.module.min.js").Mesh} square
   * @param {{ centre: number[], along: number[], up: number[] }} plane
   */
  place(body, square, { centre, along, up }) {
    const { middle, dimension, radius } = body.arrangement;
    const [x, y, o] = [along, up, centre].map((vector) => new Vector3(...vector));
    o.sub(new Vector3(...middle));
    // In the plane it lies behind the points.
    if (dimension === 2) o.z -= 0.02 * radius;
    square.matrixAutoUpdate = false;
    square.matrix.makeBasis(x, y, new Vector3().crossVectors(x, y).normalize()).setPosition(o);
    this.group.add(square);
  }
}

/** @param {Float32Array} places */
export function geometryOf(places) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(places, 3));
  return geometry;
}
