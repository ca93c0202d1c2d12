// @ts-check
// The picture of an answer: colours, marks and what is drawn beside the points.

import { quantitiesOf, requestOf } from "../model/operations.js";
import { pixelsOf, planeOf, valuesOn, WIDTH } from "../model/section.js";
import { rangeOf, shown, sortedOf, SUPPORT } from "../view/colours.js";
import { Histogram } from "../view/histogram.js";
import { element, markedOf, showDiagnostics, showMarks, showSupport, summaryOf } from "../view/readout.js";
import { at, fieldOf } from "./elements.js";
import { change, events, page, scene } from "./page.js";
import { idOf, refuse } from "./registered.js";

/** @import { Answer, Cloud, ColourRange, Quantity, Settings } from "../types.d.ts" */

/** Settings of what is drawn beside points and meshes. */
const OVERLAY_SETTINGS = ["arrows", "directions", "section", "sectionAt"];

export const histogram = new Histogram(at("histogram"), (low, high) => change({ range: "own", low, high }));

events.addEventListener("drawn", showScale);

/**
 * @param {Answer} answer
 * @param {{ isNew: boolean }} options
 */
export function showAnswer(answer, { isNew }) {
  const { cloud } = page;
  if (!cloud) return;
  page.answer = answer;
  page.shown = page.settings.operation;
  page.quantities = quantitiesOf(answer, cloud);
  page.reasons = markedOf(answer);
  page.reasonOf = new Map([...page.reasons].flatMap(([reason, { points }]) => points.map((point) => [point, reason])));
  page.hidden.clear();
  page.point = undefined;
  const { vertices, cells, normals } = answer.tensors;
  const before = scene.object;
  scene.show({ positions: vertices ?? cloud.points, cells, normals, nearby: cloud.points.rows });
  scene.project(page.settings.orthographic);
  if (isNew || !before) scene.fit();
  const names = page.quantities.map(({ id, title }) => new Option(title, id));
  fieldOf("quantity").replaceChildren(...names);
  showMarks(at("marks"), page.reasons, (reason, isShown) => {
    page.hidden[isShown ? "delete" : "add"](reason);
    showExtras();
  });
  at("pinned").hidden = true;
  at("support").hidden = !answer.fields.support;
  showSupport(at("support"), answer);
  showDiagnostics(at("diagnostics"), answer);
  showPicture();
  showExtras();
}

/** @returns {Quantity | undefined} */
export function chosen() {
  return page.quantities.find(({ id }) => id === page.settings.quantity) ?? page.quantities[0];
}

/**
 * The range of colours, and which points are hidden, from the settings.
 *
 * @param {Quantity | undefined} quantity
 * @returns {ColourRange}
 */
export function rangeNow(quantity) {
  const { settings } = page;
  const own = settings.range === "own" && settings.low < settings.high;
  const [low, high] = own
    ? [settings.low, settings.high]
    : quantity
      ? rangeOf(quantity, settings.range === "full")
      : [0, 1];
  const known = quantity?.deviations ? sortedOf(quantity.deviations) : [];
  // Colours are grey where a deviation is half the range of colours.
  const full = settings.suppress && known.length > 0 ? 0.5 * (high - low) : 0;
  const hide = known.length > 0 && settings.hide < 1 ? known[Math.floor(settings.hide * (known.length - 1))] : Infinity;
  return { low, high, full, hide, isSigned: quantity?.isSigned ?? false, hasLines: settings.isolines };
}

/** @param {Partial<Settings>} changed */
export function showPicture(changed = {}) {
  const { settings, answer, cloud } = page;
  if (!answer || !cloud) return;
  const quantity = chosen();
  const range = rangeNow(quantity);
  if (settings.colour === "support" && answer.fields.support) colourBySupport(answer.fields.support);
  else scene.colour(quantity, range);
  fieldOf("quantity").value = quantity?.id ?? "";
  for (const [name, end] of Object.entries({ low: range.low, high: range.high })) {
    const field = fieldOf(name);
    if (field !== document.activeElement) field.value = String(Number(end.toPrecision(4)));
  }
  const isHiding = quantity !== undefined && Number.isFinite(range.hide);
  at("hideText").textContent = isHiding ? `${shown(range.hide)} ${quantity.unit}` : "(nothing hidden)";
  at("title").textContent = quantity ? `${quantity.title}${quantity.unit ? `, ${quantity.unit}` : ""}` : "Points";
  histogram.show(quantity, range);
  at("summary").textContent = summaryOf({ answer, cloud, quantity, range, reasons: page.reasons });
  if ("orthographic" in changed) scene.project(settings.orthographic);
  if (OVERLAY_SETTINGS.some((name) => name in changed)) showExtras();
}

/** @param {string[]} support */
function colourBySupport(support) {
  const words = Object.keys(SUPPORT);
  const values = Float64Array.from(support, (word) => words.indexOf(word));
  scene.colour({ values }, { low: 0, high: words.length - 1, hide: Infinity, full: 0, isSigned: true });
}

function showExtras() {
  const { settings, answer, cloud, reasons } = page;
  scene.clearExtras();
  if (!answer || !cloud) return;
  for (const [reason, { points, colour }] of reasons) if (!page.hidden.has(reason)) scene.mark(points, colour);
  if (cloud.exact) scene.curve(cloud.exact, 0xf2c200);
  const { normals, principal_directions: directions } = answer.tensors;
  if (settings.arrows && normals) scene.arrows(normals);
  if (settings.directions && directions) {
    const d = cloud.points.width;
    for (let of = 0; of < d - 1; of++) {
      scene.arrows(directions, { offset: of * d, isBothWays: true, colour: [0xb0455f, 0x3f7fc4][of] });
    }
  }
  page.cutting?.abort();
  page.cutting = undefined;
  if (settings.section !== "none") showSection(cloud, answer);
}

/**
 * @param {Cloud} cloud
 * @param {Answer} answer
 */
async function showSection(cloud, answer) {
  const cutting = new AbortController();
  page.cutting = cutting;
  const { settings } = page;
  const plane = planeOf(cloud.points, Number(settings.section), settings.sectionAt);
  try {
    const cloudId = await idOf(cloud, cutting.signal);
    const used = answer.fields.diagnostics;
    const given = { cloudId, points: cloud.points, request: requestOf(settings), used, signal: cutting.signal };
    const pixels = pixelsOf(await valuesOn(plane, given));
    if (page.cutting === cutting) scene.section({ pixels, width: WIDTH, ...plane });
  } catch (error) {
    if (!cutting.signal.aborted) refuse(error);
  }
}

function showScale() {
  const wanted = 110 * scene.pixel();
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = [5, 2, 1].map((factor) => factor * power).find((size) => size <= wanted) ?? power;
  at("scale").style.width = `${length / scene.pixel()}px`;
  at("scale").replaceChildren(element("span", { textContent: `${shown(length)} L` }));
}
