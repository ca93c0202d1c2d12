// @ts-check
// Files of points as the page reads them, held to the files and outcomes of tests/tables and tests/clouds, as
// the readers of the subcommands and of the Python package are. And the lists of formats in the page and the
// documents.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

import { read } from "../../page/model/files.js";
import { FORMATS } from "../../page/model/formats/formats.js";

/** Name of the reader in outcomes that differ among readers. */
const READER = "page";

const rowsOf = (tensor) =>
  tensor &&
  Array.from({ length: tensor.rows }, (_, row) => {
    return [...tensor.data.subarray(row * tensor.width, (row + 1) * tensor.width)];
  });

/** Red, green and blue of each point from 0 to 1, by the rule of docs/formats.md. */
function coloursOf(values) {
  const channels = ["red", "green", "blue"].map((name) => values.get(name));
  if (!channels.every(Boolean)) return undefined;
  const greatest = Math.max(...channels.flatMap((channel) => [...channel]));
  const scale = [1, 255, 65535].find((most) => greatest <= most) ?? greatest;
  return Array.from(channels[0], (_, row) => channels.map((channel) => channel[row] / scale));
}

/**
 * A cloud in the form of expected.json, where null is a value that is missing or infinite.
 *
 * @param {import("../../page/types.d.ts").Cloud} cloud
 */
function outcomeOf({ points, normals, values, nLeftOut }) {
  const colours = coloursOf(values);
  const known = [...values]
    .filter(([name]) => !(colours && ["red", "green", "blue"].includes(name)))
    .map(([name, numbers]) => [name, Array.from(numbers, (x) => (Number.isFinite(x) ? x : null))]);
  const leftOut = `left out without a position: ${nLeftOut} of ${points.rows + (nLeftOut ?? 0)} points`;
  return {
    points: rowsOf(points),
    ...(normals ? { normals: rowsOf(normals) } : {}),
    ...(colours ? { colours } : {}),
    ...(known.length > 0 ? { values: Object.fromEntries(known) } : {}),
    ...(nLeftOut ? { left_out: leftOut } : {}),
  };
}

/** What reading a file gives: an outcome. A refusal is cut where the expected one ends with "…". */
function found(name, bytes, expected) {
  try {
    return outcomeOf(read(bytes, name));
  } catch (error) {
    const refused = error instanceof Error ? error.message : String(error);
    const beginning = expected.refused?.match(/^(.*)…$/)?.[1];
    return { refused: beginning !== undefined && refused.startsWith(beginning) ? expected.refused : refused };
  }
}

/** -0 is 0 in JSON of some writers. */
const plain = (outcome) => JSON.parse(JSON.stringify(outcome));

for (const kind of ["tables", "clouds"]) {
  const folder = new URL(`../${kind}/`, import.meta.url);
  const outcomes = JSON.parse(readFileSync(new URL("expected.json", folder), "utf8"));
  test(`every sample of ${kind} has an outcome`, () => {
    const samples = readdirSync(folder).filter((name) => !["expected.json", "make_samples"].includes(name));
    assert.deepEqual(samples.sort(), Object.keys(outcomes).sort());
  });
  for (const [name, outcome] of Object.entries(outcomes)) {
    test(`the page reads ${kind}/${name} as others do`, () => {
      const expected = outcome[READER] ?? outcome;
      const bytes = new Uint8Array(readFileSync(new URL(name, folder)));
      assert.deepEqual(plain(found(name, bytes, expected)), expected);
    });
  }
}

test("files that end anywhere, or have a wrong byte, are read or refused in words", () => {
  const folder = new URL("../clouds/", import.meta.url);
  for (const name of readdirSync(folder).filter((file) => !["expected.json", "make_samples"].includes(file))) {
    const whole = new Uint8Array(readFileSync(new URL(name, folder)));
    const damaged = [...whole.keys()].flatMap((at) => {
      const flipped = whole.slice();
      flipped[at] ^= 0x80;
      return [whole.subarray(0, at), flipped];
    });
    for (const bytes of damaged) {
      try {
        assert.ok(read(bytes, name).points.data.every(Number.isFinite), name);
      } catch (error) {
        // Faults of the reader itself are of other classes.
        assert.equal(error?.constructor, Error, `${name}: ${error}`);
      }
    }
  }
});

test("the formats of the page are those of docs/formats.md", () => {
  const text = readFileSync(new URL("../../docs/formats.md", import.meta.url), "utf8");
  const rows = [...text.matchAll(/^\| ([^|]+) \| (`\.[^|]+) \|/gm)];
  const documented = rows.map(([, name, endings]) => [name, endings.replaceAll(/[`.]/g, "").split(", ")]);
  assert.deepEqual(Object.fromEntries(documented), FORMATS);
  const page = readFileSync(new URL("../../page/index.html", import.meta.url), "utf8");
  const accepted = page.match(/accept="([^"]+)"/)?.[1].split(",");
  assert.deepEqual(
    accepted,
    Object.values(FORMATS)
      .flat()
      .map((ending) => `.${ending}`),
  );
});
