// @ts-check
// What can be asked about a cloud, and the quantities of the answers.

/** @import { Tensor } from "./tensors.js" */
/** @import { Answer, Cloud, Quantity, Settings } from "../types.d.ts" */

/** @type {Record<string, { title: string, path: string, method: string }>} */
export const OPERATIONS = {
  curvatures: { title: "Curvatures", path: "v1/curvatures", method: "curvatures" },
  normals: { title: "Normals", path: "v1/normals", method: "normals" },
  mesh: { title: "Mesh", path: "v1/level-set", method: "level_set" },
};

/**
 * The members of a request, without its cloud. Absent ones are the service's to choose.
 *
 * @param {Settings} settings
 * @returns {Record<string, any>}
 */
export function requestOf(settings) {
  /** @type {Record<string, any>} */
  const request = {};
  const include = [];
  if (settings.std) include.push("std");
  if (settings.operation === "mesh") {
    include.unshift("curvatures");
    if (settings.quality !== "regular") request.quality = settings.quality;
    if (settings.open) request.open = true;
    if (settings.step > 0) request.step = settings.step;
  }
  if (include.length > 0) request.include = include;
  if (settings.surfaceModel !== "auto") request.surface_model = settings.surfaceModel;
  if (settings.solver !== "auto") request.solver = settings.solver;
  if (settings.duplicates !== "refuse") request.duplicates = settings.duplicates;
  if (settings.alpha > 0) request.alpha = settings.alpha;
  if (settings.family !== "auto") {
    request.kernel = { family: settings.family };
    if (settings.lengthScale > 0) request.kernel.length_scale = settings.lengthScale;
    if (settings.family === "laplace" && settings.epsilon > 0) request.kernel.epsilon = settings.epsilon;
  }
  return request;
}

/** @type {Record<string, string>} */
const NAMES = {
  mean_curvatures: "mean curvature",
  gaussian_curvatures: "Gaussian curvature",
  principal_curvatures: "principal curvature",
  gradient_norms: "gradient of u",
  levels: "level of u",
  residuals: "distance from the level",
  position_std: "standard deviation of the position",
  normal_std: "standard deviation of the normal",
  principal_curvature_std: "standard deviation of a principal curvature",
  mean_curvature_std: "standard deviation of the mean curvature",
  gaussian_curvature_std: "standard deviation of the Gaussian curvature",
};

/** Vectors, which are drawn and not coloured by, and what is no quantity of a point. */
const OTHERS = ["vertices", "normals", "cells", "principal_directions"];

const SUBSCRIPTS = ["₁", "₂", "₃"];

/**
 * Quantities that points can be coloured by, from an answer and the values of the cloud.
 *
 * @param {Answer} answer
 * @param {Cloud} cloud
 * @param {string} unit of length. "": L
 */
export function quantitiesOf(answer, cloud, unit) {
  /** @type {Quantity[]} */
  const quantities = [];
  const isMesh = "vertices" in answer.tensors;
  const n = isMesh ? answer.tensors.vertices.rows : cloud.points.rows;
  for (const [name, tensor] of Object.entries(answer.tensors)) {
    if (OTHERS.includes(name) || tensor.rows !== n) continue;
    for (let at = 0; at < tensor.width; at++) {
      const index = tensor.width > 1 ? SUBSCRIPTS[at] : "";
      quantities.push({
        id: tensor.width > 1 ? `${name}.${at}` : name,
        title: (NAMES[name] ?? name.replaceAll("_", " ")) + index,
        unit: unitOf(name, cloud.points.width).replace("L", unit || "L"),
        isSigned: /curvatures$/.test(name),
        // Columns of a million points are made when they are first looked at.
        get values() {
          return columnOf(tensor, at);
        },
        get deviations() {
          return columnOf(answer.tensors[`${name.replace(/s$/, "")}_std`], at);
        },
      });
    }
  }
  if (!isMesh) {
    for (const [name, values] of cloud.values) {
      quantities.push({ id: `given.${name}`, title: `${name} (given)`, unit: "", isSigned: false, values });
    }
  }
  const channels = isMesh ? undefined : channelsOf(cloud.values);
  if (channels) {
    const title = "colours of the file";
    quantities.push({ id: "colours", title, unit: "", isSigned: false, values: channels[0], channels });
  }
  // Mean curvature first, standard deviations last.
  const rank = ({ id }) => (id === "mean_curvatures" ? 0 : id.endsWith("_std") || id.includes("_std.") ? 2 : 1);
  return quantities.sort((a, b) => rank(a) - rank(b));
}

/**
 * Colours of points of their own, from 0 to 255. Programs write them in 8 bits, in 16 or from 0 to 1.
 *
 * @param {Map<string, Float64Array>} values
 */
function channelsOf(values) {
  const channels = ["red", "green", "blue"].map((name) => values.get(name));
  if (!channels.every((channel) => channel !== undefined)) return undefined;
  const greatest = channels.reduce((most, channel) => channel.reduce((max, x) => Math.max(max, x), most), 0);
  const factor = greatest <= 1 ? 255 : greatest <= 255 ? 1 : 255 / 65535;
  return factor === 1 ? channels : channels.map((channel) => channel.map((x) => factor * x));
}

/** @type {WeakMap<Tensor, Map<number, ArrayLike<number>>>} */
const columns = new WeakMap();

/** A column of a tensor, the same array each time. */
function columnOf(tensor, at) {
  if (!tensor) return undefined;
  if (tensor.width === 1) return tensor.data;
  const made = columns.get(tensor) ?? new Map();
  columns.set(tensor, made);
  if (!made.has(at)) {
    const column = new Float64Array(tensor.rows);
    for (let row = 0; row < tensor.rows; row++) column[row] = tensor.data[row * tensor.width + at];
    made.set(at, column);
  }
  return made.get(at);
}

function unitOf(name, d) {
  if (name.startsWith("gaussian")) return d === 2 ? "1/L" : "1/L²";
  if (name.includes("curvature")) return "1/L";
  if (name === "normal_std") return "rad";
  if (/^(residuals|position_std)$/.test(name)) return "L";
  return "";
}
