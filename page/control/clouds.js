// @ts-check
// Clouds: examples, files that are opened, dropped or pasted.

import { EXAMPLES } from "../model/examples.js";
import { requestOf } from "../model/operations.js";
import { DEFAULTS } from "../model/state.js";
import { repeatsOf, without } from "../reading/cleaning.js";
import { readCloud } from "../reading/client.js";
import { element } from "../view/readout.js";
import { rowsInWords } from "../words/problems.js";
import { refuse, Undecided } from "../words/refusal.js";
import { ask, stopAsking } from "./asking.js";
import { at } from "./elements.js";
import { showRequest } from "./leaving/request.js";
import { change, events, page } from "./page.js";
import { showAnswer } from "./picture.js";
import { fillForm, keepInLink } from "./settings.js";

/** @import { Cloud, ReadCloud, Remedy } from "../types.d.ts" */

/** Points up to which repeated ones are looked for at once, as the reader of files does beside the page. */
const CHECKED = 20_000;

/** Shows the example or the file that the settings name. */
export async function loadExample() {
  const { example, fileName } = page.settings;
  if (example === "") return loadNamed(fileName);
  if (!Object.hasOwn(EXAMPLES, example)) {
    page.settings.example = DEFAULTS.example;
    fillForm();
  }
  const name = page.settings.example;
  const { make, isLarge } = EXAMPLES[name];
  await load(async () => ({ ...(await (isLarge ? readCloud({ example: name }) : make())), example: name }));
}

/**
 * Shows the file that was opened last, if it has a name, or asks for it: links carry no points.
 *
 * @param {string} name
 */
async function loadNamed(name) {
  const { own } = page;
  if (own && (name === "" || own.name === name)) {
    page.settings.fileName = own.name;
    return load(() => own);
  }
  if (name === "" && page.cloud) {
    page.settings.example = page.cloud.example ?? "";
    fillForm();
    return at("file").click();
  }
  return load(() => {
    const file = name || "a file";
    const detail = `Links carry settings, no points, so ${name || "the file"} stayed with whoever made this link. Open it here if you have it.`;
    throw new Undecided(`This link shows ${file}`, detail, [
      { label: `Open ${file}`, act: "openFile" },
      { label: "See an example", set: { example: DEFAULTS.example, fileName: "" } },
    ]);
  });
}
events.addEventListener("openFile", () => at("file").click());

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
    if (cloud.points.rows <= CHECKED) cloud.repeats ??= repeatsOf(cloud.points);
    Object.assign(page, { cloud, cloudId: undefined });
    if (cloud.example === undefined) page.own = cloud;
    at("cloud").textContent = descriptionOf(cloud);
    showCleaning(cloud);
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

/**
 * Shows the cloud of a file. A step back leads to what was there before.
 *
 * @param {string} name
 * @param {() => Promise<ReadCloud>} make
 */
function loadOwn(name, make) {
  Object.assign(page.settings, { example: "", fileName: name });
  fillForm();
  keepInLink(true);
  load(async () => decided(await make()));
}

/** @param {File} file */
const fromFile = (file) => loadOwn(file.name, () => readCloud({ file }));

// What is left out of a file.

/**
 * A cloud whose points or normals cannot all be used, until its reader decides.
 *
 * @type {ReadCloud | undefined}
 */
let undecided;

/**
 * The cloud, if all of it can be used.
 *
 * @param {ReadCloud} cloud
 */
function decided(cloud) {
  const { gaps = [], undirected = [], textColumns = [], strictly, points, name } = cloud;
  if (gaps.length === 0 && undirected.length === 0 && strictly === undefined) return cloud;
  undecided = cloud;
  const counted = (rows, what) =>
    rows.length > 0 ? [`${share(rows.length, points.rows)} ${what} (${rowsInWords(rows, "counted from 0")})`] : [];
  const texts =
    textColumns.length === 1
      ? `The column ${textColumns[0]} is text.`
      : `The columns ${textColumns.join(", ")} are text.`;
  const details = [
    ...(textColumns.length > 0 ? [texts] : []),
    ...counted(gaps, "have no position"),
    ...counted(undirected, "have a normal without direction"),
    ...(strictly ? [`The first place is ${strictly}.`] : []),
  ];
  /** @type {Remedy[]} */
  const remedies = [{ label: "Leave them out and go on", act: "dropGaps" }];
  if (undirected.length > 0) remedies.push({ label: "Go on without normals", act: "dropNormals" });
  throw new Undecided(`Not all of ${name} is numbers`, details.join(" "), remedies);
}

function share(n, of) {
  return `${n.toLocaleString("en")} of ${of.toLocaleString("en")} points`;
}

/** Shows what is left of a cloud once rows are dropped from it. */
function loadWithout(cloud, rows) {
  load(() => without({ ...cloud, repeats: undefined }, rows));
}

events.addEventListener("dropGaps", () => {
  if (!undecided) return;
  const { gaps, undirected, repeats = [], ...cloud } = undecided;
  const rows = Uint32Array.from(new Set([...(gaps ?? []), ...(undirected ?? [])])).sort();
  if (rows.length > 0) loadWithout(cloud, rows);
  else load(() => ({ ...cloud, repeats: Uint32Array.from(repeats) }));
});
events.addEventListener("dropNormals", () => {
  const cloud = undecided?.name === page.settings.fileName ? undecided : page.cloud;
  if (cloud) loadWithout({ ...cloud, normals: undefined }, Uint32Array.from(undecided?.gaps ?? []));
});
events.addEventListener("dropRepeats", () => {
  const { cloud } = page;
  if (cloud) loadWithout(cloud, cloud.repeats ?? repeatsOf(cloud.points));
});

/**
 * Says which points repeat others, and offers to drop or merge them.
 *
 * @param {Cloud} cloud
 */
function showCleaning({ repeats = new Uint32Array(), points }) {
  at("cleaning").hidden = repeats.length === 0;
  if (repeats.length === 0) return;
  const button = (label, run) => {
    const made = element("button", { type: "button", textContent: label });
    made.addEventListener("click", run);
    return made;
  };
  const text = `${share(repeats.length, points.rows)} repeat earlier ones. ${rowsInWords(repeats, "Counted from 0")}`;
  at("cleaning").replaceChildren(
    element("p", { className: "hint", textContent: text }),
    button("Drop them", () => events.dispatchEvent(new Event("dropRepeats"))),
    button("Merge them", () => change({ duplicates: "merge" }, { isPush: true })),
  );
}

// Files that are chosen, dropped or pasted.

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
  if (text) fromFile(new File([text], "pasted"));
});
