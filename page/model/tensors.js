// @ts-check
// Requests and answers in safetensors: arrays as raw float64, everything else as JSON in the metadata.

/** An array with its shape, row major. */
export class Tensor {
  /**
   * @param {Float64Array | Uint32Array} data
   * @param {number[]} shape
   */
  constructor(data, shape) {
    this.data = data;
    this.shape = shape;
  }

  get rows() {
    return this.shape[0];
  }

  /** Numbers in a row. */
  get width() {
    return this.shape.slice(1).reduce((product, length) => product * length, 1);
  }

  /** Rows as lists of numbers. */
  lists() {
    const { data, rows, width } = this;
    return Array.from({ length: rows }, (_, row) => Array.from(data.subarray(row * width, (row + 1) * width)));
  }
}

/**
 * The bytes of a file with float64 tensors by name, and a JSON document in the metadata entry `request`.
 *
 * @param {Record<string, Tensor>} tensors
 * @param {object} request
 */
export function encode(tensors, request) {
  /** @type {Record<string, object>} */
  const header = { __metadata__: { request: JSON.stringify(request) } };
  let end = 0;
  for (const [name, { data, shape }] of Object.entries(tensors)) {
    header[name] = { dtype: "F64", shape, data_offsets: [end, end + data.byteLength] };
    end += data.byteLength;
  }
  const text = new TextEncoder().encode(JSON.stringify(header));
  // The numbers begin at a multiple of eight bytes, filled by spaces.
  const length = Math.ceil(text.length / 8) * 8;
  const bytes = new Uint8Array(8 + length + end);
  bytes.fill(32, 8, 8 + length);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(length), true);
  bytes.set(text, 8);
  let start = 8 + length;
  for (const { data } of Object.values(tensors)) {
    bytes.set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), start);
    start += data.byteLength;
  }
  return bytes;
}

/**
 * The tensors of an answer by name, and its other members.
 *
 * @param {ArrayBuffer} buffer
 */
export function decode(buffer) {
  const length = Number(new DataView(buffer).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
  const { __metadata__: metadata, ...described } = header;
  /** @type {Record<string, Tensor>} */
  const tensors = {};
  for (const [name, { dtype, shape, data_offsets: place }] of Object.entries(described)) {
    const [start, end] = place;
    const from = 8 + length + start;
    // Numbers at multiples of eight bytes are read where they are.
    const [bytes, first] = from % 8 === 0 ? [buffer, from] : [buffer.slice(from, from + end - start), 0];
    // Whole numbers here are indices, far below 2³².
    const data =
      dtype === "I64"
        ? lowHalves(new Uint32Array(bytes, first, (end - start) / 4))
        : new Float64Array(bytes, first, (end - start) / 8);
    tensors[name] = new Tensor(data, shape);
  }
  return { tensors, fields: JSON.parse(metadata.response) };
}

/** Every other number, from the first. */
function lowHalves(halves) {
  const low = new Uint32Array(halves.length / 2);
  for (let at = 0; at < low.length; at++) low[at] = halves[2 * at];
  return low;
}
