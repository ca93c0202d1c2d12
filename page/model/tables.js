// @ts-check
// Clouds as rows of numbers. docs/formats.md has the rules ("Rows of numbers"). src/files/read/table is the
// reader of the subcommands, and tests/tables holds both to the same outcomes.

/** Decimal numbers, with a decimal point. Number() alone takes "" for 0, and hexadecimal digits. */
const NUMBER = /^[+-]?(\d+(\.\d*)?|\.\d+)(e[+-]?\d+)?$/i;
const WITH_COMMA = /^[+-]?\d+,\d+(e[+-]?\d+)?$/i;
/** Groups of three digits: thousands are written so too. */
const LIKE_THOUSANDS = /^[+-]?[1-9]\d{0,2},\d{3}$/;
const MISSING = /^[+-]?nan$/i;

/** Separators with their names, in the order in which they are looked for. */
const SEPARATORS = new Map([
  [";", "semicolons"],
  ["\t", "tabs"],
  [",", "commas"],
  [" ", "spaces"],
]);

/** Names of the columns of positions, and of normals as programs write them. */
export const POSITIONS = ["x", "y", "z"];
export const NORMALS = [
  ["nx", "ny", "nz"],
  ["normal_x", "normal_y", "normal_z"],
];

/** Largest deviation of the lengths of normals from 1, for two decimals of each component. */
const MAX_DEVIATION = 0.01;

/** The number that a text is, with a decimal point. NaN if it is "nan", undefined if it is none. */
export function numberOf(text) {
  if (NUMBER.test(text)) return Number(text);
  return MISSING.test(text) ? NaN : undefined;
}

/**
 * The columns of a table by their names.
 *
 * @param {string} text
 * @returns {Map<string, Float64Array>}
 */
export function table(text) {
  return parsed(text).columns;
}

/**
 * The columns of a table that has text among its numbers: such a cell is a missing number. Columns of values
 * that have hardly any numbers are left out, and their names returned.
 *
 * @param {string} text
 */
export function lenientTable(text) {
  const { columns, nRows } = parsed(text, true);
  const isText = ([name, numbers]) => !isGeometric(name) && 2 * numbers.filter(Number.isFinite).length <= nRows;
  const textColumns = [...columns].filter(isText).map(([name]) => name);
  for (const name of textColumns) columns.delete(name);
  return { columns, textColumns };
}

function parsed(text, isLenient = false) {
  const lines = contentOf(text);
  const count = takeCount(lines);
  if (lines.length === 0) throw new Error("the file has no rows");
  const head = new Head(lines[0]);
  const names = head.names();
  const rows = head.hasNames ? lines.slice(1) : lines;
  const [columns, numbers] = columnsOf(rows, head, { names, isLenient });
  if (rows.length === 0) throw new Error("the file has no rows");
  numbers.check(head);
  if (count) checkCount(count, rows.length);
  if (!head.hasNames && head.width === 6 && areNormals(columns.slice(3))) names.splice(3, 3, ...NORMALS[0]);
  return { columns: new Map(columns.map((column, at) => [names[at], column])), nRows: rows.length };
}

