// @ts-check
// Clouds to begin with. All but the dragon are made here, the same for everyone.

import { Tensor } from "./tensors.js";
import { inTurns } from "./turns.js";

/** @import { Cloud } from "../types.d.ts" */

/**
 * Examples by their names. Large ones are made beside the page.
 *
 * @type {Record<string, { title: string, make: () => Cloud | Promise<Cloud>, isLarge?: boolean }>}
 */
export const EXAMPLES = {
  dragon: { title: "Dragon, 12,000 points of a scan", make: dragon },
  torus: { title: "Torus, 2,000 random points", make: () => torus(2000) },
  lattice: { title: "Torus, 1,500 points of a lattice", make: () => lattice(1500) },
  sphere: { title: "Sphere, 1,500 points with noise", make: () => sphere(1500, 0.02) },
  ball: { title: "Sphere, 600 points", make: () => sphere(600, 0) },
  curve: { title: "Closed curve, 64 points", make: () => closed(64, 64) },
  part: { title: "Part of the curve, 24 points", make: () => closed(64, 24) },
  triangle: { title: "Triangle, 48 points", make: () => triangle(48) },
  half: { title: "Half an ellipse, 16 points", make: () => halfEllipse(16) },
  fineHalf: { title: "Half an ellipse, 256 points", make: () => halfEllipse(256) },
  square: { title: "Square, 64 points", make: () => square(64, true) },
  corner: { title: "Square without a corner, 56 points", make: () => square(64, false) },
  ellipse: { title: "Ellipse, 64 points", make: () => ellipse(64, 0) },
  noisy: { title: "Ellipse with noise, 32 points", make: () => ellipse(32, 0.1) },
  noisier: { title: "Ellipse with more noise, 32 points", make: () => ellipse(32, 0.25) },
  million: { title: "Torus, a million points", make: () => torus(1_000_000), isLarge: true },
};

