// @ts-check
// What is drawn over the points: marks, arrows, the section, the box and the axes, and what is cut away.

import { requestOf } from "../model/operations.js";
import { planeOf, valuesOn, WIDTH } from "../model/section.js";
import { boxOf, edgesOf } from "../view/frame.js";
import { shown } from "../view/colours.js";
import { element } from "../view/readout.js";
import { at } from "./elements.js";
import { events, page, scene } from "./page.js";
import { idOf } from "./registered.js";
import { refuse } from "../words/refusal.js";

/** @import { Answer, Cloud } from "../types.d.ts" */

/** Settings of what is drawn beside points and meshes. */
export const OVERLAY_SETTINGS = ["arrows", "directions", "section", "sectionAt", "frame", "unit"];

/** Settings of what is cut away. */
export const CUT_SETTINGS = ["cut", "cutAt", "cutFlip", "x0", "x1", "y0", "y1", "z0", "z1"];

const AXES = ["x", "y", "z"];

events.addEventListener("drawn", () => {
  placeLabels();
  drawAxes();
});

export function showExtras() {
  const { settings, answer, cloud, reasons } = page;
  const { body, extras } = scene;
  extras.clear();
  at("labels").replaceChildren();
  if (!answer || !cloud || !body) return;
  for (const [reason, marks] of reasons) if (!page.hidden.has(reason)) extras.mark(body, marks);
  if (cloud.exact) extras.curve(body, cloud.exact, 0xf2c200);
  const { normals, principal_directions: directions } = answer.tensors;
  if (settings.arrows && normals) extras.arrows(body, normals);
  if (settings.directions && directions) {
    const d = cloud.points.width;
    for (let of = 0; of < d - 1; of++) {
      extras.arrows(body, directions, { offset: of * d, isBothWays: true, colour: [0xb0455f, 0x3f7fc4][of] });
    }
  }
  if (settings.frame) showFrame();
  page.cutting?.abort();
  page.cutting = undefined;
  if (settings.section !== "none") showSection(cloud, answer);
  showCut();
}

/** Cuts away what the settings say. */
export function showCut() {
  if (scene.body) scene.cut(boxOf(scene.body.arrangement, page.settings));
}

/** A box about the points, with the lengths of its edges. */
function showFrame() {
  const { body } = scene;
  if (!body) return;
  const { low, high, middle, dimension } = body.arrangement;
  scene.extras.segments(edgesOf(low, high, middle), 0x7a8698);
  const unit = page.settings.unit || "L";
  const labels = AXES.slice(0, dimension).map((name, axis) => {
    const place = middle.map((x, other) => (other === axis ? 0 : low[other] - x));
    const label = element("span", { textContent: `${name}: ${shown(high[axis] - low[axis])} ${unit}` });
    label.dataset.place = place.join(" ");
    return label;
  });
  at("labels").replaceChildren(...labels);
}

/** Keeps labels at their places while the view moves. */
function placeLabels() {
  for (const label of at("labels").children) {
    if (!(label instanceof HTMLElement)) continue;
    const [x, y] = scene.placeOnCanvas((label.dataset.place ?? "").split(" ").map(Number));
    label.style.left = `${x}px`;
    label.style.top = `${y}px`;
  }
}

/** The directions of the axes, in a corner. */
function drawAxes() {
  const canvas = at("axes");
  const context = canvas.getContext("2d");
  if (!context) return;
  const scale = window.devicePixelRatio;
  const [size, reach] = [canvas.clientWidth, 0.33 * canvas.clientWidth];
  Object.assign(canvas, { width: size * scale, height: size * scale });
  context.scale(scale, scale);
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineWidth = 2;
  const ends = scene.axes().map(([x, y, towards], axis) => ({ axis, x, y, towards }));
  for (const { axis, x, y } of ends.slice(0, scene.dimension).sort((a, b) => a.towards - b.towards)) {
    context.strokeStyle = context.fillStyle = ["#c0392b", "#2e8b57", "#3f6fc4"][axis];
    context.beginPath();
    context.moveTo(size / 2, size / 2);
    context.lineTo(size / 2 + reach * x, size / 2 + reach * y);
    context.stroke();
    context.fillText(AXES[axis], size / 2 + 1.3 * reach * x, size / 2 + 1.3 * reach * y);
  }
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
    const levels = await valuesOn(plane, given);
    if (page.cutting === cutting) scene.section(levels, WIDTH, plane);
  } catch (error) {
    if (!cutting.signal.aborted) refuse(error);
  }
}
