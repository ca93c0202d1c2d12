// Settings of the page, kept in the link.

export const DEFAULTS = {
  example: "dragon",
  operation: "curvatures",
  quantity: "",
  deviations: true,
  surface: "auto",
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
  colour: "quantity",
  isolines: false,
  arrows: false,
  directions: false,
  section: "none",
  sectionAt: 0.5,
  orthographic: false,
};

/** Words that other parts of the page rely on. */
const WORDS = {
  operation: ["curvatures", "normals", "mesh"],
  section: ["none", "0", "1", "2"],
  range: ["percentile", "full", "own"],
  quality: ["regular", "raw"],
  duplicates: ["refuse", "merge"],
};

/** Settings from the fragment of a link. Unknown names and senseless values are passed over. */
export function fromHash(hash) {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  const settings = { ...DEFAULTS };
  for (const [name, text] of given) {
    if (!Object.hasOwn(DEFAULTS, name) || (WORDS[name] && !WORDS[name].includes(text))) continue;
    const kind = typeof DEFAULTS[name];
    if (kind === "boolean") settings[name] = text === "true";
    else if (kind === "number") settings[name] = Number.isFinite(Number(text)) ? Number(text) : DEFAULTS[name];
    else settings[name] = text;
  }
  return settings;
}

export function toHash(settings) {
  const changed = Object.entries(settings).filter(([name, value]) => name in DEFAULTS && !Object.is(value, DEFAULTS[name]));
  return changed.length === 0 ? "" : `#${new URLSearchParams(changed)}`;
}
