// @ts-check
// LAS 1.0 to 1.4 of the ASPRS. Points have whole numbers, which the header scales and moves.

import { POSITIONS } from "../tables.js";
import { columnsOf, SCALARS } from "./records.js";

/** @import { Rows } from "./columns.js" */

/** Bytes of the shortest header, of LAS 1.0 to 1.2. */
const MIN_HEADER_BYTES = 227;

/** Bits of the point format that say that points are compressed. */
const COMPRESSED = 0xc0;

/** Bytes of a point without extra bytes, by format. */
const POINT_BYTES = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/** First format of LAS 1.4, whose bits are elsewhere. */
const FIRST_OF_1_4 = 6;

/** Where colours are in a point, by format. */
const COLOURS = { 2: 20, 3: 28, 5: 28, 7: 30, 8: 30, 10: 30 };

/**
 * @param {Uint8Array} bytes
 * @returns {Rows}
 */
export function las(bytes) {
  const header = headerOf(bytes);
  const { begins, count, width } = header;
  const points = bytes.subarray(Math.min(begins, bytes.byteLength));
  const { columns, record } = columnsOf({ bytes: points, count, width, record: "point" }, fieldsOf(header));
  return { columns: placed(columns, header), record };
}

function headerOf(bytes) {
  if (bytes.byteLength < MIN_HEADER_BYTES) throw new Error("the file ends within its header");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [major, minor, kind] = [bytes[24], bytes[25], bytes[104]];
  if (major !== 1 || minor > 4) throw new Error(`LAS ${major}.${minor} is not read, but 1.0 to 1.4 are`);
  const format = kind & ~COMPRESSED;
  const least = POINT_BYTES[format];
  if (least === undefined) throw new Error(`points of format ${format} are not read, but 0 to 10 are`);
  if (kind & COMPRESSED) {
    throw new Error("the page does not read LAZ: convert it with las2las -i scan.laz -o scan.las, or with PDAL");
  }
  const width = view.getUint16(105, true);
  if (width < least) throw new Error(`points of format ${format} have ${least} bytes, but the header says ${width}`);
  const triple = (offset) => [0, 8, 16].map((axis) => view.getFloat64(offset + axis, true));
  const [scales, offsets] = [triple(131), triple(155)];
  if (![...scales, ...offsets].every(Number.isFinite) || scales.includes(0))
    throw new Error("the header has scales or offsets that are no numbers");
  // The old number is 0 if there are more points than it can count.
  const counted = minor === 4 && bytes.byteLength >= 255 ? Number(view.getBigUint64(247, true)) : 0;
  return {
    begins: view.getUint32(96, true),
    format,
    width,
    count: counted > 0 ? counted : view.getUint32(107, true),
    scales,
    offsets,
  };
}

/** Numbers of a point, as LAS places them by format. */
function fieldsOf({ format }) {
  /** @type {[string, string, number][]} */
  const fields = [
    ["x", "I4", 0],
    ["y", "I4", 4],
    ["z", "I4", 8],
    ["intensity", "U2", 12],
    ["returns", "U1", 14],
  ];
  if (format >= FIRST_OF_1_4) {
    fields.push(["classification", "U1", 16], ["user_data", "U1", 17], ["scan_angle", "I2", 18]);
    fields.push(["point_source_id", "U2", 20], ["gps_time", "F8", 22]);
  } else {
    fields.push(["classification", "U1", 15], ["scan_angle_rank", "I1", 16], ["user_data", "U1", 17]);
    fields.push(["point_source_id", "U2", 18]);
  }
  if ([1, 3, 4, 5].includes(format)) fields.push(["gps_time", "F8", 20]);
  const at = COLOURS[format];
  if (at !== undefined) fields.push(["red", "U2", at], ["green", "U2", at + 2], ["blue", "U2", at + 4]);
  if ([8, 10].includes(format)) fields.push(["nir", "U2", 36]);
  return fields.map(([name, type, offset]) => ({ name, scalar: SCALARS[type], offset }));
}

/** Scales and moves coordinates, and takes bits apart. */
function placed(columns, { format, scales, offsets }) {
  const isNew = format >= FIRST_OF_1_4;
  const bits = isNew ? 4 : 3;
  const known = new Map();
  for (const [name, column] of columns) {
    const axis = POSITIONS.indexOf(name);
    if (axis >= 0)
      known.set(
        name,
        column.map((x) => x * scales[axis] + offsets[axis]),
      );
    else if (name === "returns") {
      const mask = 2 ** bits - 1;
      known.set(
        "return_number",
        column.map((x) => x & mask),
      );
      known.set(
        "number_of_returns",
        column.map((x) => (x >> bits) & mask),
      );
      // In old formats, the three bits above the class are flags.
    } else if (name === "classification" && !isNew)
      known.set(
        name,
        column.map((x) => x & 0x1f),
      );
    else known.set(name, column);
  }
  return known;
}