/** Lines that are neither blank nor comments, with their numbers in the file. */
function contentOf(text) {
  return text
    .split(/\r?\n/)
    .map((line, at) => ({ number: at + 1, text: line }))
    .filter((line) => !/^[ \t]*($|#|\/\/)/.test(line.text));
}

/**
 * Takes the number of points from the lines, if the first is one, and the comment that may follow in XYZ
 * files.
 */
function takeCount(lines) {
  if (!/^[ \t]*\d+[ \t]*$/.test(lines[0]?.text ?? "")) return undefined;
  const { number, text } = lines.shift();
  if (lines[0]?.number === number + 1 && new Head(lines[0]).isComment()) lines.shift();
  return { number, announced: text.trim() };
}

function checkCount({ number, announced }, nRows) {
  const n = Number(announced);
  if (n === nRows) return;
  const follow = nRows === 1 ? "1 row follows" : `${nRows} rows follow`;
  throw new Error(`line ${number} announces ${announced} ${n === 1 ? "point" : "points"}, but ${follow}`);
}

/** Numbers by columns, and what was seen of their decimal marks. */
function columnsOf(rows, head, { names, isLenient }) {
  const columns = names.map(() => new Float64Array(rows.length));
  const mayMiss = names.map((name) => !isGeometric(name));
  const numbers = new Numbers(isLenient);
  rows.forEach((row, at) => {
    const cells = cellsOf(row.text, head.separator);
    if (cells.length !== head.width) throw new Error(head.widthRefusal(row, cells.length));
    cells.forEach((cell, column) => {
      columns[column][at] = numbers.read(cell, { row, column, mayMiss: mayMiss[column] });
    });
  });
  return [columns, numbers];
}

/** Whether a column is one of positions or normals, which have no missing numbers. */
function isGeometric(name) {
  return [POSITIONS, ...NORMALS].flat().includes(name.toLowerCase());
}

function areNormals(columns) {
  const [x, y, z] = columns;
  return x.every((_, row) => Math.abs(Math.hypot(x[row], y[row], z[row]) - 1) <= MAX_DEVIATION);
}

function separatorOf(line) {
  if (line.includes(";")) return ";";
  if (line.includes("\t")) return "\t";
  if (!line.includes(",")) return " ";
  const words = line.split(/ +/).filter(Boolean);
  return words.length >= 2 && words.every((word) => WITH_COMMA.test(word)) ? " " : ",";
}

function cellsOf(line, separator) {
  const cells = separator === " " ? line.split(" ").filter(Boolean) : line.split(separator);
  return cells.map((cell) => cell.replace(/^[ \t]+|[ \t]+$/g, "").replace(/^"(.*)"$/, "$1"));
}

/** The first line of the table, which decides separator and number of columns. */
class Head {
  constructor({ number, text }) {
    this.number = number;
    this.separator = separatorOf(text);
    this.cells = cellsOf(text, this.separator);
    this.hasNames = this.cells.some(Boolean) && this.cells.every((cell) => cell === "" || isName(cell));
  }

  get width() {
    return this.cells.length;
  }

  /** Whether a line after the number of points is none of the table. */
  isComment() {
    if (this.hasNames) return !this.hasPositions();
    return this.cells.some((cell) => !isNumeric(cell));
  }

  hasPositions() {
    const lower = this.cells.map((cell) => cell.toLowerCase());
    return ["x", "y"].every((axis) => lower.includes(axis));
  }

  /** Names of all columns. Columns without one are numbered. */
  names() {
    if (!this.hasNames) {
      if (this.width < 2) throw new Error(`line ${this.number}: a row has at least two coordinates`);
      return this.cells.map((_, at) => POSITIONS[at] ?? `column ${at + 1}`);
    }
    if (!this.hasPositions()) throw new Error(`line ${this.number} names no columns x and y: ${this.cells.join(", ")}`);
    const names = this.cells.map((cell, at) => cell || `column ${at + 1}`);
    const lower = names.map((name) => name.toLowerCase());
    const twice = lower.find((name, at) => lower.indexOf(name) < at);
    if (twice !== undefined) throw new Error(`line ${this.number} names ${twice} twice`);
    return names;
  }

  widthRefusal(row, width) {
    const cells = `${width} ${width === 1 ? "cell" : "cells"} between ${SEPARATORS.get(this.separator)}`;
    const remedy = this.separator === "," ? ". Numbers with decimal commas need semicolons or tabs between them" : "";
    return `line ${row.number} has ${cells}, but line ${this.number} has ${this.width}${remedy}`;
  }
}

function isNumeric(cell) {
  return NUMBER.test(cell) || WITH_COMMA.test(cell) || MISSING.test(cell);
}

/** Whether a text can name a column: it has more than digits and marks, and is no number. */
function isName(cell) {
  return /[^\d.,'"+\- ]/.test(cell) && !isNumeric(cell);
}

/** Reads numbers, which have either decimal points or decimal commas throughout a file. */
class Numbers {
  /** @param {boolean} isLenient Whether text is a missing number. */
  constructor(isLenient) {
    this.isLenient = isLenient;
    this.hasPoint = false;
    /** The first number with a comma. */
    this.withComma = undefined;
    /** Whether commas cannot stand for thousands. */
    this.areDecimal = false;
  }

  read(cell, { row, column, mayMiss }) {
    const at = `line ${row.number}:`;
    if (cell === "") return this.missing(`${at} cell ${column + 1} is empty`);
    const hasComma = WITH_COMMA.test(cell);
    const value = numberOf(hasComma ? cell.replace(",", ".") : cell);
    if (value === undefined || (Number.isNaN(value) && !mayMiss))
      return this.missing(`${at} ${quoted(cell)} is no number${remedyOf(cell)}`);
    if (!Number.isFinite(value) && !Number.isNaN(value)) throw new Error(`${at} ${quoted(cell)} is too large`);
    if (hasComma) this.sawComma(cell, at);
    else if (cell.includes(".")) this.sawPoint(cell, at);
    return value;
  }

  missing(refusal) {
    if (this.isLenient) return NaN;
    throw new Error(refusal);
  }

  sawComma(cell, at) {
    if (this.hasPoint) throw new Error(`${at} ${quoted(cell)} has a decimal comma, numbers before it a decimal point`);
    this.withComma ??= { at, cell };
    this.areDecimal ||= !LIKE_THOUSANDS.test(cell);
  }

  sawPoint(cell, at) {
    if (this.withComma) throw new Error(`${at} ${quoted(cell)} has a decimal point, numbers before it a decimal comma`);
    this.hasPoint = true;
  }

  /** Refuses a table whose commas can be read in two ways. */
  check(head) {
    if (this.withComma && !this.areDecimal) {
      const { at, cell } = this.withComma;
      throw new Error(`${at} ${quoted(cell)} may be a decimal number or thousands. Write decimal points`);
    }
    // Decimal commas double the number of columns, and leave no point.
    const mayBeTorn = head.separator === "," && !head.hasNames && head.width >= 4 && head.width % 2 === 0;
    if (mayBeTorn && !this.hasPoint) {
      const remedy = "Name the columns in a first line, or write decimal points";
      throw new Error(`line ${head.number}: commas may be decimal marks here. ${remedy}`);
    }
  }
}

function quoted(cell) {
  return `"${cell.slice(0, 40)}"`;
}

function remedyOf(cell) {
  return /^[\d.,'"+\- ]*$/.test(cell) ? ". Use one separator between columns, and none within numbers" : "";
}
