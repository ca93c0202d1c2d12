// @ts-check
// Files that the page reads beside tables: what shifts columns or stands for no number is refused with its
// place.

import assert from "node:assert/strict";
import { test } from "node:test";

import { read } from "../../page/model/files.js";

const reading = (text, name = "scan") => read(new TextEncoder().encode(text), name);

function refused(text, expected) {
  assert.throws(() => reading(text), { message: expected }, text);
}

const ply = (n, rows, format = "ascii 1.0") =>
  [
    "ply",
    `format ${format}`,
    `element vertex ${n}`,
    "property float x",
    "property float y",
    "property float z",
    "property uchar red",
    "element face 1",
    "property list uchar int vertex_indices",
    "end_header",
    ...rows,
    "",
  ].join("\n");

const pcd = (n, rows) =>
  [
    "# .PCD v0.7",
    "VERSION 0.7",
    "FIELDS x y z",
    "SIZE 4 4 4",
    "TYPE F F F",
    "COUNT 1 1 1",
    `WIDTH ${n}`,
    "HEIGHT 1",
    `POINTS ${n}`,
    "DATA ascii",
    ...rows,
    "",
  ].join("\n");

test("rows of PLY text are lines", () => {
  const cloud = reading(ply(2, ["1 2 3 255", "", " 4 5 6.5 nan\r", "2 0 1"]));
  assert.deepEqual([...cloud.points.data], [1, 2, 3, 4, 5, 6.5]);
  assert.deepEqual([...(cloud.values.get("red") ?? [])], [255, NaN]);
});

test("rows of PLY text with too few or too many numbers are refused", () => {
  refused(ply(2, ["1 2 3", "4 5 6 7 8"]), "line 11 has 3 numbers, but the header announces 4");
  refused(ply(2, ["1 2 3 4 5", "6 7 8"]), "line 11 has 5 numbers, but the header announces 4");
  refused(ply(2, ["1 2 3 4"]), "the file ends before its 2 points do");
  refused(ply(2, ["1 2 3 4", "1 2,5 3 4"]), 'line 12: "2,5" is no number');
  refused(ply(1, ["0x1 2 3 4"]), 'line 11: "0x1" is no number');
});

test("headers of PLY that say nothing are refused", () => {
  refused(ply("many", ["1 2 3 4"]), "the header has no number of points");
  refused(ply(1, ["1 2 3 4"], "binary_middle_endian 1.0"), "the PLY file has the unknown format binary_middle_endian");
  refused(ply(1, ["1 2 3 4"]).replace("float x", "float u"), "the file has no columns x and y: u, y, z, red");
});

test("rows of PCD text are lines, and rows without a position are counted", () => {
  const cloud = reading(pcd(3, ["1 2 3", "4 5 nan", "7 8 9"]));
  assert.deepEqual([[...cloud.points.data], cloud.nLeftOut], [[1, 2, 3, 7, 8, 9], 1]);
  refused(pcd(2, ["1 2", "3 4 5 6"]), "line 11 has 2 numbers, but the header announces 3");
  refused(
    pcd(1, ["1 2 3"]).replace("TYPE F F F", "TYPE F F X").replace("ascii", "binary"),
    "the type of z in the PCD file is unknown",
  );
});

test("JSON has rows of one length, and numbers", () => {
  const cloud = reading('{"points": [[1, 2], [3, 4]], "normals": [[0, 1], [1, 0]], "values": [5, 6]}');
  assert.deepEqual(
    [...cloud.points.data, ...(cloud.normals?.data ?? []), ...(cloud.values.get("values") ?? [])],
    [1, 2, 3, 4, 0, 1, 1, 0, 5, 6],
  );
  refused('{"points": [[1, 2], [3, 4, 5]]}', "points[1] is not a row of 2 numbers");
  refused('{"points": [[1, 2], [3, null]]}', "points[1] is not a row of 2 numbers");
  refused('{"points": [[1, 2], ["3", 4]]}', "points[1] is not a row of 2 numbers");
  refused('{"points": [[1, 2], [3, 4]], "normals": [[0, 1]]}', "normals are to have a row for each of the 2 points");
  refused('{"points": [[1, 2], [3, 4]], "values": [5]}', "values is not a row of 2 numbers");
});
