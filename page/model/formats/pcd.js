// @ts-check
// PCD, the format of the Point Cloud Library, in its three encodings.

import { decompressed } from "./lzf.js";
import { columnsOf, endsEarly, latin, linesFrom, numberOfWord, SCALARS, TextColumns } from "./records.js";

/** @import { Rows } from "./columns.js" */
/** @import { Scalar } from "./records.js" */

const MAX_HEADER_BYTES = 65536;

/** Most numbers of a point: the largest descriptors have some hundreds. */
const MAX_FIELDS = 4096;

/** Name of fields that fill a point up to a round size. */
const PADDING = "_";

/**
 * @param {Uint8Array} bytes
 * @returns {Rows}
 */
export function pcd(bytes) {
  const header = headerOf(bytes);
  const body = bytes.subarray(header.nBytes);
  return withColours(rowsOf(body, header), header);
}

function rowsOf(body, { fields, numbers, nPoints, encoding, nLines }) {
  if (encoding === "ascii") return textRows(body, { numbers, nPoints, nLines });
  const width = fields.reduce((sum, field) => sum + field.width, 0);
  const records = { count: nPoints, width, record: "point" };
  if (encoding === "binary") return columnsOf({ ...records, bytes: body }, numbers);
  if (encoding === "binary_compressed") {
    return columnsOf({ ...records, bytes: unpacked(body, { fields, nPoints, width }) }, numbers);
  }
  throw new Error(`DATA is "${encoding}", not ascii, binary or binary_compressed`);
}

/** The header: fields, number of points and encoding. */
function headerOf(bytes) {
  const text = latin(bytes.subarray(0, MAX_HEADER_BYTES));
  const entries = new Map();
  let [nBytes, nLines] = [0, 0];
  for (const line of text.split(/(?<=\n)/)) {
    nBytes += line.length;
    nLines++;
    const [keyword, ...words] = line.split(/[ \t\r\n\f]+/).filter(Boolean);
    if (keyword === undefined || keyword.startsWith("#")) continue;
    if (!entries.has(keyword)) entries.set(keyword, words);
    if (keyword === "DATA") break;
  }
  const [encoding] = entries.get("DATA") ?? [];
  if (encoding === undefined) throw new Error("the header does not end: it has no line DATA");
  const names = entries.get("FIELDS") ?? entries.get("COLUMNS");
  if (!names) throw new Error("the header has no line FIELDS");
  const word = (entry, at) => entries.get(entry)?.[at];
  const fields = names.map((name, at) => {
    const type = `${word("TYPE", at) ?? ""}${word("SIZE", at) ?? ""}`;
    if (!Object.hasOwn(SCALARS, type)) throw new Error(`the type of ${name}, ${type}, is unknown`);
    const count = word("COUNT", at) ?? "1";
    if (!/^\d+$/.test(count) || !(count >= 1 && count <= MAX_FIELDS))
      throw new Error(`COUNT of ${name} is not a count`);
    return { name, scalar: SCALARS[type], count: Number(count), width: SCALARS[type].size * count };
  });
  const number = (entry) => (/^\d+$/.test(word(entry, 0) ?? "") ? Number(word(entry, 0)) : NaN);
  const [nPoints] = [number("POINTS"), number("WIDTH") * number("HEIGHT")].filter(Number.isFinite);
  if (nPoints === undefined) throw new Error("the header has no number of points");
  const twice = names.find((name, at) => name !== PADDING && names.indexOf(name) < at);
  if (twice !== undefined) throw new Error(`the header names ${twice} twice`);
  if (fields.reduce((sum, { count }) => sum + count, 0) > MAX_FIELDS)
    throw new Error(`a point has more than ${MAX_FIELDS} numbers`);
  return { fields, numbers: numbersOf(fields), nPoints, encoding, nBytes, nLines };
}

/**
 * Name, type and offset of every number of a point. Numbers of one field are counted from 0, and padding has
 * names of its own until it is dropped.
 */
function numbersOf(fields) {
  /** @type {{ name: string, scalar: Scalar, offset: number }[]} */
  const numbers = [];
  let offset = 0;
  fields.forEach(({ name, scalar, count }, at) => {
    for (let index = 0; index < count; index++, offset += scalar.size) {
      const own = name === PADDING ? `__${at}` : name;
      numbers.push({ name: count === 1 ? own : `${own}_${index}`, scalar, offset });
    }
  });
  return numbers;
}

function textRows(body, { numbers, nPoints, nLines }) {
  const columns = new TextColumns(numbers.map(({ name }) => name));
  for (const { number, words } of linesFrom(body, nLines)) {
    if (columns.lines.length === nPoints) break;
    if (words.length !== numbers.length) {
      const announced = `but the header announces ${numbers.length} columns`;
      throw new Error(`line ${number}: ${words.length} numbers, ${announced}`);
    }
    words.forEach((word, at) => {
      columns.numbers[at].push(numberOfWord(word, number));
    });
    columns.lines.push(number);
  }
  if (columns.lines.length < nPoints) throw endsEarly("point", columns.lines.length, nPoints);
  return columns.rows();
}

/**
 * The points of a compressed body, one after another. The body has all numbers of the first field, then all
 * of the second, and so on, after its sizes with and without compression.
 */
function unpacked(body, { fields, nPoints, width }) {
  if (body.byteLength < 8) throw new Error("the file ends before its compressed points");
  const view = new DataView(body.buffer, body.byteOffset);
  const [nPacked, nWhole] = [view.getUint32(0, true), view.getUint32(4, true)];
  const nThere = body.byteLength - 8;
  if (nThere < nPacked) throw new Error(`the file ends at byte ${nThere} of ${nPacked} of its compressed points`);
  if (nPoints * width !== nWhole)
    throw new Error(`${nWhole} bytes are not those of ${nPoints} points with ${width} bytes each`);
  const columns = decompressed(body.subarray(8, 8 + nPacked), nWhole);
  if (!columns) throw new Error("the compressed points are damaged");
  const rows = new Uint8Array(nWhole);
  let [from, offset] = [0, 0];
  for (const field of fields) {
    for (let point = 0; point < nPoints; point++) {
      for (let byte = 0; byte < field.width; byte++) rows[point * width + offset + byte] = columns[from++];
    }
    offset += field.width;
  }
  return rows;
}

/** Replaces packed colours by three columns, and drops what fills points up. */
function withColours(rows, { numbers }) {
  const columns = new Map();
  for (const { name, scalar } of numbers) {
    const column = rows.columns.get(name);
    if (["rgb", "rgba"].includes(name) && scalar.size === 4) {
      const bits = bitsOf(column, scalar);
      for (const [colour, shift] of /** @type {const} */ ([
        ["red", 16],
        ["green", 8],
        ["blue", 0],
      ])) {
        columns.set(
          colour,
          Float64Array.from(bits, (x) => (x >>> shift) & 0xff),
        );
      }
    } else if (!name.startsWith("__")) columns.set(name, column);
  }
  return { ...rows, columns };
}

/** The bits of colours, which are often written as the float that has the same bits. */
function bitsOf(column, scalar) {
  if (scalar === SCALARS.F4) return new Uint32Array(Float32Array.from(column).buffer);
  return Uint32Array.from(column, (x) => x >>> 0);
}
