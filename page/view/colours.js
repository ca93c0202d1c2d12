// @ts-check
// Colours of a value and its deviation, the same in the scene, the histogram and the colour bar.

/** @import { Quantity, Scale } from "../types.d.ts" */

/**
 * Colours of values along the bar, sRGB, by the name of the map. Diverging maps are for values on both sides
 * of their middle, which is yellow and not grey. Sequential ones are viridis and cividis (Nuñez et al. 2018).
 *
 * @type {Record<string, { diverging: string[], sequential: string[] }>}
 */
const MAPS = {
  first: {
    diverging: ["#27408b", "#3f7fc4", "#6fc0c9", "#e8e29a", "#efa55b", "#d5553b", "#8f1d2c"],
    sequential: ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"],
  },
  second: {
    diverging: ["#3b1466", "#6f5fa3", "#b2a4cf", "#f3e9b5", "#e9ae5e", "#b9681f", "#6b3208"],
    sequential: ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#fee838"],
  },
};

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

/**
 * The colour at the part t of a scale, 0 to 1, uncertain by s of 0 (not at all) to 1.
 *
 * @param {number} t
 * @param {number} s
 * @param {Scale} scale
 */
export function colourOf(t, s, { map, middle }) {
  const colour = between(MAPS[map][middle === undefined ? "sequential" : "diverging"], t);
  const share = Math.min(Math.floor(Math.min(Math.max(s, 0), 1) * STEPS), STEPS - 1) / (STEPS - 1);
  return colour.map((channel, at) => channel + 0.92 * share * (GREY[at] - channel));
}

export function cssOf(colour) {
  return `rgb(${colour.map((channel) => Math.round(255 * channel)).join(" ")})`;
}

/**
 * The number that a colour is proportional to.
 *
 * @param {number} value
 * @param {boolean} isLogarithmic
 */
export function levelOf(value, isLogarithmic) {
  if (!isLogarithmic) return value;
  // What has no logarithm is below every scale.
  return value > 0 ? Math.log10(value) : value <= 0 ? -1e9 : NaN;
}

/**
 * The part of a scale at which a value is: 0 and 1 at its ends, and ½ at its middle if it has one. The shader
 * of points has the same rule.
 *
 * @param {number} value
 * @param {Scale} scale
 */
export function shareOf(value, { low, middle, high, isLogarithmic }) {
  const [x, from, to] = [value, low, high].map((at) => levelOf(at, isLogarithmic));
  if (middle === undefined) return (x - from) / (to - from);
  const centre = levelOf(middle, isLogarithmic);
  return x < centre ? (0.5 * (x - from)) / (centre - from) : 0.5 + (0.5 * (x - centre)) / (to - centre);
}

/**
 * Texture of colours: values along it, deviations up.
 *
 * @param {Scale} scale
 */
export function textureOf(scale) {
  const data = new Uint8Array(4 * RESOLUTION * STEPS);
  for (let row = 0; row < STEPS; row++) {
    for (let column = 0; column < RESOLUTION; column++) {
      const colour = colourOf(column / (RESOLUTION - 1), (row + 0.5) / STEPS, scale);
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

/** Numbers that are sorted as they are. Of more, a sample stands for all. */
const ALL = 150_000;

/** @type {WeakMap<ArrayLike<number>, Float64Array>} */
const sorted = new WeakMap();

/**
 * The known numbers of an array, ascending; of a long one a sample of even steps with the least and greatest.
 * They are sorted once.
 *
 * @param {ArrayLike<number>} values
 */
export function sortedOf(values) {
  const known = sorted.get(values) ?? sampleOf(values).sort();
  sorted.set(values, known);
  return known;
}

/** @param {ArrayLike<number>} values */
function sampleOf(values) {
  if (values.length <= ALL) return Float64Array.from(values).filter(Number.isFinite);
  const step = Math.ceil(values.length / ALL);
  const sample = [];
  let [least, greatest] = [Infinity, -Infinity];
  for (let at = 0; at < values.length; at++) {
    const value = values[at];
    if (!Number.isFinite(value)) continue;
    if (value < least) least = value;
    if (value > greatest) greatest = value;
    if (at % step === 0) sample.push(value);
  }
  return Float64Array.from(least <= greatest ? [...sample, least, greatest] : sample);
}

/**
 * The middle of the colours of a quantity: the centre that is asked for, or 0 if values have both signs. A
 * quantity that can be signed and is not has none.
 *
 * @param {Quantity} quantity
 * @param {number} centre NaN: not asked for
 */
export function middleOf({ values, isSigned }, centre) {
  if (Number.isFinite(centre)) return centre;
  const known = sortedOf(values);
  const at = (share) => known[Math.round(share * (known.length - 1))];
  return isSigned && at(0.02) < 0 && at(0.98) > 0 ? 0 : undefined;
}

/**
 * Ends of the range of a quantity: percentiles 2 and 98 or everything, symmetric about the middle if there is
 * one. A logarithmic range begins above 0.
 *
 * @param {Quantity} quantity
 * @param {{ isWhole: boolean, middle: number | undefined, isLogarithmic: boolean }} options
 */
export function rangeOf({ values }, { isWhole, middle, isLogarithmic }) {
  const all = sortedOf(values);
  const known = isLogarithmic ? all.filter((value) => value > 0) : all;
  if (known.length === 0) return isLogarithmic ? [0.1, 1] : [0, 1];
  const at = (share) => known[Math.round(share * (known.length - 1))];
  let [low, high] = isWhole ? [known[0], known[known.length - 1]] : [at(0.02), at(0.98)];
  if (middle !== undefined) {
    const half = Math.max(middle - low, high - middle);
    [low, high] = [middle - half, middle + half];
  }
  // What differs by rounding alone is one value.
  if (high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high))) return [low, high];
  const margin = Math.abs(low) > 0 ? 1e-3 * Math.abs(low) : 1;
  return [low - margin, high + margin];
}
