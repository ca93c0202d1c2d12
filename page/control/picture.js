// @ts-check
// The picture of an answer: its colours, and what is said of them.

import { quantitiesOf } from "../model/operations.js";
import { shown, SUPPORT } from "../view/colours.js";
import { Histogram } from "../view/histogram.js";
import { element, markedOf, showDiagnostics, showMarks, showSupport, summaryOf } from "../view/readout.js";
import { at, fieldOf } from "./elements.js";
import { CUT_SETTINGS, OVERLAY_SETTINGS, showCut, showExtras } from "./overlay.js";
import { change, events, page, scene } from "./page.js";
import { chosen, isPositive, rangeNow } from "./range.js";

/** @import { Answer, ColourRange, Quantity, Settings } from "../types.d.ts" */

/** Settings on which the numbers in the buffers depend. */
const NUMBER_SETTINGS = ["quantity", "colour", "logarithmic"];

/** Settings of how these numbers become colours. */
const RANGE_SETTINGS = ["range", "low", "high", "centre", "map", "hide", "suppress", "isolines"];

/** The part of the points with a side beyond which those that look away are hidden. */
const CLOSED = 0.5;

export const histogram = new Histogram(at("histogram"), (low, high) => change({ range: "own", low, high }));

events.addEventListener("drawn", showScale);

/**
 * @param {Answer} answer
 * @param {{ isNew: boolean }} options
 */
export async function showAnswer(answer, { isNew }) {
  const { cloud } = page;
  if (!cloud) return;
  const { vertices, cells, normals } = answer.tensors;
  const before = scene.body;
  const positions = vertices ?? cloud.points;
  if (!(await scene.show({ positions, cells, normals, hidesAway: hidesAway(answer) }))) return;
  page.answer = answer;
  page.shown = page.settings.operation;
  page.quantities = quantitiesOf(answer, cloud, page.settings.unit);
  page.reasons = markedOf(answer);
  page.reasonOf = new Map([...page.reasons].flatMap(([reason, { points }]) => points.map((point) => [point, reason])));
  page.hidden.clear();
  page.point = undefined;
  showView();
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
  await showPicture();
  showExtras();
  events.dispatchEvent(new Event("answered"));
}

/**
 * Whether points that look away are hidden: they are wanted to be, and have sides.
 *
 * @param {Answer} answer
 */
function hidesAway({ tensors, fields }) {
  const hasSides = tensors.normals !== undefined && !tensors.vertices && (fields.closedness ?? 1) > CLOSED;
  fieldOf("away").disabled = !hasSides;
  fieldOf("away").title = hasSides ? "" : "These points have no outer side, or it is not known.";
  return page.settings.away && hasSides;
}

/** Axes, projection, dots and light, from the settings. */
function showView() {
  const { settings } = page;
  scene.raise(settings.up === "z" || (settings.up === "auto" && scene.isTerrain));
  scene.project(settings.orthographic);
  scene.dotFactor = settings.dots;
  scene.isShaded = settings.depth;
  if (scene.body && page.answer) scene.body.material.uniforms.hidesAway.value = hidesAway(page.answer);
  scene.picker.view = "";
  scene.draw();
}

/** @param {Partial<Settings>} changed */
export async function showPicture(changed = {}) {
  const { settings, answer, cloud } = page;
  if (!answer || !cloud) return;
  if ("unit" in changed) page.quantities = quantitiesOf(answer, cloud, settings.unit);
  const quantity = chosen();
  const range = rangeNow(quantity);
  showWords(quantity, range);
  if (Object.keys(changed).length > 0) showView();
  if (OVERLAY_SETTINGS.some((name) => name in changed)) showExtras();
  if (CUT_SETTINGS.some((name) => name in changed)) showCut();
  await showColours(quantity, range, Object.keys(changed));
}

/**
 * Fills buffers where the numbers in them have changed, and otherwise changes the range alone.
 *
 * @param {Quantity | undefined} quantity
 * @param {ColourRange} range
 * @param {string[]} changed names of settings. None: the answer is new
 */
async function showColours(quantity, range, changed) {
  const support = page.settings.colour === "support" ? page.answer?.fields.support : undefined;
  if (changed.length > 0 && !changed.some((name) => NUMBER_SETTINGS.includes(name))) {
    if (!support && changed.some((name) => RANGE_SETTINGS.includes(name))) scene.range(range, !quantity);
  } else if (support) await colourBySupport(support);
  else if (quantity?.channels) await scene.paint(quantity.channels, range);
  else await scene.colour(quantity, range);
}

/**
 * What is said of the colours: title, ends, summary, histogram.
 *
 * @param {Quantity | undefined} quantity
 * @param {ColourRange} range
 */
function showWords(quantity, range) {
  const { answer, cloud, reasons, settings } = page;
  if (!answer || !cloud) return;
  fieldOf("quantity").value = quantity?.id ?? "";
  fieldOf("logarithmic").disabled = !isPositive(quantity);
  fieldOf("logarithmic").title = isPositive(quantity) ? "" : "Only positive numbers have a logarithm.";
  for (const [name, end] of Object.entries({ low: range.low, high: range.high })) {
    const field = fieldOf(name);
    if (field !== document.activeElement) field.value = String(Number(end.toPrecision(4)));
  }
  const isHiding = quantity !== undefined && Number.isFinite(range.hide);
  at("hideText").textContent = isHiding ? `${shown(range.hide)} ${quantity.unit}` : "(nothing hidden)";
  at("title").textContent = quantity ? `${quantity.title}${quantity.unit ? `, ${quantity.unit}` : ""}` : "Points";
  at("unitOfLength").hidden = settings.unit !== "";
  histogram.show(quantity?.channels ? undefined : quantity, range);
  at("summary").textContent = summaryOf({ answer, cloud, quantity, range, reasons });
}

/** @param {string[]} support */
async function colourBySupport(support) {
  const words = Object.keys(SUPPORT);
  const values = Float64Array.from(support, (word) => words.indexOf(word));
  const ends = { low: 0, middle: 0.5 * (words.length - 1), high: words.length - 1, isLogarithmic: false };
  await scene.colour({ values }, { ...ends, map: "first", hide: Infinity, full: 0 });
}

function showScale() {
  const wanted = 110 * scene.pixel();
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = [5, 2, 1].map((factor) => factor * power).find((size) => size <= wanted) ?? power;
  at("scale").style.width = `${length / scene.pixel()}px`;
  at("scale").replaceChildren(element("span", { textContent: `${shown(length)} ${page.settings.unit || "L"}` }));
}
