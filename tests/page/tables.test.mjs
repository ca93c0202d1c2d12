// @ts-check
// Tables as the page reads them, held to the files and outcomes of tests/tables, as the reader of the
// subcommands is.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

import { read } from "../../page/model/files.js";

const folder = new URL("../tables/", import.meta.url);
const outcomes = JSON.parse(readFileSync(new URL("expected.json", folder), "utf8"));

const rowsOf = (tensor) =>
  tensor &&
  Array.from({ length: tensor.rows }, (_, row) => {
    return [...tensor.data.subarray(row * tensor.width, (row + 1) * tensor.width)];
  });

/**
 * A cloud in the form of expected.json, where null is a value that is missing.
 *
 * @param {import("../../page/types.d.ts").Cloud} cloud
 */
function outcomeOf({ points, normals, values }) {
  const known = [...values].map(([name, numbers]) => [name, Array.from(numbers, (x) => (Number.isNaN(x) ? null : x))]);
  return {
    points: rowsOf(points),
    ...(normals ? { normals: rowsOf(normals) } : {}),
    ...(known.length > 0 ? { values: Object.fromEntries(known) } : {}),
  };
}

test("every sample has an outcome", () => {
  const samples = readdirSync(folder).filter((name) => name !== "expected.json");
  assert.deepEqual(samples.sort(), Object.keys(outcomes).sort());
});

for (const [name, expected] of Object.entries(outcomes)) {
  test(`the page reads ${name} as the subcommands do`, () => {
    let found;
    try {
      found = outcomeOf(read(new Uint8Array(readFileSync(new URL(name, folder))), name));
    } catch (error) {
      found = { refused: error instanceof Error ? error.message : error };
    }
    assert.deepEqual(found, expected);
  });
}
