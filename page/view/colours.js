// @ts-check
// Colours of a value and its deviation, the same in the scene, the histogram and the colour bar.

/** @import { Quantity } from "../types.d.ts" */

/** Colours of values along the bar, sRGB. Diverging for signed quantities: its middle is yellow, not grey. */
const DIVERGING = ["#27408b", "#3f7fc4", "#6fc0c9", "#e8e29a", "#efa55b", "#d5553b", "#8f1d2c"];
const SEQUENTIAL = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];

/** Colour of what is too uncertain to have one. */
const GREY = [0.62, 0.62, 0.62];

/** Steps by which the chroma of a colour falls as its deviation grows (Correll, Moritz and Heer 2018). */
const STEPS = 4;

export const RESOLUTION = 256;

/** Colours of the support of the vertices of a mesh. */
export const SUPPORT = {
  observed: "#3f7fc4",
  bridged: "#efa55b",
  extrapolated: "#b0455f",
};

export function rgb(hex) {
  return [1, 3, 5].map((at) => Number.parseInt(hex.slice(at, at + 2), 16) / 255);
}

function between(stops, t) {
  const place = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const at = Math.min(Math.floor(place), stops.length - 2);
  const [from, to] = [rgb(stops[at]), rgb(stops[at + 1])];
  return from.map((channel, index) => channel + (place - at) * (to[index] - channel));
}

/** The colour of a value t of 0 to 1, uncertain by s of 0 (not at all) to 1. */
export function colourOf(t, s, isSigned) {
  const colour = between(isSigned ? DIVERGING : SEQUENTIAL, t);
  const share = Math.min(Math.floor(Math.min(Math.max(s, 0), 1) * STEPS), STEPS - 1) / (STEPS - 1);
  return colour.map((channel, at) => channel + 0.92 * share * (GREY[at] - channel));
}

export function cssOf(colour) {
  return `rgb(${colour.map((channel) => Math.round(255 * channel)).join(" ")})`;
}

/** Texture of colours: values along it, deviations up. */
export function textureOf(isSigned) {
  const data = new Uint8Array(4 * RESOLUTION * STEPS);
  for (let row = 0; row < STEPS; row++) {
    for (let column = 0; column < RESOLUTION; column++) {
      const colour = colourOf(column / (RESOLUTION - 1), (row + 0.5) / STEPS, isSigned);
      data.set([...colour.map((channel) => Math.round(255 * channel)), 255], 4 * (row * RESOLUTION + column));
    }
  }
  return { data, width: RESOLUTION, height: STEPS };
}

/** Places for ticks: about `wanted` round numbers between two. */
export function ticks(low, high, wanted = 5) {
  const span = high - low;
  if (!(span > 0) || !Number.isFinite(span)) return [low];
  const power = 10 ** Math.floor(Math.log10(span / wanted));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => span / size <= wanted) ?? 10 * power;
  const first = Math.ceil(low / step);
  const n = Math.min(Math.floor(high / step + 1e-9) - first + 1, 2 * wanted + 2);
  return Array.from({ length: Math.max(n, 0) }, (_, at) => (first + at) * step);
}

/** A number with four digits, as people write it. */
export function shown(x) {
  if (!Number.isFinite(x)) return "no answer";
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return x.toExponential(2).replace("-", "−").replace("e+", "e");
  return String(Number(x.toPrecision(4))).replace("-", "−");
}

/** @type {WeakMap<ArrayLike<number>, Float64Array>} */
const sorted = new WeakMap();

/**
 * The known numbers of an array, ascending. They are sorted once.
 *
 * @param {ArrayLike<number>} values
 */
export function sortedOf(values) {
  const known = sorted.get(values) ?? Float64Array.from(values).filter(Number.isFinite).sort();
  sorted.set(values, known);
  return known;
}

/**
 * Ends of the range of a quantity: percentiles 2 and 98 or everything, symmetric about 0 if it is signed.
 *
 * @param {Quantity} quantity
 * @param {boolean} isWhole
 */
export function rangeOf({ values, isSigned }, isWhole) {
  const known = sortedOf(values);
  if (known.length === 0) return [0, 1];
  const at = (share) => known[Math.round(share * (known.length - 1))];
  let [low, high] = isWhole ? [known[0], known[known.length - 1]] : [at(0.02), at(0.98)];
  if (isSigned) [low, high] = [-Math.max(-low, high), Math.max(-low, high)];
  if (low < high) return [low, high];
  const margin = Math.abs(low) > 0 ? 1e-3 * Math.abs(low) : 1;
  return [low - margin, high + margin];
}
