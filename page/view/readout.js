// @ts-check
// What the picture says in words and numbers: summary, marks by reason, the point under the pointer,
// diagnostics.

import { REASONS, warningInWords } from "../words/warnings.js";
import { SUPPORT, cssOf, shown } from "./colours.js";

/** @import { Answer, Cloud, ColourRange, Marks, PageState } from "../types.d.ts" */
/** @import { Quantity } from "../types.d.ts" */

/** Colours of marks, none of which the scales have. */
const MARKS = [
  [0.85, 0.1, 0.75],
  [0.1, 0.1, 0.1],
  [0.95, 0.45, 0],
  [0, 0.5, 0.2],
  [0.3, 0.2, 0.8],
  [0.6, 0.4, 0.2],
  [0.9, 0.2, 0.2],
  [0.1, 0.6, 0.6],
];

/**
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @param {Partial<HTMLElementTagNameMap[Name]>} properties
 * @param {...(Node | string)} children
 */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  Object.assign(made, properties);
  made.append(...children);
  return made;
}

/**
 * Points without an answer, or with a doubtful one, by reason.
 *
 * @param {Answer} answer
 * @returns {Map<string, Marks>}
 */
export function markedOf(answer) {
  const reasons = new Map();
  for (const { query, reason } of answer.fields.flags ?? []) {
    const marks = reasons.get(reason) ?? { points: [], colour: MARKS[reasons.size % MARKS.length] };
    marks.points.push(query);
    reasons.set(reason, marks);
  }
  return reasons;
}

export function words(reason) {
  return REASONS[reason] ?? reason.replaceAll("_", " ");
}

/**
 * Check boxes for the marks of each reason.
 *
 * @param {HTMLElement} into
 * @param {Map<string, Marks>} reasons
 * @param {(reason: string, isShown: boolean) => void} changed
 */
export function showMarks(into, reasons, changed) {
  into.replaceChildren(
    ...[...reasons].map(([reason, { points, colour }]) => {
      const box = element("input", { type: "checkbox", checked: true });
      box.addEventListener("change", () => changed(reason, box.checked));
      const swatch = element("span", { className: "swatch" });
      swatch.style.color = cssOf(colour);
      return element(
        "label",
        { className: "check" },
        box,
        swatch,
        `${points.length.toLocaleString("en")} ${words(reason)}`,
      );
    }),
  );
}

/**
 * One sentence for everyone, and for screen readers.
 *
 * @param {{
 *   answer: Answer,
 *   cloud: Cloud,
 *   quantity?: Quantity,
 *   range: ColourRange,
 *   reasons: Map<string, Marks>,
 * }} shown
 */
export function summaryOf({ answer, cloud, quantity, range, reasons }) {
  const n = (answer.tensors.vertices ?? cloud.points).rows.toLocaleString("en");
  const what = answer.tensors.vertices ? "vertices" : "points";
  const nMarked = [...reasons.values()].reduce((sum, { points }) => sum + points.length, 0);
  const parts = [`${cloud.name}: ${n} ${what}`];
  if (quantity) parts.push(`${quantity.title} ${shown(range.low)} to ${shown(range.high)} ${quantity.unit}`.trim());
  if (nMarked > 0) parts.push(`${nMarked.toLocaleString("en")} marked`);
  for (const part of (answer.fields.parts ?? []).slice(0, 3)) {
    parts.push(`a part with Euler characteristic ${part.euler_characteristic} and ${part.n_boundary_edges} open edges`);
  }
  for (const warning of answer.fields.diagnostics?.warnings ?? []) parts.push(warningInWords(warning));
  return `${parts.join("; ")}.`;
}

/**
 * Value and deviation at a point.
 *
 * @param {Quantity | undefined} quantity
 * @param {number} point
 */
export function valueAt(quantity, point) {
  if (!quantity) return "";
  const deviation = quantity.deviations?.[point];
  const known = deviation !== undefined && Number.isFinite(deviation) ? ` ± ${shown(deviation)}` : "";
  if (quantity.channels) return `red, green, blue ${quantity.channels.map((of) => shown(of[point])).join(", ")}`;
  return `${shown(quantity.values[point])}${known} ${quantity.unit}${radiusOf(quantity, point)}`.trim();
}

/**
 * The radius of curvature 1/|κ| beside a curvature, with the deviation σ/κ² where it is small beside it.
 *
 * @param {Quantity} quantity
 * @param {number} point
 */
