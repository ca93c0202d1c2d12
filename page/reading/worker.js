// @ts-check
// Reads files and makes large examples beside the page, which stays free to answer its reader.

import { EXAMPLES } from "../model/examples.js";
import { cloudOf, decoded, readFile } from "../model/files.js";
import { lenientTable } from "../model/tables.js";
import { gapsOf, repeatsOf, undirectedOf } from "./cleaning.js";

/** @import { Cloud, ReadCloud } from "../types.d.ts" */

/** Refusals of tables that may be read in part: some cells are no numbers. */
const HAS_TEXT = /^line \d+: .*(is no number|is empty)/;

self.addEventListener("message", async ({ data: { number, example, file } }) => {
  try {
    const found = example ? await EXAMPLES[example].make() : await readInPart(file);
    const cloud = { ...found, ...checked(found) };
    self.postMessage({ number, cloud }, { transfer: [...new Set(buffersOf(cloud))] });
  } catch (error) {
    self.postMessage({ number, refused: error instanceof Error ? error.message : String(error) });
  }
});

/**
 * Reads a file. A table with text is read without it, and the names of the columns that have nothing else are
 * kept.
 *
 * @param {File} file
 * @returns {Promise<ReadCloud>}
 */
async function readInPart(file) {
  try {
    return await readFile(file);
  } catch (error) {
    if (!(error instanceof Error) || !HAS_TEXT.test(error.message)) throw error;
    const found = leniently(new Uint8Array(await file.arrayBuffer()), file.name);
    if (!found) throw error;
    return { ...found, strictly: error.message };
  }
}

/** A table without its text, or nothing if that is no cloud either. */
function leniently(bytes, name) {
  try {
    const { columns, textColumns } = lenientTable(decoded(bytes));
    return { ...cloudOf(columns, name), textColumns };
  } catch {
    return undefined;
  }
}

/** @param {Cloud} cloud */
function checked({ points, normals }) {
  const gaps = gapsOf(points);
  return {
    gaps,
    undirected: normals ? undirectedOf(normals) : new Uint32Array(),
    // Missing numbers are equal to nothing.
    repeats: gaps.length > 0 ? new Uint32Array() : repeatsOf(points),
  };
}

/** @param {Record<string, any>} cloud */
function buffersOf({ points, normals, values, gaps, undirected, repeats }) {
  const arrays = [points.data, normals?.data, ...values.values(), gaps, undirected, repeats];
  return arrays.filter(Boolean).map(({ buffer }) => buffer);
}
