// @ts-check
// Clouds from files of other programs. docs/formats.md has the formats, and what is read of each.

import { json, npy } from "./formats/arrays.js";
import { cloudOf as cloudOfRows, GAPS } from "./formats/columns.js";
import { formatOf } from "./formats/formats.js";
import { las } from "./formats/las.js";
import { obj, stl } from "./formats/meshes.js";
import { pcd } from "./formats/pcd.js";
import { ply } from "./formats/ply.js";
import { table } from "./tables.js";

/** @import { Cloud } from "../types.d.ts" */

/** Readers of rows by the name of their format. */
const READERS = { PLY: ply, PCD: pcd, "LAS, LAZ": las, npy, OBJ: obj, STL: stl };

/**
 * Reads a file. Rows without a position are kept, for the page to ask what to do with them. Those of PCD
 * stand for nothing measured, and are left out.
 *
 * @param {File} file
 */
export async function readFile(file) {
  return read(new Uint8Array(await file.arrayBuffer()), file.name, GAPS.kept);
}

/**
 * Reads a file by its content, or where that decides nothing, by the ending of its name.
 *
 * @param {Uint8Array} bytes
 * @param {string} name
 * @param {"refused" | "kept"} [gaps] what happens to rows without a position, in formats other than PCD
 * @returns {Cloud}
 */
export function read(bytes, name, gaps = GAPS.refused) {
  const format = formatOf(bytes, name);
  if (format === "JSON") return json(decoded(bytes), name);
  if (Object.hasOwn(READERS, format)) {
    return cloudOfRows(READERS[format](bytes), name, format === "PCD" ? GAPS.leftOut : gaps);
  }
  return cloudOf(table(decoded(bytes)), name);
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
  return cloudOfRows({ columns }, name);
}
