// @ts-check
// Clouds from files: PLY, XYZ and CSV, PCD, npy and JSON.

import { NORMALS, numberOf, POSITIONS, table } from "./tables.js";
import { Tensor } from "./tensors.js";

/** @import { Cloud } from "../types.d.ts" */

/**
 * Reads a file by its content, or where that says nothing, by the ending of its name.
 *
 * @param {File} file
 */
export async function readFile(file) {
  return read(new Uint8Array(await file.arrayBuffer()), file.name);
}

/**
 * @param {Uint8Array} bytes
 * @param {string} name
 * @returns {Cloud}
 */
export function read(bytes, name) {
  const start = latin(bytes.subarray(0, 256));
  if (start.startsWith("ply")) return cloudOf(ply(bytes), name);
  if (bytes[0] === 0x93 && start.slice(1, 6) === "NUMPY") return cloudOf(npy(bytes), name);
  if (/^(#.*\n)*\s*VERSION|^# \.PCD/.test(start)) {
    const { columns, nLeftOut } = withoutGaps(pcd(bytes));
    return { ...cloudOf(columns, name), nLeftOut };
  }
  const text = decoded(bytes);
  if (/^\s*[{[]/.test(text)) return ofJson(JSON.parse(text), name);
  return cloudOf(table(text), name);
}

/** A text without the mark that spreadsheets put before it. */
export function decoded(bytes) {
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    throw new Error("the file is not UTF-8: save it in that encoding");
  }
}

/**
 * A cloud from named columns: positions, normals if there are any, and everything else as values.
 *
 * @param {Map<string, Float64Array>} columns
 * @param {string} name
 */
export function cloudOf(columns, name) {
  const names = [...columns.keys()];
  const lower = new Map([...columns].map(([column, data]) => [column.toLowerCase(), { column, data }]));
  if (!lower.has("x") || !lower.has("y")) throw new Error(`the file has no columns x and y: ${names.join(", ")}`);
  const found = (group) => group.flatMap((axis) => lower.get(axis) ?? []);
  const positions = found(POSITIONS);
  const normals = NORMALS.map((group) => found(group.slice(0, positions.length))).find(
    (group) => group.length === positions.length,
  );
  const used = new Set([...positions, ...(normals ?? [])].map(({ column }) => column));
  return {
    name,
    points: interleaved(positions.map(({ data }) => data)),
    normals: normals && interleaved(normals.map(({ data }) => data)),
    values: new Map([...columns].filter(([column]) => !used.has(column))),
  };
}

function interleaved(columns) {
  const [n, d] = [columns[0].length, columns.length];
  const data = new Float64Array(n * d);
  columns.forEach((column, axis) => {
    for (let row = 0; row < n; row++) data[row * d + axis] = column[row];
  });
  return new Tensor(data, [n, d]);
}

function latin(bytes) {
  return new TextDecoder("latin1").decode(bytes);
}

// JSON.

function ofJson(document, name) {
  const { points, normals, values } = document.cloud ?? (Array.isArray(document) ? { points: document } : document);
  const d = points?.[0]?.length;
  if (!Array.isArray(points) || ![2, 3].includes(d))
    throw new Error("the JSON needs points: rows of two or three coordinates");
  const given = values ?? document.values;
  return {
    name,
    points: rowsOfJson("points", points, [points.length, d]),
    normals: normals && rowsOfJson("normals", normals, [points.length, d]),
    values: new Map(given ? [["values", Float64Array.from(numbersOfJson("values", given, points.length))]] : []),
  };
}

function rowsOfJson(member, rows, [n, d]) {
  if (!Array.isArray(rows) || rows.length !== n)
    throw new Error(`${member} are to have a row for each of the ${n} points`);
  const data = rows.flatMap((row, at) => numbersOfJson(`${member}[${at}]`, row, d));
  return new Tensor(Float64Array.from(data), [n, d]);
}

function numbersOfJson(member, numbers, n) {
  const isRow = Array.isArray(numbers) && numbers.length === n && numbers.every(Number.isFinite);
  if (!isRow) throw new Error(`${member} is not a row of ${n} numbers`);
  return numbers;
}

// Binary tables.

/** Readers of a number at a place, and their sizes, by the names that PLY has for them. */
const TYPES = {
  char: ["getInt8", 1],
  int8: ["getInt8", 1],
  uchar: ["getUint8", 1],
  uint8: ["getUint8", 1],
  short: ["getInt16", 2],
  int16: ["getInt16", 2],
  ushort: ["getUint16", 2],
  uint16: ["getUint16", 2],
  int: ["getInt32", 4],
  int32: ["getInt32", 4],
  uint: ["getUint32", 4],
  uint32: ["getUint32", 4],
  float: ["getFloat32", 4],
  float32: ["getFloat32", 4],
  double: ["getFloat64", 8],
  float64: ["getFloat64", 8],
};

function rowsOf(bytes, start, n, fields, isLittle) {
  const width = fields.reduce((sum, { type }) => sum + TYPES[type][1], 0);
  if (start + n * width > bytes.byteLength) throw new Error(`the file ends before its ${n} points do`);
  const view = new DataView(bytes.buffer, bytes.byteOffset + start);
  const columns = new Map();
  let offset = 0;
  for (const { name, type } of fields) {
    const [getter, size] = TYPES[type];
    const column = new Float64Array(n);
    for (let row = 0; row < n; row++) column[row] = view[getter](row * width + offset, isLittle);
    columns.set(name, column);
    offset += size;
  }
  return columns;
}

/** Rows of numbers, one a line, that begin at a byte of the file. */
function textRows(bytes, start, n, names) {
  const columns = names.map(() => new Float64Array(n));
  let line = latin(bytes.subarray(0, start)).split("\n").length - 1;
  let row = 0;
  for (const text of latin(bytes.subarray(start)).split("\n")) {
    if (row === n) break;
    line++;
    const words = text.split(/[ \t\r]+/).filter(Boolean);
    if (words.length === 0) continue;
    if (words.length !== names.length) {
      throw new Error(`line ${line} has ${words.length} numbers, but the header announces ${names.length}`);
    }
    words.forEach((word, column) => {
      columns[column][row] = numberOfRow(word, line);
    });
    row++;
  }
  if (row < n) throw new Error(`the file ends before its ${n} points do`);
  return new Map(columns.map((column, at) => [names[at], column]));
}

/** A number or, as scanners write what they have not measured, NaN or an infinity. */
function numberOfRow(word, line) {
  const value = numberOf(word) ?? (/^[+-]?inf(inity)?$/i.test(word) ? NaN : undefined);
  if (value === undefined) throw new Error(`line ${line}: "${word.slice(0, 40)}" is no number`);
  return value;
}

/** A number of rows in a header. */
function wholeOf(word) {
  if (!/^\d+$/.test(word ?? "")) throw new Error("the header has no number of points");
  return Number(word);
}

/** Whether binary numbers of PLY begin with their lowest byte, by the name of the format. */
const IS_LITTLE = { binary_little_endian: true, binary_big_endian: false };

function ply(bytes) {
  const start = latin(bytes.subarray(0, 1 << 16));
  const end = start.indexOf("end_header");
  if (end < 0) throw new Error("the PLY file has no end_header");
  const body = start.indexOf("\n", end) + 1;
  const lines = start
    .slice(0, end)
    .split(/\r?\n/)
    .map((line) => line.trim().split(/\s+/));
  const format = lines.find(([word]) => word === "format")?.[1];
  const at = lines.findIndex(([word, name]) => word === "element" && name === "vertex");
  if (at < 0 || lines.slice(0, at).some(([word]) => word === "element")) {
    throw new Error("the first element of a PLY file is to be its vertices");
  }
  const n = wholeOf(lines[at][2]);
  const last = lines.findIndex(([word], line) => line > at && word === "element");
  const fields = lines
    .slice(at + 1, last < 0 ? undefined : last)
    .filter(([word]) => word === "property")
    .map(([, type, name]) => ({ type, name }));
  if (fields.some(({ type }) => !Object.hasOwn(TYPES, type))) throw new Error("a vertex of the PLY file has a list");
  if (format === "ascii")
    return textRows(
      bytes,
      body,
      n,
      fields.map(({ name }) => name),
    );
  if (!format || !Object.hasOwn(IS_LITTLE, format)) throw new Error(`the PLY file has the unknown format ${format}`);
  return rowsOf(bytes, body, n, fields, IS_LITTLE[format]);
}

const PCD_TYPES = {
  F4: "float",
  F8: "double",
  I1: "char",
  I2: "short",
  I4: "int",
  U1: "uchar",
  U2: "ushort",
  U4: "uint",
};

function pcd(bytes) {
  const start = latin(bytes.subarray(0, 4096));
  const entry = (word) =>
    start
      .match(new RegExp(`^${word} (.*)$`, "m"))?.[1]
      .trim()
      .split(/\s+/) ?? [];
  const [names, sizes, types, counts] = ["FIELDS", "SIZE", "TYPE", "COUNT"].map(entry);
  const n = wholeOf(entry("POINTS")[0]);
  const [encoding] = entry("DATA");
  const body = start.indexOf("\n", start.search(/^DATA /m)) + 1;
  if (counts.some((count) => count !== "1")) throw new Error("fields of the PCD file have several numbers");
  if (encoding === "ascii") return textRows(bytes, body, n, names);
  if (encoding !== "binary") throw new Error(`PCD files in ${encoding} are not read, ascii and binary are`);
  const fields = names.map((name, at) => ({ name, type: PCD_TYPES[types[at] + sizes[at]] }));
  const unknown = fields.find(({ type }) => type === undefined);
  if (unknown) throw new Error(`the type of ${unknown.name} in the PCD file is unknown`);
  return rowsOf(bytes, body, n, fields, true);
}

/**
 * Columns without the rows of organised scans where nothing was measured, which have NaN, and the number of
 * those.
 */
function withoutGaps(columns) {
  const positions = POSITIONS.map((axis) => columns.get(axis)).filter(Boolean);
  const rows = Array.from(columns.values().next().value?.keys() ?? []);
  const kept = rows.filter((row) => positions.every((column) => Number.isFinite(column[row])));
  const nLeftOut = rows.length - kept.length;
  if (nLeftOut === 0) return { columns, nLeftOut };
  const known = new Map();
  for (const [name, column] of columns)
    known.set(
      name,
      Float64Array.from(kept, (row) => column[row]),
    );
  return { columns: known, nLeftOut };
}

function npy(bytes) {
  const length =
    bytes[6] === 1 ? bytes[8] + 256 * bytes[9] : new DataView(bytes.buffer, bytes.byteOffset).getUint32(8, true);
  const body = (bytes[6] === 1 ? 10 : 12) + length;
  const header = latin(bytes.subarray(10, body));
  const shape = header
    .match(/'shape': \((\d+), (\d+),?\)/)
    ?.slice(1)
    .map(Number);
  const type = { "<f8": "double", "<f4": "float" }[header.match(/'descr': '([^']*)'/)?.[1]];
  if (!shape || !type || /'fortran_order': True/.test(header)) {
    throw new Error("an npy file is to hold float32 or float64 of shape [n, d], row by row");
  }
  const [n, d] = shape;
  if (d !== 2 && d !== 3) throw new Error(`the npy file holds points in ${d} dimensions, and the page shows 2 or 3`);
  return rowsOf(
    bytes,
    body,
    n,
    POSITIONS.slice(0, d).map((name) => ({ name, type })),
    true,
  );
}
