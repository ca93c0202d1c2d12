// @ts-check
// PLY, ascii and binary of both byte orders. Elements other than vertices, and lists, are skipped.

import { columnsOf, endsEarly, latin, linesFrom, numberOfWord, SCALARS, TextColumns } from "./records.js";

/** @import { Rows } from "./columns.js" */
/** @import { Scalar } from "./records.js" */

/** Longest header in bytes, as the service has it. */
const MAX_HEADER_BYTES = 65536;

/** Names of types, which are those of PCD in records.js. */
const TYPES = {
  char: "I1",
  int8: "I1",
  uchar: "U1",
  uint8: "U1",
  short: "I2",
  int16: "I2",
  ushort: "U2",
  uint16: "U2",
  int: "I4",
  int32: "I4",
  uint: "U4",
  uint32: "U4",
  float: "F4",
  float32: "F4",
  double: "F8",
  float64: "F8",
};

const FORMATS = ["ascii", "binary_little_endian", "binary_big_endian"];

/**
 * A property of a record: a number, or a list with the type of its length.
 *
 * @typedef {{ name: string, scalar: Scalar, length?: Scalar }} Property
 * @typedef {{ name: string, count: number, properties: Property[] }} Element
 */

/**
 * @param {Uint8Array} bytes
 * @returns {Rows}
 */
export function ply(bytes) {
  const { format, elements, body, nLines } = headerOf(bytes);
  const at = elements.findIndex(({ name }) => name === "vertex");
  if (at < 0) throw new Error("the file has no element vertex");
  const [before, vertices] = [elements.slice(0, at), elements[at]];
  if (vertices.properties.every(({ length }) => length)) throw new Error("the element vertex has no scalar properties");
  const data = bytes.subarray(body);
  if (format === "ascii") return textVertices(linesFrom(data, nLines), before, vertices);
  const records = new Binary(data, format === "binary_little_endian");
  for (const element of before) records.skip(element);
  return records.vertices(vertices);
}

/** The header: format, elements in the order of the file, its number of lines, and where the data begin. */
function headerOf(bytes) {
  const text = latin(bytes.subarray(0, MAX_HEADER_BYTES));
  let format;
  /** @type {Element[]} */
  const elements = [];
  let [body, nLines] = [0, 0];
  while (true) {
    const end = text.indexOf("\n", body);
    if (end < 0) {
      throw new Error(`the header does not end: there is no line "end_header" in its first ${MAX_HEADER_BYTES} bytes`);
    }
    const line = text.slice(body, end).replace(/\r$/, "");
    body = end + 1;
    nLines++;
    if (nLines === 1 || /^(comment|obj_info)/.test(line)) continue;
    const refused = (reason) => new Error(`line ${nLines} of the header: ${reason}`);
    const words = line.split(/[ \t\f]+/).filter(Boolean);
    if (words.length === 1 && words[0] === "end_header") break;
    if (words[0] === "format" && format) throw refused("the format is given twice");
    if (words[0] === "format" && words.length === 3) {
      [, format] = words;
      if (!FORMATS.includes(words[1]) || words[2] !== "1.0") {
        const known = `${FORMATS.slice(0, 2).join(", ")} and ${FORMATS[2]} 1.0`;
        throw refused(`format "${words.slice(1).join(" ").slice(0, 40)}" is none of ${known}`);
      }
    } else if (words[0] === "element" && words.length === 3) elements.push(elementOf(words, elements, refused));
    else if (words[0] === "property") addProperty(words, elements.at(-1), refused);
    else throw refused(`"${line.slice(0, 40)}" is no line of a header`);
  }
  if (!format) throw new Error('line 2 of the header: there is no line "format"');
  return { format, elements, body, nLines };
}

/**
 * @param {string[]} words
 * @returns {Element}
 */
function elementOf([, name, count], elements, refused) {
  if (elements.some((element) => element.name === name)) throw refused(`a second element "${name.slice(0, 40)}"`);
  if (!/^\d+$/.test(count)) throw refused(`element "${name.slice(0, 40)}" has an impossible count`);
  return { name, count: Number(count), properties: [] };
}

