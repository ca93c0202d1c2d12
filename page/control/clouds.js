// @ts-check
// Clouds: examples, files that are opened, dropped or pasted.

import { EXAMPLES } from "../model/examples.js";
import { readFile, read } from "../model/files.js";
import { requestOf } from "../model/operations.js";
import { DEFAULTS } from "../model/state.js";
import { ask, stopAsking } from "./asking.js";
import { at } from "./elements.js";
import { page } from "./page.js";
import { showAnswer } from "./picture.js";
import { refuse } from "./registered.js";
import { showRequest } from "./request.js";
import { fillForm, keepInLink } from "./settings.js";

/** @import { Cloud } from "../types.d.ts" */

export async function loadExample() {
  const { example } = page.settings;
  if (example === "" && page.cloud) return at("file").click();
  if (!Object.hasOwn(EXAMPLES, example)) {
    page.settings.example = DEFAULTS.example;
    fillForm();
  }
  await load(EXAMPLES[page.settings.example].make);
}

/**
 * Shows a cloud. A later choice ends an earlier one.
 *
 * @param {() => Cloud | Promise<Cloud>} make
 */
async function load(make) {
  const loading = {};
  page.loading = loading;
  stopAsking();
  at("refusal").hidden = true;
  document.body.dataset.state = "asking";
  try {
    const cloud = await make();
    if (page.loading !== loading) return;
    stopAsking();
    Object.assign(page, { cloud, cloudId: undefined });
    at("cloud").textContent = descriptionOf(cloud);
    await showFirst(cloud);
  } catch (error) {
    if (page.loading !== loading) return;
    refuse(error);
    document.body.dataset.state = "settled";
  }
}

/** @param {Cloud} cloud */
function descriptionOf({ name, points, nLeftOut = 0, values }) {
  const parts = [`${name}: ${points.rows.toLocaleString("en")} points in ${points.width} dimensions`];
  if (nLeftOut > 0) parts.push(`${nLeftOut.toLocaleString("en")} rows without a position left out`);
  if (values.size > 0) parts.push(`with ${[...values.keys()].join(", ")}`);
  return parts.join(", ");
}

/**
 * Shows the answer that an example brings, if it is one to the question, or asks.
 *
 * @param {Cloud} cloud
 */
async function showFirst(cloud) {
  const { operation } = page.settings;
  const isDefault =
    operation === DEFAULTS.operation &&
    JSON.stringify(requestOf(page.settings)) === JSON.stringify(requestOf(DEFAULTS));
  const known = isDefault ? cloud.known : undefined;
  const showing = showAnswer(known ?? { tensors: {}, fields: {} }, { isNew: true });
  if (!known) return ask();
  await showing;
  showRequest(requestOf(page.settings));
  document.body.dataset.state = "settled";
}

function loadOwn(make) {
  page.settings.example = "";
  fillForm();
  keepInLink(false);
  load(make);
}

const fromFile = (file) => loadOwn(() => readFile(file));

at("file").addEventListener("change", () => {
  const file = at("file").files?.[0];
  if (file) fromFile(file);
  // So that the same file can be chosen again.
  at("file").value = "";
});
window.addEventListener("dragover", (event) => {
  event.preventDefault();
  at("drop").hidden = false;
});
window.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) at("drop").hidden = true;
});
window.addEventListener("drop", (event) => {
  event.preventDefault();
  at("drop").hidden = true;
  const file = event.dataTransfer?.files[0];
  if (file) fromFile(file);
});
window.addEventListener("paste", (event) => {
  if (event.target instanceof Element && event.target.matches("input, select")) return;
  const text = event.clipboardData?.getData("text");
  if (text) loadOwn(() => read(new TextEncoder().encode(text), "pasted"));
});
