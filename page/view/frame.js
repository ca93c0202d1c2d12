// @ts-check
// The box about a cloud, and the box that is left of it when a part is cut away.

/** @import { Box, Settings } from "../types.d.ts" */
/** @import { Arrangement } from "./body.js" */

const AXES = ["x", "y", "z"];

/**
 * The box whose inside is shown: on one side of a plane, or between planes. None if nothing is cut away.
 *
 * @param {Pick<Arrangement, "low" | "high">} arrangement
 * @param {Settings} settings
 * @returns {Box | undefined}
 */
export function boxOf({ low, high }, settings) {
  if (settings.cut === "none") return undefined;
  const at = (axis, share) => low[axis] + share * (high[axis] - low[axis]);
  if (settings.cut === "box") {
    const ends = (end, beyond) =>
      AXES.map((name, axis) => {
        const share = settings[`${name}${end}`];
        // A face on the hull cuts nothing away, whatever is rounded.
        return share === end ? beyond : at(axis, share);
      });
    return { low: ends(0, -1e30), high: ends(1, 1e30) };
  }
  const axis = AXES.indexOf(settings.cut);
  const box = { low: [-1e30, -1e30, -1e30], high: [1e30, 1e30, 1e30] };
  (settings.cutFlip ? box.low : box.high)[axis] = at(axis, settings.cutAt);
  return box;
}

/** The twelve edges of a box about its middle, as pairs of places. */
export function edgesOf(low, high, middle) {
  const corner = (bits) => [0, 1, 2].map((axis) => ((bits >> axis) & 1 ? high[axis] : low[axis]) - middle[axis]);
  const edges = [];
  for (let bits = 0; bits < 8; bits++) {
    for (let axis = 0; axis < 3; axis++) {
      if ((bits >> axis) & 1) continue;
      edges.push(...corner(bits), ...corner(bits | (1 << axis)));
    }
  }
  return Float32Array.from(edges);
}