function addProperty(words, element, refused) {
  if (!element) throw refused("it belongs to no element");
  const scalarOf = (type) => {
    if (!Object.hasOwn(TYPES, type)) throw refused(`"${type.slice(0, 40)}" is no type of PLY`);
    return SCALARS[TYPES[type]];
  };
  const isList = words[1] === "list" && words.length === 5;
  if (!isList && words.length !== 3) throw refused("a property has a type and a name");
  const name = words.at(-1);
  const length = isList ? scalarOf(words[2]) : undefined;
  const scalar = scalarOf(isList ? words[3] : words[1]);
  if (length === SCALARS.F4 || length === SCALARS.F8) throw refused("the length of a list is a whole number");
  if (element.properties.some((known) => known.name === name))
    throw refused(`a second property "${name.slice(0, 40)}"`);
  element.properties.push({ name, scalar, length });
}

/** Vertices in text, a line each. */
function textVertices(lines, before, { count, properties, name: element }) {
  const next = (name, index, announced) => {
    const { value, done } = lines.next();
    if (done) throw endsEarly(name, index, announced);
    return value;
  };
  for (const { name, count: n, properties: skipped } of before) {
    for (let index = 0; skipped.length > 0 && index < n; index++) next(name, index, n);
  }
  const columns = new TextColumns(properties.filter(({ length }) => !length).map(({ name }) => name));
  for (let index = 0; index < count; index++) {
    const { number, words } = next(element, index, count);
    let [at, column] = [0, 0];
    for (const { length } of properties) {
      if (at >= words.length) throw new Error(`line ${number}: there are too few numbers`);
      const word = words[at++];
      if (!length) columns.numbers[column++].push(numberOfWord(word, number));
      else if (/^\d+$/.test(word)) at += Number(word);
      else throw new Error(`line ${number}: "${word.slice(0, 40)}" is no length of a list`);
    }
    if (at > words.length) throw new Error(`line ${number}: there are too few numbers`);
    if (at < words.length) throw new Error(`line ${number}: there are more numbers than the header announces`);
    columns.lines.push(number);
  }
  return columns.rows();
}

/** Binary records, read one after another. */
class Binary {
  constructor(bytes, isLittle) {
    this.bytes = bytes;
    this.isLittle = isLittle;
    this.at = 0;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  /** @param {Element} element */
  skip(element) {
    const width = this.checkRoom(element);
    if (element.properties.every(({ length }) => !length)) this.at += width * element.count;
    else for (let index = 0; index < element.count; index++) this.record(element, index);
  }

  /** Refuses a count for which there are too few bytes. Returns the fewest bytes of a record. */
  checkRoom({ name, count, properties }) {
    const width = properties.reduce((sum, { scalar, length }) => sum + (length ?? scalar).size, 0);
    const room = width > 0 ? Math.floor((this.bytes.byteLength - this.at) / width) : Infinity;
    if (count > room) throw endsEarly(name, room, count);
    return width;
  }

  /** Reads a record, and hands its numbers on. */
  record({ name, count, properties }, index, take = (_) => {}) {
    const number = (scalar) => {
      if (this.at + scalar.size > this.bytes.byteLength) throw endsEarly(name, index, count);
      const value = scalar.read(this.view, this.at, this.isLittle);
      this.at += scalar.size;
      return value;
    };
    for (const { scalar, length } of properties) {
      if (!length) take(number(scalar));
      else {
        const n = number(length);
        if (n < 0) throw new Error(`${name} ${index + 1}: a list has ${n} entries`);
        if (this.at + n * scalar.size > this.bytes.byteLength) throw endsEarly(name, index, count);
        this.at += n * scalar.size;
      }
    }
  }

  /**
   * @param {Element} element
   * @returns {Rows}
   */
  vertices(element) {
    const { name: record, count, properties } = element;
    const width = this.checkRoom(element);
    if (properties.every(({ length }) => !length)) {
      let offset = 0;
      const fields = properties.map(({ name, scalar }) => {
        offset += scalar.size;
        return { name, scalar, offset: offset - scalar.size };
      });
      return columnsOf({ bytes: this.bytes.subarray(this.at), count, width, record, isLittle: this.isLittle }, fields);
    }
    const numbers = properties.filter(({ length }) => !length);
    const columns = numbers.map(({ name }) => /** @type {const} */ ([name, new Float64Array(count)]));
    for (let index = 0; index < count; index++) {
      let column = 0;
      this.record(element, index, (x) => {
        columns[column++][1][index] = x;
      });
    }
    return { columns: new Map(columns), record };
  }
}
