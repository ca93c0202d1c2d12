// @ts-check
// Rows of binary numbers, and rows of numbers in text.

import { numberOf } from "../tables.js";

/** @import { Rows } from "./columns.js" */

/**
 * A type of numbers: how one is read, and its bytes.
 *
 * @typedef {{ read: (view: DataView, offset: number, isLittle: boolean) => number, size: number }} Scalar
 */

/** Types of numbers by the names that PCD has for them. Whole numbers of 64 bits are rounded to float64. */
export const SCALARS = /** @type {Record<string, Scalar>} */ ({
  I1: { size: 1, read: (view, at) => view.getInt8(at) },
  U1: { size: 1, read: (view, at) => view.getUint8(at) },
  I2: { size: 2, read: (view, at, isLittle) => view.getInt16(at, isLittle) },
  U2: { size: 2, read: (view, at, isLittle) => view.getUint16(at, isLittle) },
  I4: { size: 4, read: (view, at, isLittle) => view.getInt32(at, isLittle) },
  U4: { size: 4, read: (view, at, isLittle) => view.getUint32(at, isLittle) },
  F4: { size: 4, read: (view, at, isLittle) => view.getFloat32(at, isLittle) },
  F8: { size: 8, read: (view, at, isLittle) => view.getFloat64(at, isLittle) },
  I8: { size: 8, read: (view, at, isLittle) => Number(view.getBigInt64(at, isLittle)) },
  U8: { size: 8, read: (view, at, isLittle) => Number(view.getBigUint64(at, isLittle)) },
});

/**
 * Columns of records of equal size, one after another.
 *
 * @param {{ bytes: Uint8Array, count: number, width: number, record: string, isLittle?: boolean }} records
 * @param {{ name: string, scalar: Scalar, offset: number }[]} fields
 * @returns {Rows}
 */
export function columnsOf({ bytes, count, width, record, isLittle = true }, fields) {
  const nThere = width > 0 ? Math.floor(bytes.byteLength / width) : 0;
  if (nThere < count) throw endsEarly(record, nThere, count);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const columns = new Map();
  for (const { name, scalar, offset } of fields) {
    const column = new Float64Array(count);
    for (let row = 0; row < count; row++) column[row] = scalar.read(view, row * width + offset, isLittle);
    columns.set(name, column);
  }
  return { columns, record };
}

/** The refusal of a file that has `nThere` whole records of those announced. */
export function endsEarly(record, nThere, announced) {
  return new Error(`the file ends before the end of ${record} ${nThere + 1} of ${announced}`);
}

/** Lines of bytes as text, each with its number in the file. */
export function* linesFrom(bytes, nBefore = 0) {
  const lines = latin(bytes).split("\n");
  for (let at = 0; at < lines.length; at++) {
    const words = lines[at].split(/[ \t\r\f]+/).filter(Boolean);
    if (words.length > 0) yield { number: nBefore + at + 1, words };
  }
}

/** Columns of text that grow with the lines that are there, whatever a header announces. */
export class TextColumns {
  /** @param {string[]} names */
  constructor(names) {
    this.names = names;
    /** @type {number[][]} */
    this.numbers = names.map(() => []);
    /** @type {number[]} */
    this.lines = [];
  }

  /** @returns {Rows} */
  rows() {
    const columns = this.numbers.map(
      (column, at) => /** @type {const} */ ([this.names[at], Float64Array.from(column)]),
    );
    return { columns: new Map(columns), lines: this.lines };
  }
}

/** A number or, as scanners write what they have not measured, NaN or an infinity. */
export function numberOfWord(word, line) {
  const infinite = word.match(/^([+-]?)inf(inity)?$/i);
  const value = infinite ? Number(`${infinite[1]}Infinity`) : numberOf(word);
  if (value === undefined) throw new Error(`line ${line}: "${word.slice(0, 40)}" is no number`);
  return value;
}

/** Bytes as text with a character for each. */
export function latin(bytes) {
  return new TextDecoder("latin1").decode(bytes);
}
