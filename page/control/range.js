// @ts-check
// The quantity that is chosen, and the range of its colours.

import { middleOf, rangeOf, sortedOf } from "../view/colours.js";
import { page } from "./page.js";

/** @import { ColourRange, Quantity } from "../types.d.ts" */

/** @returns {Quantity | undefined} */
export function chosen() {
  return page.quantities.find(({ id }) => id === page.settings.quantity) ?? page.quantities[0];
}

/**
 * Whether a quantity can have logarithmic colours: almost all of it is positive.
 *
 * @param {Quantity | undefined} quantity
 */
export function isPositive(quantity) {
  const known = quantity && !quantity.channels ? sortedOf(quantity.values) : [];
  return known.length > 0 && known[Math.round(0.02 * (known.length - 1))] > 0;
}

/**
 * The range of colours, and which points are hidden, from the settings.
 *
 * @param {Quantity | undefined} quantity
 * @returns {ColourRange}
 */
export function rangeNow(quantity) {
  const { settings } = page;
  const isLogarithmic = settings.logarithmic && isPositive(quantity);
  const given = quantity ? middleOf(quantity, settings.centre) : undefined;
  // A logarithmic scale has no 0.
  const middle = isLogarithmic && !(given !== undefined && given > 0) ? undefined : given;
  const own = settings.range === "own" && settings.low < settings.high && !(isLogarithmic && settings.low <= 0);
  const [low, high] = own
    ? [settings.low, settings.high]
    : quantity
      ? rangeOf(quantity, { isWhole: settings.range === "full", middle, isLogarithmic })
      : [0, 1];
  const known = quantity?.deviations ? sortedOf(quantity.deviations) : [];
  // Colours are grey where a deviation is half the range of colours.
  const full = settings.suppress && known.length > 0 ? 0.5 * (high - low) : 0;
  const hide = known.length > 0 && settings.hide < 1 ? known[Math.floor(settings.hide * (known.length - 1))] : Infinity;
  return { low, middle, high, isLogarithmic, map: settings.map, full, hide, hasLines: settings.isolines };
}