/** A generator of uniform numbers between 0 and 1 with a fixed seed (mulberry32). */
export function uniform(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

function normal(random) {
  return Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}

function cloud(name, rows) {
  const d = rows[0].length;
  return { name, points: new Tensor(Float64Array.from(rows.flat()), [rows.length, d]), values: new Map() };
}

async function torus(n) {
  const random = uniform(1);
  const data = new Float64Array(3 * n);
  await inTurns(n, (from, to) => {
    for (let row = from; row < to; ) {
      const [u, v] = [2 * Math.PI * random(), 2 * Math.PI * random()];
      const radius = 1 + 0.4 * Math.cos(v);
      // The outer side has more area.
      if (random() > radius / 1.4) continue;
      data[3 * row] = radius * Math.cos(u);
      data[3 * row + 1] = radius * Math.sin(u);
      data[3 * row + 2] = 0.4 * Math.sin(v);
      row++;
    }
  });
  return { name: "torus", points: new Tensor(data, [n, 3]), values: new Map() };
}

function sphere(n, noise) {
  const random = uniform(2);
  const golden = Math.PI * (3 - Math.sqrt(5));
  return cloud(
    "sphere",
    Array.from({ length: n }, (_, at) => {
      const z = 1 - (2 * at + 1) / n;
      const radius = 1 + noise * normal(random);
      const across = Math.sqrt(1 - z * z);
      return [radius * across * Math.cos(golden * at), radius * across * Math.sin(golden * at), radius * z];
    }),
  );
}

/**
 * A torus of radii 1 and 0.4 with points on a lattice of the golden ratio, as many on each part of its area.
 */
function lattice(n) {
  const golden = (Math.sqrt(5) - 1) / 2;
  return cloud(
    "torus",
    Array.from({ length: n }, (_, at) => {
      const u = 2 * Math.PI * golden * at;
      const share = (2 * Math.PI * (at + 0.5)) / n;
      // The area up to v is v + 0.4 sin v of 2π.
      let v = share;
      for (let step = 0; step < 8; step++) v -= (v + 0.4 * Math.sin(v) - share) / (1 + 0.4 * Math.cos(v));
      const radius = 1 + 0.4 * Math.cos(v);
      return [radius * Math.cos(u), radius * Math.sin(u), 0.4 * Math.sin(v)];
    }),
  );
}

/** Points of a curve at equal steps of its parameter, each moved in a random direction by up to `noise`. */
function along(name, n, at, noise = 0) {
  const random = uniform(3);
  const exact = Array.from({ length: n }, (_, point) => at(point / n));
  const rows = exact.map(([x, y]) => {
    const [angle, distance] = [2 * Math.PI * random(), noise * random()];
    return [x + distance * Math.cos(angle), y + distance * Math.sin(angle)];
  });
  const fine = noise > 0 ? Array.from({ length: 257 }, (_, point) => at(point / 256)) : undefined;
  return { ...cloud(name, rows), exact: fine };
}

function ellipse(n, noise) {
  return along("ellipse", n, (t) => [2 * Math.cos(2 * Math.PI * t), Math.sin(2 * Math.PI * t)], noise);
}

function halfEllipse(n) {
  return along("half an ellipse", n, (t) => [2 * Math.cos(Math.PI * t), Math.sin(Math.PI * t)]);
}

/** The curve (sin t, sin³t + ½ cos t), which has two inflection points. */
function closed(n, kept) {
  const whole = along("closed curve", n, (share) => {
    const t = 2 * Math.PI * share;
    return [Math.sin(t), Math.sin(t) ** 3 + 0.5 * Math.cos(t)];
  });
  return { ...whole, points: new Tensor(whole.points.data.slice(0, 2 * kept), [kept, 2]) };
}

function polygon(name, n, corners) {
  return along(name, n, (t) => {
    const place = t * corners.length;
    const [from, to] = [0, 1].map((step) => corners[(Math.floor(place) + step) % corners.length]);
    return from.map((x, axis) => x + (place % 1) * (to[axis] - x));
  });
}

function triangle(n) {
  return polygon(
    "triangle",
    n,
    [90, 210, 330].map((degrees) => {
      const angle = (Math.PI * degrees) / 180;
      return [Math.cos(angle), Math.sin(angle)];
    }),
  );
}

function square(n, isWhole) {
  const whole = polygon("square", n, [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ]);
  const rows = Array.from({ length: n }, (_, row) => [...whole.points.data.subarray(2 * row, 2 * row + 2)]);
  return cloud(
    "square",
    rows.filter(([x, y]) => isWhole || x < 0.7 || y < 0.7),
  );
}

/** The dragon with the curvatures that the service found, so that it shows before anything is asked. */
async function dragon() {
  const response = await fetch("page/data/dragon.bin");
  if (!response.ok) throw new Error(`the dragon did not arrive: HTTP status ${response.status}`);
  const buffer = await response.arrayBuffer();
  const n = new DataView(buffer).getUint32(0, true);
  // Seven columns of 16 bits, each with its least and greatest number before.
  const limits = new Float32Array(buffer, 4, 14);
  const column = (at) => {
    const levels = new Uint16Array(buffer, 60 + 2 * n * at, n);
    const [least, greatest] = limits.subarray(2 * at, 2 * at + 2);
    return Float64Array.from(levels, (level) => least + (level / 65535) * (greatest - least));
  };
  const data = new Float64Array(3 * n);
  for (const axis of [0, 1, 2]) {
    for (const [row, x] of column(axis).entries()) data[3 * row + axis] = x;
  }
  const found = { mean_curvatures: column(3), mean_curvature_std: column(4) };
  const normals = new Float64Array(3 * n);
  const [polar, azimuth] = [column(5), column(6)];
  for (let row = 0; row < n; row++) {
    const across = Math.sin(polar[row]);
    normals.set([across * Math.cos(azimuth[row]), across * Math.sin(azimuth[row]), Math.cos(polar[row])], 3 * row);
  }
  const tensors = Object.fromEntries(Object.entries(found).map(([name, numbers]) => [name, new Tensor(numbers, [n])]));
  tensors.normals = new Tensor(normals, [n, 3]);
  return { name: "dragon", points: new Tensor(data, [n, 3]), values: new Map(), known: { tensors, fields: {} } };
}
