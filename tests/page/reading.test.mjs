// @ts-check
// Points that no surface can be computed from, and large files, which are read beside the page.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { lenientTable, table } from "../../page/model/tables.js";
import { Tensor } from "../../page/model/tensors.js";
import { gapsOf, repeatsOf, undirectedOf, without } from "../../page/reading/cleaning.js";
import { opened, settled, sphere } from "./browser.mjs";

/** Milliseconds that a task of the page may take where other programs run too. Alone, it takes below 100. */
const MAX_TASK = 500;

const tensor = (rows) => new Tensor(Float64Array.from(rows.flat()), [rows.length, rows[0].length]);

test("rows without a position, without a direction, and repeated ones are found", () => {
  const points = tensor([
    [0, 1],
    [NaN, 1],
    [-0, 1],
    [2, Infinity],
    [3, 4],
    [0, 1],
    [3, 4],
  ]);
  assert.deepEqual([...gapsOf(points)], [1, 3]);
  assert.deepEqual([...repeatsOf(points)], [2, 5, 6]);
  assert.deepEqual(
    [
      ...undirectedOf(
        tensor([
          [0, 1],
          [0, 0],
          [NaN, 1],
          [-1e-200, 0],
        ]),
      ),
    ],
    [1, 2],
  );
});

test("repeated points are found among many", () => {
  const rows = Array.from({ length: 5000 }, (_, at) => [at % 4000, Math.floor((at % 4000) / 7), 0.1]);
  assert.deepEqual(
    [...repeatsOf(tensor(rows))],
    Array.from({ length: 1000 }, (_, at) => 4000 + at),
  );
});

test("a cloud without rows keeps the columns of the others", () => {
  const points = tensor([
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
  ]);
  const cloud = { name: "scan", points, normals: points, values: new Map([["height", Float64Array.of(9, 8, 7, 6)]]) };
  const left = without(cloud, Uint32Array.of(0, 2));
  assert.deepEqual(
    [[...left.points.data], left.points.shape],
    [
      [2, 3, 6, 7],
      [2, 2],
    ],
  );
  assert.deepEqual([left.normals?.rows, [...(left.values.get("height") ?? [])], left.nLeftOut], [2, [8, 6], 2]);
});

test("text in a table is a missing number, and a column of text is left out", () => {
  const text = "x,y,z,kind,height\n1.5,2,3,oak,7\n4,,6,elm,n/a\n7,8,9,ash,2\n";
  assert.throws(() => table(text), { message: 'line 2: "oak" is no number' });
  const { columns, textColumns } = lenientTable(text);
  assert.deepEqual(textColumns, ["kind"]);
  assert.deepEqual([...columns.keys()], ["x", "y", "z", "height"]);
  assert.deepEqual([...(columns.get("y") ?? []), ...(columns.get("height") ?? [])], [2, NaN, 8, 7, NaN, 2]);
  assert.throws(() => lenientTable("1 2 3\n4 5\n"), { message: /line 2 has 2 cells/ });
});

test("300,000 points are read and shown while the page answers", () =>
  opened(
    "#example=ball",
    async (page) => {
      await settled(page);
      await page.evaluate(() => {
        const tasks = [];
        Object.assign(window, { tasks });
        const note = (list) => tasks.push(...list.getEntries().map(({ duration }) => duration));
        // What the browser does before the page has the file is not the page's.
        document.querySelector("#file")?.addEventListener("change", () => {
          new PerformanceObserver(note).observe({ type: "longtask" });
        });
      });
      // By its path: the driver would decode its content in the page.
      const folder = mkdtempSync(join(tmpdir(), "gramian-page-"));
      const path = join(folder, "large.xyz");
      writeFileSync(path, sphere(300_000));
      await page.setInputFiles("#file", path);
      await page.waitForFunction(() => document.querySelector("#summary")?.textContent.startsWith("large.xyz"));
      await page.click("#cancel");
      await settled(page);
      rmSync(folder, { recursive: true });
      const tasks = await page.evaluate(() => /** @type {any} */ (window).tasks);
      const longest = Math.max(0, ...tasks);
      console.log(`longest task with 300,000 points: ${Math.round(longest)} ms`);
      assert.ok(longest < MAX_TASK, `tasks of ${tasks} ms`);
    },
    { expected: ["404", "409"] },
  ));
