// @ts-check
// Columns of numbers by their names, and which of them are positions, normals and colours.

import { NORMALS, POSITIONS } from "../tables.js";
import { Tensor } from "../tensors.js";

/** @import { Cloud } from "../../types.d.ts" */

/** Names of colours as programs write them. The cloud has the first. */
const COLOURS = [
  ["red", "green", "blue"],
  ["r", "g", "b"],
  ["diffuse_red", "diffuse_green", "diffuse_blue"],
];

/**
 * The columns of a file, and what a row of them is called: "vertex 17 of 500", or "line 17".
 *
 * @typedef {{ columns: Map<string, Float64Array>, lines?: number[], record?: string }} Rows
 */

/** The treatment of rows without a position. */
export const GAPS = /** @type {const} */ ({ refused: "refused", leftOut: "leftOut", kept: "kept" });

/**
 * A cloud from named columns: positions, normals if there are any, and everything else as values. Colours are
 * values named red, green and blue.
 *
 * @param {Rows} rows
 * @param {string} name
 * @param {keyof typeof GAPS} [gaps]
 * @returns {Cloud}
 */
export function cloudOf(rows, name, gaps = "kept") {
  const names = [...rows.columns.keys()];
  const lower = new Map(names.map((column) => [column.toLowerCase(), column]));
  if (!lower.has("x") || !lower.has("y")) throw new Error(`the file has no columns x and y: ${names.join(", ")}`);
  const groups = (known) => known.map((group) => group.flatMap((word) => lower.get(word) ?? []));
  const [positions] = groups([POSITIONS]);
  const d = positions.length;
  const normals = groups(NORMALS.map((group) => group.slice(0, d))).find((group) => group.length === d);
  if (rows.columns.get(positions[0])?.length === 0) throw new Error("the file has no points");
  const { columns, nLeftOut } = withoutGaps(rows, positions, gaps);
  if (normals && gaps !== "kept") checkFinite({ ...rows, columns }, normals);
  const used = new Set([...positions, ...(normals ?? [])]);
  const others = new Map([...columns].filter(([column]) => !used.has(column)));
  return {
    name,
    points: interleaved(positions.map((column) => columns.get(column))),
    normals: normals && interleaved(normals.map((column) => columns.get(column))),
    values: withColours(others, groups(COLOURS)),
    ...(nLeftOut > 0 ? { nLeftOut } : {}),
  };
}

/** Gives colours the names red, green and blue. */
function withColours(values, groups) {
  const group = groups.find((found) => found.length === 3 && found.every((name) => values.has(name)));
  if (!group) return values;
  return new Map([...values].map(([name, data]) => [COLOURS[0][group.indexOf(name)] ?? name, data]));
}

/**
 * Columns without the rows of organised scans where nothing was measured, which have NaN, and the number of
 * those.
 *
 * @param {Rows} rows
 * @param {string[]} positions
 * @param {keyof typeof GAPS} gaps
 */
function withoutGaps(rows, positions, gaps) {
  const { columns } = rows;
  if (gaps === "kept") return { columns, nLeftOut: 0 };
  if (gaps === "refused") {
    checkFinite(rows, positions);
    return { columns, nLeftOut: 0 };
  }
  const axes = positions.map((axis) => columns.get(axis) ?? new Float64Array());
  const nRows = axes[0].length;
  const kept = [];
  for (let row = 0; row < nRows; row++) {
    if (axes.every((column) => Number.isFinite(column[row]))) kept.push(row);
  }
  if (kept.length === nRows) return { columns, nLeftOut: 0 };
  if (kept.length === 0) throw new Error(`no point has a position, of ${nRows}`);
  const known = new Map();
  for (const [name, column] of columns)
    known.set(
      name,
      Float64Array.from(kept, (row) => column[row]),
    );
  // Places of what is left are those of the rows that are left.
  if (rows.lines) rows.lines = kept.map((row) => rows.lines?.[row] ?? 0);
  return { columns: known, nLeftOut: nRows - kept.length };
}

/**
 * Refuses numbers that are not finite, with the place of the first and the number of rows that have such.
 *
 * @param {Rows} rows
 * @param {string[]} names
 */
export function checkFinite({ columns, lines, record }, names) {
  const found = names.map((name) => columns.get(name) ?? new Float64Array());
  const nRows = found[0].length;
  let nBroken = 0;
  let first = "";
  for (let row = 0; row < nRows; row++) {
    const axis = found.findIndex((column) => !Number.isFinite(column[row]));
    if (axis < 0) continue;
    const place = lines ? `line ${lines[row]}` : `${record} ${row + 1} of ${nRows}`;
    if (nBroken === 0) first = `${place}: ${names[axis]} is ${Number.isNaN(found[axis][row]) ? "NaN" : "infinite"}`;
    nBroken++;
  }
  if (nBroken === 1) throw new Error(first);
  if (nBroken > 1) throw new Error(`${first}. ${nBroken} rows have such numbers`);
}

export function interleaved(columns) {
  const [n, d] = [columns[0].length, columns.length];
  const data = new Float64Array(n * d);
  columns.forEach((column, axis) => {
    for (let row = 0; row < n; row++) data[row * d + axis] = column[row];
  });
  return new Tensor(data, [n, d]);
}
