// @ts-check
// Settings of the page, kept in the link, and what else the page remembers.

/** @import { PageState, Settings } from "../types.d.ts" */

export const DEFAULTS = {
  example: "dragon",
  fileName: "",
  operation: "curvatures",
  quantity: "",
  std: true,
  surfaceModel: "auto",
  solver: "auto",
  family: "auto",
  lengthScale: 0,
  epsilon: 0,
  alpha: 0,
  duplicates: "refuse",
  quality: "regular",
  open: false,
  step: 0,
  range: "percentile",
  low: NaN,
  high: NaN,
  hide: 1,
  suppress: true,
  map: "first",
  logarithmic: false,
  centre: NaN,
  unit: "",
  dots: 1,
  away: true,
  depth: true,
  cut: "none",
  cutAt: 0.5,
  cutFlip: false,
  x0: 0,
  x1: 1,
  y0: 0,
  y1: 1,
  z0: 0,
  z1: 1,
  up: "auto",
  frame: false,
  colour: "quantity",
  isolines: false,
  arrows: false,
  directions: false,
  section: "none",
  sectionAt: 0.5,
  orthographic: false,
};

/** Characters of the name of a file that a link may have. */
const MAX_NAME = 100;

/** Words of settings that are no choice of the form. */
const WORDS = { colour: ["quantity", "support"] };

/**
 * The page before anything is asked.
 *
 * @param {Settings} settings
 * @returns {PageState}
 */
export function begun(settings) {
  return {
    settings,
    quantities: [],
    reasons: new Map(),
    reasonOf: new Map(),
    hidden: new Set(),
    language: "curl",
  };
}

/**
 * The words that each setting may have: the choices of the form. The quantities to colour by follow from an
 * answer, and are looked up there.
 *
 * @param {HTMLFormElement} form
 * @returns {Record<string, string[]>}
 */
export function wordsOf(form) {
  const choices = [...form.querySelectorAll("select")].filter(({ name }) => name !== "quantity");
  return {
    ...WORDS,
    ...Object.fromEntries(choices.map(({ name, options }) => [name, Array.from(options, ({ value }) => value)])),
  };
}

/**
 * Settings from the fragment of a link. Unknown names, unknown words and senseless numbers are passed over.
 *
 * @param {string} hash
 * @param {Record<string, string[]>} words
 * @returns {Settings}
 */
export function fromHash(hash, words) {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  /** @type {Record<string, any> & Settings} */
  const settings = { ...DEFAULTS };
  for (const [name, text] of given) {
    if (!Object.hasOwn(DEFAULTS, name)) continue;
    const kind = typeof DEFAULTS[name];
    if (kind === "boolean") settings[name] = text === "true";
    else if (kind === "number") settings[name] = Number.isFinite(Number(text)) ? Number(text) : DEFAULTS[name];
    else if (name === "unit") settings.unit = text.slice(0, 8);
    else if (name === "fileName") settings[name] = text.slice(0, MAX_NAME);
    else if (name === "quantity" || words[name]?.includes(text)) settings[name] = text;
  }
  return settings;
}

/** @param {Settings} settings */
export function toHash(settings) {
  const changed = Object.entries(settings).filter(
    ([name, value]) => name in DEFAULTS && !Object.is(value, DEFAULTS[name]),
  );
  return changed.length === 0 ? "" : `#${new URLSearchParams(changed.map(([name, value]) => [name, String(value)]))}`;
}
