// @ts-check
// Files that the page makes: PLY and CSV with the columns of a cloud, and the points alone as JSON.

/** @import { Cloud, Column } from "../../types.d.ts" */
/** @import { Tensor } from "../tensors.js" */

/** Rows that are written at a time, so that the page answers meanwhile. */
const BLOCK = 20_000;

/** Lets the page answer before more is written. */
const pause = () => new Promise((resume) => setTimeout(resume, 0));

/**
 * The points of a cloud, and its normals, in all digits: what a snippet sends to the service.
 *
 * @param {Cloud} cloud
 * @param {string} mediaType
 */
export async function cloudFile({ points, normals }, mediaType) {
  const columns = normals ? vectors(["nx", "ny", "nz"], normals) : [];
  if (mediaType === "model/ply") return plyOf({ points, columns });
  const rows = { points: points.lists(), ...(normals ? { normals: normals.lists() } : {}) };
  const text = JSON.stringify(rows);
  return new Blob([text], { type: mediaType });
}

/**
 * Columns of a tensor with vectors.
 *
 * @param {string[]} names
 * @param {Tensor} tensor
 * @returns {Column[]}
 */
export function vectors(names, { data, shape: [n, d] }) {
  return names.slice(0, d).map((name, axis) => {
    const values = new Float64Array(n);
    for (let row = 0; row < n; row++) values[row] = data[row * d + axis];
    return { name, values };
  });
}

/** Names that a PLY file has for colours and positions, which columns may not have. */
const TAKEN = ["x", "y", "z", "red", "green", "blue"];

/**
 * Names of columns as words without blanks, each once.
 *
 * @param {Column[]} columns
 */
export function distinctNames(columns) {
  const taken = new Set(TAKEN);
  return columns.map(({ name }) => {
    const word =
      name
        .trim()
        .replace(/\s+/g, "_")
        .replace(/[^\x21-\x7e]/g, "_") || "column";
    let distinct = word;
    for (let at = 2; taken.has(distinct.toLowerCase()); at++)
      distinct = TAKEN.includes(word.toLowerCase()) && at === 2 ? `file_${word}` : `${word}_${at}`;
    taken.add(distinct.toLowerCase());
    return distinct;
  });
}

/**
 * A binary PLY file. Points in the plane get the third coordinate 0. Numbers are doubles, colours bytes.
 *
 * @param {{ points: Tensor, columns: Column[], colours?: Uint8Array, cells?: Tensor }} table
 */
export async function plyOf({ points, columns, colours, cells }) {
  const [n, d] = points.shape;
  const names = distinctNames(columns);
  const nTriangles = cells?.width === 3 ? cells.rows : 0;
  const header = [
    "ply",
    "format binary_little_endian 1.0",
    `element vertex ${n}`,
    ...["x", "y", "z"].map((axis) => `property double ${axis}`),
    ...(colours ? ["red", "green", "blue"].map((name) => `property uchar ${name}`) : []),
    ...names.map((name) => `property double ${name}`),
    ...(nTriangles > 0 ? [`element face ${nTriangles}`, "property list uchar int vertex_indices"] : []),
    "end_header\n",
  ];
  const width = 24 + (colours ? 3 : 0) + 8 * columns.length;
  /** @type {BlobPart[]} */
  const parts = [header.join("\n")];
  for (let start = 0; start < n; start += BLOCK) {
    const end = Math.min(start + BLOCK, n);
    const view = new DataView(new ArrayBuffer((end - start) * width));
    let at = 0;
    for (let row = start; row < end; row++) {
      for (let axis = 0; axis < 3; axis++, at += 8)
        view.setFloat64(at, axis < d ? points.data[row * d + axis] : 0, true);
      if (colours) for (let channel = 0; channel < 3; channel++) view.setUint8(at++, colours[3 * row + channel]);
      for (const { values } of columns) {
        view.setFloat64(at, values[row], true);
        at += 8;
      }
    }
    parts.push(view.buffer);
    await pause();
  }
  if (cells && nTriangles > 0) parts.push(facesOf(cells));
  return new Blob(parts, { type: "model/ply" });
}

/** @param {Tensor} cells */
function facesOf({ data, rows: n }) {
  const view = new DataView(new ArrayBuffer(13 * n));
  for (let cell = 0; cell < n; cell++) {
    view.setUint8(13 * cell, 3);
    for (let corner = 0; corner < 3; corner++) view.setInt32(13 * cell + 1 + 4 * corner, data[3 * cell + corner], true);
  }
  return view.buffer;
}

/**
 * A CSV file with commas and decimal points. Missing numbers are written as NaN, which the page reads again.
 *
 * @param {{ points: Tensor, columns: Column[], colours?: Uint8Array }} table
 */
export async function csvOf({ points, columns, colours }) {
  const [n, d] = points.shape;
  const names = distinctNames(columns).map((name) => (/[",]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name));
  const head = [...["x", "y", "z"].slice(0, d), ...(colours ? ["red", "green", "blue"] : []), ...names];
  /** @type {BlobPart[]} */
  const parts = [`${head.join(",")}\n`];
  for (let start = 0; start < n; start += BLOCK / 4) {
    const lines = [];
    for (let row = start; row < Math.min(start + BLOCK / 4, n); row++) {
      const cells = [...points.data.subarray(row * d, (row + 1) * d)];
      if (colours) cells.push(...colours.subarray(3 * row, 3 * row + 3));
      for (const { values } of columns) cells.push(values[row]);
      lines.push(cells.join(","), "\n");
    }
    parts.push(lines.join(""));
    await pause();
  }
  return new Blob(parts, { type: "text/csv" });
}
