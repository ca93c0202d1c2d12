// @ts-check
// The formats of clouds: names, endings, and how a file shows which it has. Those of docs/formats.md.

/** Endings of files by the name of their format. */
export const FORMATS = {
  PLY: ["ply"],
  "XYZ, CSV, TSV": ["xyz", "csv", "tsv", "txt", "asc", "pts"],
  PCD: ["pcd"],
  "LAS, LAZ": ["las", "laz"],
  npy: ["npy"],
  OBJ: ["obj"],
  STL: ["stl"],
  JSON: ["json"],
};

/** Beginnings of files that decide which format they have. */
const BEGINNINGS = [
  ["ply\n", "PLY"],
  ["ply\r\n", "PLY"],
  ["\x93NUMPY", "npy"],
  ["LASF", "LAS, LAZ"],
  ["# .PCD", "PCD"],
];

/** Bytes that decide which format a text has, comments of its head included. */
const MAX_HEAD_BYTES = 4096;

/**
 * The name of the format of a file. Its ending decides where its content could be of several formats.
 *
 * @param {Uint8Array} bytes
 * @param {string} name
 */
export function formatOf(bytes, name) {
  // Not TextDecoder, whose latin1 is windows-1252.
  const head = String.fromCharCode(...bytes.subarray(0, MAX_HEAD_BYTES));
  const begun = BEGINNINGS.find(([beginning]) => head.startsWith(beginning));
  if (begun) return begun[1];
  const ending = name.includes(".") ? name.replace(/^.*\./s, "").toLowerCase() : "";
  const promised = Object.keys(FORMATS).find((format) => FORMATS[format].includes(ending));
  const word = firstWord(head);
  if (word === "VERSION") return "PCD";
  if (promised === "STL" || promised === "OBJ" || promised === "JSON") return promised;
  if (promised === "PLY") throw new Error('the file is not PLY: its first line is not "ply"');
  if (promised && promised !== "XYZ, CSV, TSV")
    throw new Error(`the file is not ${promised}: its first bytes are not those of this format`);
  if (["v", "vn", "vt", "o", "g", "mtllib"].includes(word)) return "OBJ";
  if (word === "solid" && head.includes("facet")) return "STL";
  if (/^[{[]/.test(word)) return "JSON";
  if (bytes.includes(0)) {
    throw new Error(`the content is of no format that is read: ${Object.keys(FORMATS).join(", ")}`);
  }
  return "XYZ, CSV, TSV";
}

/** The first word of a text that is no comment. */
function firstWord(head) {
  const lines = head.replace(/^\xef\xbb\xbf/, "").split("\n");
  const line = lines.find((text) => !/^\s*(#|$)/.test(text));
  return line?.trim().split(/\s+/)[0] ?? "";
}
