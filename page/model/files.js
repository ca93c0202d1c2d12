// Clouds from files: PLY, XYZ and CSV, PCD, npy and JSON.

import { Tensor } from "./tensors.js";

/** Names of the columns of normals, as programs write them. */
const NORMALS = [
  ["nx", "ny", "nz"],
  ["normal_x", "normal_y", "normal_z"],
];

/** Reads a file by its content, or where that says nothing, by the ending of its name. */
export async function readFile(file) {
  return read(new Uint8Array(await file.arrayBuffer()), file.name);
}

export function read(bytes, name) {
  const start = latin(bytes.subarray(0, 256));
  if (start.startsWith("ply")) return cloudOf(ply(bytes), name);
  if (bytes[0] === 0x93 && start.slice(1, 6) === "NUMPY") return cloudOf(npy(bytes), name);
  if (/^(#.*\n)*\s*VERSION|^# \.PCD/.test(start)) return cloudOf(pcd(bytes), name);
  const text = new TextDecoder().decode(bytes);
  if (/^\s*[{[]/.test(text)) return ofJson(JSON.parse(text), name);
  return cloudOf(table(text), name);
}

/** A cloud from named columns: positions, normals if there are any, and everything else as values. */
function cloudOf(columns, name) {
  const names = [...columns.keys()];
  const lower = new Map(names.map((column) => [column.toLowerCase(), column]));
  const axes = ["x", "y", "z"].filter((axis) => lower.has(axis)).map((axis) => lower.get(axis));
  const positions = axes.length >= 2 ? axes : names.slice(0, Math.min(3, names.length));
  if (positions.length < 2) throw new Error("a cloud needs two or three coordinates in each row");
  const normals = NORMALS.map((group) => group.slice(0, positions.length).map((axis) => lower.get(axis)))
    .find((group) => group.every(Boolean));
  const others = names.filter((column) => !positions.includes(column) && !normals?.includes(column));
  return {
    name,
    points: interleaved(positions.map((column) => columns.get(column))),
    normals: normals && interleaved(normals.map((column) => columns.get(column))),
    values: new Map(others.map((column) => [column, columns.get(column)])),
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

// Text tables.

function table(text) {
  const lines = text.split(/\r?\n/).filter((line) => line.trim() && !/^\s*(#|\/\/)/.test(line));
  const cells = (line) => line.trim().split(/\s*[,;\t]\s*|\s+/);
  const isNumeric = (row) => row.every((cell) => cell !== "" && Number.isFinite(Number(cell)));
  const first = cells(lines[0] ?? "").map((cell) => cell.replace(/^"(.*)"$/, "$1"));
  const hasHeader = !isNumeric(first);
  // A file of XYZ format may begin with the number of its points.
  const hasCount = first.length === 1 && !hasHeader;
  const rows = lines.slice(hasHeader || hasCount ? 1 : 0).map(cells);
  const width = rows[0]?.length ?? 0;
  const wrong = rows.findIndex((row) => row.length !== width || !isNumeric(row));
  if (width === 0 || wrong >= 0) {
    throw new Error(`line ${wrong + (hasHeader || hasCount ? 2 : 1)} is not a row of ${width || "two or three"} numbers`);
  }
  // Six numbers may be a position with a colour.
  const isUnit = (row) => Math.abs(Math.hypot(...row.slice(3, 6).map(Number)) - 1) < 0.1;
  const hasNormals = width === 6 && rows.every(isUnit);
  const names = hasHeader ? first : ["x", "y", "z"].slice(0, width).concat(hasNormals ? ["nx", "ny", "nz"] : []);
  const columns = Array.from({ length: width }, () => new Float64Array(rows.length));
  rows.forEach((row, at) => row.forEach((cell, column) => (columns[column][at] = Number(cell))));
  return new Map(columns.map((column, at) => [names[at] ?? `column ${at + 1}`, column]));
}

function ofJson(document, name) {
  const { points, normals, values } = document.cloud ?? (Array.isArray(document) ? { points: document } : document);
  if (!Array.isArray(points) || points.length === 0 || ![2, 3].includes(points[0]?.length)) {
    throw new Error("the JSON needs points: rows of two or three coordinates");
  }
  const columns = (rows) => rows[0].map((_, axis) => Float64Array.from(rows, (row) => row[axis]));
  const given = values ?? document.values;
  return {
    name,
    points: interleaved(columns(points)),
    normals: normals && interleaved(columns(normals)),
    values: new Map(given ? [["values", Float64Array.from(given)]] : []),
  };
}

// Binary tables.

/** Readers of a number at a place, and their sizes, by the names that PLY has for them. */
const TYPES = {
  char: ["getInt8", 1], int8: ["getInt8", 1], uchar: ["getUint8", 1], uint8: ["getUint8", 1],
  short: ["getInt16", 2], int16: ["getInt16", 2], ushort: ["getUint16", 2], uint16: ["getUint16", 2],
  int: ["getInt32", 4], int32: ["getInt32", 4], uint: ["getUint32", 4], uint32: ["getUint32", 4],
  float: ["getFloat32", 4], float32: ["getFloat32", 4], double: ["getFloat64", 8], float64: ["getFloat64", 8],
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

function textRows(text, n, names) {
  const numbers = text.trim().split(/\s+/).map(Number);
  if (numbers.length < n * names.length) throw new Error(`the file ends before its ${n} points do`);
  return new Map(names.map((name, column) => {
    return [name, Float64Array.from({ length: n }, (_, row) => numbers[row * names.length + column])];
  }));
}

function ply(bytes) {
  const start = latin(bytes.subarray(0, 1 << 16));
  const end = start.indexOf("end_header");
  if (end < 0) throw new Error("the PLY file has no end_header");
  const body = start.indexOf("\n", end) + 1;
  const lines = start.slice(0, end).split(/\r?\n/).map((line) => line.trim().split(/\s+/));
  const format = lines.find(([word]) => word === "format")?.[1];
  const at = lines.findIndex(([word, name]) => word === "element" && name === "vertex");
  if (at < 0 || lines.slice(0, at).some(([word]) => word === "element")) {
    throw new Error("the first element of a PLY file is to be its vertices");
  }
  const n = Number(lines[at][2]);
  const last = lines.findIndex(([word], line) => line > at && word === "element");
  const fields = lines.slice(at + 1, last < 0 ? undefined : last)
    .filter(([word]) => word === "property")
    .map(([, type, name]) => ({ type, name }));
  if (fields.some(({ type }) => !(type in TYPES))) throw new Error("a vertex of the PLY file has a list");
  if (format === "ascii") {
    const rows = latin(bytes.subarray(body)).split("\n", n).join("\n");
    return textRows(rows, n, fields.map(({ name }) => name));
  }
  return rowsOf(bytes, body, n, fields, format === "binary_little_endian");
}

const PCD_TYPES = { F4: "float", F8: "double", I1: "char", I2: "short", I4: "int", U1: "uchar", U2: "ushort", U4: "uint" };

function pcd(bytes) {
  const start = latin(bytes.subarray(0, 4096));
  const entry = (word) => start.match(new RegExp(`^${word} (.*)$`, "m"))?.[1].trim().split(/\s+/) ?? [];
  const [names, sizes, types, counts] = ["FIELDS", "SIZE", "TYPE", "COUNT"].map(entry);
  const n = Number(entry("POINTS")[0]);
  const [encoding] = entry("DATA");
  const body = start.indexOf("\n", start.search(/^DATA /m)) + 1;
  if (counts.some((count) => count !== "1")) throw new Error("fields of the PCD file have several numbers");
  if (encoding === "ascii") return withoutGaps(textRows(latin(bytes.subarray(body)), n, names));
  if (encoding !== "binary") throw new Error(`PCD files in ${encoding} are not read, ascii and binary are`);
  const fields = names.map((name, at) => ({ name, type: PCD_TYPES[types[at] + sizes[at]] }));
  return withoutGaps(rowsOf(bytes, body, n, fields, true));
}

/** Organised scans have NaN where nothing was measured. */
function withoutGaps(columns) {
  const [x] = columns.values();
  const kept = Array.from(x.keys()).filter((row) => Number.isFinite(x[row]));
  if (kept.length === x.length) return columns;
  return new Map([...columns].map(([name, column]) => [name, Float64Array.from(kept, (row) => column[row])]));
}

function npy(bytes) {
  const length = bytes[6] === 1 ? bytes[8] + 256 * bytes[9] : new DataView(bytes.buffer, bytes.byteOffset).getUint32(8, true);
  const body = (bytes[6] === 1 ? 10 : 12) + length;
  const header = latin(bytes.subarray(10, body));
  const shape = header.match(/'shape': \((\d+), (\d+),?\)/)?.slice(1).map(Number);
  const type = { "<f8": "double", "<f4": "float" }[header.match(/'descr': '([^']*)'/)?.[1]];
  if (!shape || !type || /'fortran_order': True/.test(header)) {
    throw new Error("an npy file is to hold float32 or float64 of shape [n, d], row by row");
  }
  const fields = Array.from({ length: shape[1] }, (_, at) => ({ name: ["x", "y", "z"][at] ?? `column ${at + 1}`, type }));
  return rowsOf(bytes, body, shape[0], fields, true);
}
