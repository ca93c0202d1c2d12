// @ts-check
// Files that are opened on the page. formats.test.mjs has what is read of each format.

import assert from "node:assert/strict";
import { test } from "node:test";

import { readFile } from "../../page/model/files.js";

const opened = (name, text) => readFile(new File([text], name));

const ply = ["ply", "format ascii 1.0", "element vertex 3"];
const properties = ["x", "y", "z", "nx", "ny", "nz"].map((name) => `property float ${name}`);
const rows = ["1 2 3 0 0 1", "4 nan 6 0 1 0", "7 8 9 nan 0 0"];

test("a file that is opened keeps rows without a position, for the page to ask", async () => {
  const cloud = await opened("scan.ply", [...ply, ...properties, "end_header", ...rows, ""].join("\n"));
  assert.deepEqual([...cloud.points.data], [1, 2, 3, 4, NaN, 6, 7, 8, 9]);
  assert.deepEqual([...(cloud.normals?.data ?? [])], [0, 0, 1, 0, 1, 0, NaN, 0, 0]);
  assert.equal(cloud.nLeftOut, undefined);
});

test("gaps of organised scans are left out of a file that is opened, and counted", async () => {
  const header = ["FIELDS x y z", "SIZE 4 4 4", "TYPE F F F", "WIDTH 2", "HEIGHT 1", "POINTS 2", "DATA ascii"];
  const cloud = await opened("scan.pcd", ["VERSION 0.7", ...header, "nan nan nan", "1 2 3", ""].join("\n"));
  assert.deepEqual([[...cloud.points.data], cloud.nLeftOut], [[1, 2, 3], 1]);
});
