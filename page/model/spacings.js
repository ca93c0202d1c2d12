// @ts-check
// Spacings of points by place, for the sizes of their dots.

import { inTurns, turn } from "./turns.js";

/** Neighbours whose distance tells the spacing. */
const NEIGHBOURS = 6;

/** Points before and after a point on the curve that are looked at. */
const WINDOW = 8;

/** Bits of a coordinate on the curve, and shifts of the two curves in parts of the extent. */
const BITS = 10;
const SHIFTS = [0, 0.29];
const MASK = 2 ** BITS - 1;

/** Spacings are held within these factors of their median, so that a stray point is no large dot. */
const LEAST = 0.05;
const MOST = 6;

/**
 * The spacing at each point: that of evenly spread points whose sixth neighbour is as far. Neighbours are
 * sought along two Z-order curves (Morton 1966), so a spacing may be a little too long.
 *
 * @param {Float32Array} places `[n, 3]`, with zeros along the third axis in the plane
 * @param {number} d the dimension of the cloud
 */
export async function spacingsOf(places, d) {
  const n = places.length / 3;
  const squares = new Float32Array(n).fill(Infinity);
  const box = boundsOf(places);
  for (const shift of SHIFTS) await alongCurve(places, await curveOf(places, box, shift), squares);
  const k = Math.min(NEIGHBOURS, n - 1);
  // Evenly spread: k neighbours lie in the disc of a surface, and half of them on each side along a curve.
  const factor = d === 2 ? 2 / k : Math.sqrt(Math.PI / k);
  const spacings = squares.map((square) => factor * Math.sqrt(square));
  const median = medianOf(spacings);
  return spacings.map((h) => (Number.isFinite(h) ? Math.min(Math.max(h, LEAST * median), MOST * median) : median));
}

/** The median of a sample. 1 where there is none. */
export function medianOf(values) {
  const step = Math.max(1, Math.floor(values.length / 4096));
  const sample = values.filter((value, at) => at % step === 0 && Number.isFinite(value)).sort();
  return sample[sample.length >> 1] || 1;
}

/** Ends of almost all coordinates: a few far points must not make the curve coarse. */
function boundsOf(places) {
  const n = places.length / 3;
  const step = Math.max(1, Math.floor(n / 4096));
  return [0, 1, 2].map((axis) => {
    const sample = Float32Array.from({ length: Math.ceil(n / step) }, (_, at) => places[3 * at * step + axis]).sort();
    const at = (share) => sample[Math.round(share * (sample.length - 1))];
    const [low, high] = [at(0.002), at(0.998)];
    return [low - 0.1 * (high - low), high + 0.1 * (high - low)];
  });
}

/** Points in the order of a Z-order curve. */
async function curveOf(places, box, shift) {
  const n = places.length / 3;
  const longest = Math.max(...box.map(([low, high]) => high - low)) || 1;
  const keys = new Uint32Array(n);
  await inTurns(n, (from, to) => {
    for (let at = from; at < to; at++) {
      let key = 0;
      for (let axis = 0; axis < 3; axis++) {
        const share = ((places[3 * at + axis] - box[axis][0]) / longest + shift) / (1 + shift);
        key |= spread(Math.min(Math.max(Math.floor(share * MASK), 0), MASK)) << axis;
      }
      keys[at] = key;
    }
  });
  return sorted(keys);
}

/** The bits of a number of ten bits, with two zeros after each. */
function spread(x) {
  let bits = (x | (x << 16)) & 0x030000ff;
  bits = (bits | (bits << 8)) & 0x0300f00f;
  bits = (bits | (bits << 4)) & 0x030c30c3;
  return (bits | (bits << 2)) & 0x09249249;
}

/** Places of keys in ascending order: a radix sort, ten bits at a time. */
async function sorted(keys) {
  const n = keys.length;
  let order = Uint32Array.from({ length: n }, (_, at) => at);
  let other = new Uint32Array(n);
  for (let bit = 0; bit < 3 * BITS; bit += BITS) {
    await turn();
    const begins = new Uint32Array(2 ** BITS + 1);
    for (let at = 0; at < n; at++) begins[((keys[at] >>> bit) & MASK) + 1]++;
    for (let value = 0; value <= MASK; value++) begins[value + 1] += begins[value];
    await turn();
    for (let place = 0; place < n; place++) other[begins[(keys[order[place]] >>> bit) & MASK]++] = order[place];
    [order, other] = [other, order];
  }
  return order;
}

/** Lowers the squared distance of each point to its neighbour along a curve. */
async function alongCurve(places, order, squares) {
  const n = order.length;
  const k = Math.min(NEIGHBOURS, n - 1);
  const nearest = new Float64Array(k);
  // In the order of the curve, so that neighbours lie side by side in memory.
  const along = new Float32Array(3 * n);
  await inTurns(n, (from, to) => {
    for (let place = from; place < to; place++) {
      for (let axis = 0; axis < 3; axis++) along[3 * place + axis] = places[3 * order[place] + axis];
    }
  });
  await inTurns(n, (from, to) => {
    for (let place = from; place < to; place++) {
      const x = along[3 * place];
      const y = along[3 * place + 1];
      const z = along[3 * place + 2];
      nearest.fill(Infinity);
      const last = Math.min(n - 1, place + WINDOW);
      for (let next = Math.max(0, place - WINDOW); next <= last; next++) {
        if (next === place) continue;
        const a = along[3 * next] - x;
        const b = along[3 * next + 1] - y;
        const c = along[3 * next + 2] - z;
        const square = a * a + b * b + c * c;
        for (let slot = k - 1; slot >= 0 && square < nearest[slot]; slot--) {
          if (slot + 1 < k) nearest[slot + 1] = nearest[slot];
          nearest[slot] = square;
        }
      }
      const point = order[place];
      if (nearest[k - 1] < squares[point]) squares[point] = nearest[k - 1];
    }
  });
}
