// @ts-check
// OBJ and STL: the vertices of meshes.

import { NORMALS, POSITIONS } from "../tables.js";
import { endsEarly, latin, linesFrom, numberOfWord, TextColumns } from "./records.js";

/** @import { Rows } from "./columns.js" */

/** Columns of vertices by the numbers in their lines. A weight has no name. */
const VERTEX = {
  3: POSITIONS,
  4: [...POSITIONS, ""],
  6: [...POSITIONS, "red", "green", "blue"],
  7: [...POSITIONS, "", "red", "green", "blue"],
};

/**
 * Vertices, and normals if every vertex has one: as many in the same order, or named by the faces.
 *
 * @param {Uint8Array} bytes
 * @returns {Rows}
 */
export function obj(bytes) {
  const mesh = new Mesh();
  for (const { number, words } of linesFrom(bytes)) {
    const [keyword, ...rest] = words;
    if (keyword === "v") mesh.addVertex(rest, number);
    else if (keyword === "vn") mesh.addNormal(rest, number);
    else if (keyword === "f") mesh.addFace(rest);
  }
  return mesh.rows();
}

class Mesh {
  constructor() {
    /** @type {TextColumns | undefined} */
    this.vertices = undefined;
    /** @type {number[][]} */
    this.normals = [];
    /** @type {number[]} */
    this.normalOf = [];
    this.hasFaces = false;
    /** Whether faces give a vertex several normals, or none. */
    this.isTorn = false;
  }

  addVertex(words, line) {
    const names = VERTEX[words.length];
    if (!names) {
      const expected = "a vertex has 3 coordinates, and maybe a weight and 3 colours";
      throw new Error(`line ${line}: ${expected}, not ${words.length} numbers`);
    }
    this.vertices ??= new TextColumns(names);
    const { numbers, lines } = this.vertices;
    if (numbers.length !== words.length) {
      throw new Error(`line ${line}: ${words.length} numbers, where the vertices before have ${numbers.length}`);
    }
    words.forEach((word, at) => {
      numbers[at].push(numberOfWord(word, line));
    });
    lines.push(line);
  }

  addNormal(words, line) {
    if (words.length !== 3) throw new Error(`line ${line}: a normal has 3 numbers, not ${words.length}`);
    this.normals.push(words.map((word) => numberOfWord(word, line)));
  }

  addFace(corners) {
    this.hasFaces = true;
    for (const corner of corners) {
      const [vertex, , normal] = corner.split("/");
      const v = indexOf(vertex, this.vertices?.lines.length ?? 0);
      const n = indexOf(normal ?? "", this.normals.length);
      if (v === undefined || n === undefined) this.isTorn = true;
      else {
        this.normalOf[v] ??= n;
        const known = this.normals[this.normalOf[v]];
        this.isTorn ||= known.some((x, axis) => x !== this.normals[n][axis]);
      }
    }
  }

  rows() {
    const { columns, lines } = (this.vertices ?? new TextColumns(POSITIONS)).rows();
    columns.delete("");
    const n = lines?.length ?? 0;
    const of = this.hasFaces ? this.normalOf : [...this.normals.keys()];
    const hasAll = !this.isTorn && of.length === n && [...of].every((index) => index !== undefined);
    if (hasAll && n > 0) {
      NORMALS[0].forEach((name, axis) => {
        columns.set(
          name,
          Float64Array.from(of, (index) => this.normals[index][axis]),
        );
      });
    }
    return { columns, lines };
  }
}

/** The index that a word names: from 1 on, or back from the last of `n`. Nothing if there is no such one. */
function indexOf(word, n) {
  if (!/^-?\d+$/.test(word)) return undefined;
  const index = Number(word) < 0 ? n + Number(word) : Number(word) - 1;
  return index >= 0 && index < n ? index : undefined;
}

/** Bytes before the number of facets, and of a facet. */
const [N_TITLE_BYTES, N_FACET_BYTES] = [80, 50];

/**
 * Corners of triangles, each once. Normals of facets are none of corners, and are skipped.
 *
 * @param {Uint8Array} bytes
 * @returns {Rows}
 */
export function stl(bytes) {
  // Some binary files begin with "solid" as well, but name no facet in their title.
  const head = latin(bytes.subarray(0, 1024));
  return /^\s*solid/.test(head) && /facet|endsolid/.test(head) ? textFacets(bytes) : binaryFacets(bytes);
}

function textFacets(bytes) {
  const corners = new Corners();
  let hasEnd = false;
  for (const { number, words } of linesFrom(bytes)) {
    hasEnd ||= words[0] === "endsolid";
    if (words[0] !== "vertex") continue;
    const corner = words.slice(1).map((word) => numberOfWord(word, number));
    if (corner.length !== 3) throw new Error(`line ${number}: a vertex has 3 numbers, not ${corner.length}`);
    if (corners.add(corner)) corners.columns.lines.push(number);
  }
  if (!hasEnd) throw new Error("the file ends before its line endsolid");
  return corners.columns.rows();
}

function binaryFacets(bytes) {
  const body = N_TITLE_BYTES + 4;
  if (bytes.byteLength < body) throw new Error("the file ends before its number of facets");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const count = view.getUint32(N_TITLE_BYTES, true);
  const nThere = Math.floor((bytes.byteLength - body) / N_FACET_BYTES);
  if (nThere < count) throw endsEarly("facet", nThere, count);
  const corners = new Corners();
  for (let facet = 0; facet < count; facet++) {
    for (let corner = 1; corner <= 3; corner++) {
      const at = body + facet * N_FACET_BYTES + corner * 12;
      const place = [0, 4, 8].map((axis) => view.getFloat32(at + axis, true));
      if (!place.every(Number.isFinite)) throw new Error(`facet ${facet + 1} of ${count}: a coordinate is not finite`);
      corners.add(place);
    }
  }
  return { ...corners.columns.rows(), lines: undefined, record: "corner" };
}

/** Distinct corners in the order of the file. */
class Corners {
  constructor() {
    this.columns = new TextColumns(POSITIONS);
    this.known = new Set();
  }

  /** Adds a corner. Returns whether it is a new one. Texts of 0 and -0 are equal. */
  add(corner) {
    const key = corner.join();
    if (this.known.has(key)) return false;
    this.known.add(key);
    corner.forEach((x, axis) => {
      this.columns.numbers[axis].push(x);
    });
    return true;
  }
}
