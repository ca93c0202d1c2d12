// @ts-check
// Arrays of NumPy and JSON: rows of coordinates.

import { POSITIONS } from "../tables.js";
import { Tensor } from "../tensors.js";
import { columnsOf, endsEarly, latin, SCALARS } from "./records.js";

/** @import { Cloud } from "../../types.d.ts" */
/** @import { Rows } from "./columns.js" */

const MAX_HEADER_BYTES = 65536;

/** Types of arrays: which numbers, and whether their lowest byte comes first. */
const DTYPES = {
  "<f8": [SCALARS.F8, true],
  ">f8": [SCALARS.F8, false],
  "<f4": [SCALARS.F4, true],
  ">f4": [SCALARS.F4, false],
};

/**
 * An array [n, d] of either order, width and byte order.
 *
 * @param {Uint8Array} bytes
 * @returns {Rows}
 */
export function npy(bytes) {
  const { descr, isFortran, shape, body } = npyHeader(bytes);
  if (!Object.hasOwn(DTYPES, descr)) throw new Error(`the array has dtype '${descr}', not '<f8' or '<f4'`);
  const [scalar, isLittle] = DTYPES[descr];
  if (shape.length !== 2) throw new Error(`the array has the shape (${shape.join(", ")}), not [n, d]`);
  const [n, d] = shape;
  if (n === 0 || d === 0) throw new Error("the file has no points");
  const data = bytes.subarray(body);
  const nThere = Math.floor(data.byteLength / scalar.size);
  if (n * d > nThere) throw endsEarly("point", isFortran ? 0 : Math.floor(nThere / d), n);
  if (d !== 2 && d !== 3) throw new Error(`the npy file holds points in ${d} dimensions, and the page shows 2 or 3`);
  const axes = POSITIONS.slice(0, d);
  const places = axes.map((name, axis) => ({ name, scalar, offset: axis * scalar.size * (isFortran ? n : 1) }));
  const width = scalar.size * (isFortran ? 1 : d);
  if (!isFortran) return columnsOf({ bytes: data, count: n, width, record: "point", isLittle }, places);
  const columns = places.map(({ name, offset }) => {
    const column = { bytes: data.subarray(offset), count: n, width, record: "point", isLittle };
    return /** @type {const} */ ([name, columnsOf(column, [{ name, scalar, offset: 0 }]).columns.get(name)]);
  });
  return { columns: /** @type {Map<string, Float64Array>} */ (new Map(columns)), record: "point" };
}

function npyHeader(bytes) {
  const damaged = new Error("the header of the npy file is damaged");
  const version = bytes[6];
  if (![1, 2, 3].includes(version) || bytes.byteLength < 12) throw damaged;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const begins = version === 1 ? 10 : 12;
  const length = version === 1 ? view.getUint16(8, true) : view.getUint32(8, true);
  const header = latin(bytes.subarray(begins, begins + length));
  const descr = header.match(/'descr'\s*:\s*(?:'([^']*)'|)/);
  const order = header.match(/'fortran_order'\s*:\s*(True|False)/);
  const shape = header.match(/'shape'\s*:\s*\(([\d, ]*)\)/);
  if (length > MAX_HEADER_BYTES || header.length < length || !descr || !order || !shape) throw damaged;
  const lengths = shape[1].split(",").filter((word) => word.trim() !== "");
  return {
    descr: descr[1] ?? "of several fields",
    isFortran: order[1] === "True",
    shape: lengths.map(Number),
    body: begins + length,
  };
}

/**
 * Rows of coordinates, alone or as `points`, which may stand in `cloud` as in a request.
 *
 * @param {string} text
 * @param {string} name
 * @returns {Cloud}
 */
export function json(text, name) {
  const document = parsed(text);
  const cloud = document?.cloud ?? document;
  const points = Array.isArray(cloud) ? cloud : cloud?.points;
  const d = points?.[0]?.length;
  if (!Array.isArray(points) || !Array.isArray(points[0]) || d === 0)
    throw new Error("the JSON needs points: rows of coordinates");
  if (d !== 2 && d !== 3) throw new Error(`the file holds points in ${d} dimensions, and the page shows 2 or 3`);
  const { normals } = cloud;
  const values = [cloud, document].find((of) => !Array.isArray(of) && of.values)?.values;
  return {
    name,
    points: rowsOfJson("points", points, [points.length, d]),
    normals: normals && rowsOfJson("normals", normals, [points.length, d]),
    values: new Map(values ? [["values", Float64Array.from(numbersOfJson("values", values, points.length))]] : []),
  };
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch (error) {
    throw new Error(`the file is not JSON: ${error instanceof Error ? error.message : error}`);
  }
}

function rowsOfJson(member, rows, [n, d]) {
  if (!Array.isArray(rows) || rows.length !== n)
    throw new Error(`${member} must have one row for each of the ${n} points`);
  const data = new Float64Array(n * d);
  rows.forEach((row, at) => {
    data.set(numbersOfJson(`${member}[${at}]`, row, d), at * d);
  });
  return new Tensor(data, [n, d]);
}

function numbersOfJson(member, numbers, n) {
  const isRow = Array.isArray(numbers) && numbers.length === n && numbers.every(Number.isFinite);
  if (!isRow) throw new Error(`${member} is not a row of ${n} numbers`);
  return numbers;
}