function radiusOf({ id, values, deviations, unit }, point) {
  const curvature = Math.abs(values[point]);
  if (!/^(mean|principal)_curvatures/.test(id) || !(curvature > 0)) return "";
  const deviation = deviations ? deviations[point] / curvature ** 2 : NaN;
  const known = deviation < 0.5 / curvature ? ` ± ${shown(deviation)}` : "";
  return ` (radius ${shown(1 / curvature)}${known} ${unit.replace("1/", "")})`;
}

/**
 * Everything that is known of a point.
 *
 * @param {HTMLElement} into
 * @param {number} point
 * @param {PageState & { answer: Answer, cloud: Cloud }} page
 */
export function showPinned(into, point, { quantities, answer, cloud, reasons }) {
  const positions = answer.tensors.vertices ?? cloud.points;
  const d = positions.width;
  const position = [...positions.data.subarray(point * d, (point + 1) * d)].map(shown).join(", ");
  const rows = [["position", position]];
  rows.push(...quantities.filter(({ id }) => !id.includes("deviation")).map((of) => [of.title, valueAt(of, point)]));
  if (answer.fields.support) rows.push(["support", answer.fields.support[point]]);
  for (const [reason, { points }] of reasons) if (points.includes(point)) rows.push(["marked", words(reason)]);
  into.replaceChildren(element("strong", { textContent: `Point ${point}` }), list(rows), closing(into));
  into.hidden = false;
}

/**
 * A list of names with their texts.
 *
 * @param {(string | undefined)[][]} rows
 */
export function list(rows) {
  const entries = rows.flatMap(([name, text]) => [
    element("dt", { textContent: name }),
    element("dd", { textContent: text }),
  ]);
  return element("dl", {}, ...entries);
}

/**
 * @param {HTMLElement} into
 * @param {Answer} answer
 */
export function showSupport(into, answer) {
  const support = answer.fields.support;
  if (!support) return;
  const counts = Object.entries(SUPPORT).map(([word, colour]) => {
    const swatch = element("span", { className: "swatch" });
    swatch.style.color = colour;
    const n = support.filter((of) => of === word).length;
    return element("div", {}, swatch, ` ${n.toLocaleString("en")} ${word}`);
  });
  into.replaceChildren(...counts);
}

/**
 * @param {HTMLElement} into
 * @param {Answer} answer
 */
export function showDiagnostics(into, answer) {
  const used = answer.fields.diagnostics ?? {};
  const kernel = used.kernel ?? {};
  const timing = answer.timing ?? {};
  const reciprocal = used.reciprocal_condition ?? 0;
  const rows = [
    ["solver", used.solver],
    [
      "kernel",
      Object.entries(kernel)
        .map(([name, value]) => `${name} ${typeof value === "number" ? shown(value) : value}`)
        .join(", "),
    ],
    ["α", used.alpha === undefined ? undefined : shown(used.alpha)],
    ["condition", reciprocal > 0 ? shown(1 / reciprocal) : undefined],
    [
      "sides found",
      answer.fields.closedness === undefined ? undefined : `${(100 * answer.fields.closedness).toFixed(1)} %`,
    ],
    ["time", answer.seconds === undefined ? "computed when the page was made" : `${answer.seconds.toFixed(2)} s`],
    ...Object.entries(timing).map(([name, duration]) => [
      `of it ${name}`,
      name === "factor" && duration === 0 ? "cached" : `${duration} ms`,
    ]),
  ];
  const known = rows.filter(([, text]) => text !== undefined && text !== "");
  into.replaceChildren(...list(known).children);
}

/**
 * A refusal, with what can be done about it as buttons, and what the service said.
 *
 * @param {HTMLElement} into
 * @param {{
 *   title: string,
 *   detail: string,
 *   said?: string,
 *   actions?: { label: string, run: () => void }[],
 * }} refusal
 */
export function showRefusal(into, { title, detail, said, actions = [] }) {
  const buttons = actions.map(({ label, run }) => {
    const button = element("button", { type: "button", textContent: label });
    button.addEventListener("click", () => {
      into.hidden = true;
      run();
    });
    return button;
  });
  const summary = element("summary", { textContent: "The words of the service" });
  into.replaceChildren(
    element("h2", { textContent: title }),
    element("p", { textContent: detail }),
    ...(said ? [element("details", {}, summary, element("p", { textContent: said }))] : []),
    element("div", { className: "buttons" }, ...buttons, closing(into)),
  );
  into.hidden = false;
}

/** A button that hides an element. */
function closing(what) {
  const button = element("button", { type: "button", textContent: "Close" });
  button.addEventListener("click", () => {
    what.hidden = true;
  });
  return button;
}
