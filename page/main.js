// @ts-check
// The page: settings in, requests to the service, pictures and words out.

import { EXAMPLES } from "./model/examples.js";
import { readFile, read } from "./model/files.js";
import { OPERATIONS, quantitiesOf, remedyOf, requestOf } from "./model/operations.js";
import { pixelsOf, planeOf, valuesOn, WIDTH } from "./model/section.js";
import { compute, download, Refusal, register, savedKey, saveKey } from "./model/service.js";
import { LANGUAGES, snippet } from "./model/snippets.js";
import { begun, DEFAULTS, fromHash, toHash, wordsOf } from "./model/state.js";
import { rangeOf, shown, sortedOf, SUPPORT } from "./view/colours.js";
import { Histogram } from "./view/histogram.js";
import {
  element,
  markedOf,
  showDiagnostics,
  showMarks,
  showPinned,
  showRefusal,
  showSupport,
  summaryOf,
  valueAt,
} from "./view/readout.js";
import { Scene } from "./view/scene.js";

/** @import { Answer, Cloud, ColourRange, Elements, Progress, Quantity, Settings } from "./types.d.ts" */

/**
 * An element of the document.
 *
 * @template {keyof Elements} Id
 * @param {Id} id
 * @returns {Elements[Id]}
 */
function at(id) {
  return /** @type {any} */ (document.getElementById(id));
}

const form = at("settings");

/**
 * The field of a setting.
 *
 * @param {string} name
 * @returns {HTMLInputElement}
 */
function fieldOf(name) {
  return /** @type {any} */ (form.elements.namedItem(name));
}

/**
 * Elements that a selector finds.
 *
 * @param {string} selector
 * @returns {NodeListOf<HTMLElement>}
 */
function all(selector) {
  return document.querySelectorAll(selector);
}

/** Points up to which every movement of a slider is answered. */
const AT_ONCE = 3000;

/** Settings of what is drawn beside points and meshes. */
const OVERLAY_SETTINGS = ["arrows", "directions", "section", "sectionAt"];

/** Settings that change the request. All others change the picture alone. */
const REQUEST_SETTINGS = [
  "operation",
  "std",
  "quality",
  "open",
  "step",
  "family",
  "lengthScale",
  "epsilon",
  "alpha",
  "solver",
  "surfaceModel",
  "duplicates",
];

fieldOf("example").replaceChildren(
  ...Object.entries(EXAMPLES).map(([name, { title }]) => new Option(title, name)),
  new Option("a file of yours", ""),
);
fieldOf("operation").replaceChildren(...Object.entries(OPERATIONS).map(([name, { title }]) => new Option(title, name)));
const WORDS = wordsOf(form);

const page = begun(fromHash(location.hash, WORDS));

const scene = begin();
const histogram = new Histogram(at("histogram"), (low, high) => change({ range: "own", low, high }));

/** The scene, or the reason why there can be none. */
function begin() {
  try {
    return new Scene(at("scene"), showScale);
  } catch (error) {
    const detail = "This browser draws no pictures in three dimensions: WebGL is missing or switched off.";
    showRefusal(at("refusal"), { title: "No picture", detail });
    throw error;
  }
}

// Settings.

/**
 * Applies settings that have changed, and shows what follows.
 *
 * @param {Partial<Settings>} changed
 */
function change(changed, { isPush = false } = {}) {
  Object.assign(page.settings, changed);
  fillForm();
  keepInLink(isPush);
  if ("example" in changed) return loadExample();
  if (Object.keys(changed).some((name) => REQUEST_SETTINGS.includes(name))) return ask();
  return showPicture(changed);
}

/** Keeps the settings in the link, at most every third of a second: browsers refuse more. */
function keepInLink(isPush) {
  clearTimeout(page.keeping);
  const keep = () =>
    history[isPush ? "pushState" : "replaceState"](null, "", location.pathname + toHash(page.settings));
  if (isPush) keep();
  else page.keeping = window.setTimeout(keep, 300);
}

function fillForm() {
  for (const [name, value] of Object.entries(page.settings)) {
    const field = fieldOf(name);
    if (!field) continue;
    if (field.type === "checkbox") field.checked = value === true;
    else if (field !== document.activeElement) field.value = Number.isNaN(value) ? "" : String(value);
  }
  const { operation, colour } = page.settings;
  for (const part of all("[data-for]")) part.hidden = part.dataset.for !== operation;
  at("bySupport").checked = colour === "support";
  for (const button of all("[data-save=glb]")) button.hidden = operation !== "mesh";
}

form.addEventListener("input", (event) => {
  const { name, type, checked, value } = /** @type {HTMLInputElement} */ (event.target);
  if (!(name in DEFAULTS)) return;
  const kind = typeof DEFAULTS[name];
  const given = type === "checkbox" ? checked : kind === "number" ? Number(value) : value;
  // Slow answers wait for the end of a movement.
  if (REQUEST_SETTINGS.includes(name) && type === "range" && !isSmall()) return;
  const isEnd = name === "low" || name === "high";
  if (isEnd && value === "") return;
  const { low, high } = isEnd ? rangeNow(chosen()) : {};
  const own = isEnd ? { range: "own", low, high } : {};
  change({ ...own, [name]: given }, { isPush: ["example", "operation"].includes(name) });
});
form.addEventListener("submit", (event) => event.preventDefault());
at("bySupport").addEventListener("change", () => change({ colour: at("bySupport").checked ? "support" : "quantity" }));
at("key").value = savedKey();
at("key").addEventListener("change", () => {
  saveKey(at("key").value);
  page.cloudId = undefined;
  ask();
});

/** Whether the cloud is so small that every movement of a slider is answered. */
function isSmall() {
  return page.cloud !== undefined && page.cloud.points.rows <= AT_ONCE;
}

/** A slider over powers of ten that writes into a number. Small clouds are answered while it moves. */
function logarithmic(slider, name, settingOf) {
  const apply = () => {
    const value = Number(settingOf(Number(slider.value)).toPrecision(3));
    change(
      name === "lengthScale" && page.settings.family === "auto"
        ? { lengthScale: value, family: "gauss" }
        : { [name]: value },
    );
  };
  slider.addEventListener("input", () => isSmall() && apply());
  slider.addEventListener("change", apply);
}
logarithmic(at("scaleSlider"), "lengthScale", (power) => scene.radius * 10 ** (power - 0.5));
logarithmic(at("alphaSlider"), "alpha", (power) => (power <= -9.99 ? 0 : 10 ** power));

window.addEventListener("popstate", () => {
  clearTimeout(page.keeping);
  const before = page.settings;
  page.settings = fromHash(location.hash, WORDS);
  fillForm();
  if (before.example !== page.settings.example) loadExample();
  else ask();
});

// Clouds.

async function loadExample() {
  const { example } = page.settings;
  if (example === "" && page.cloud) return at("file").click();
  if (!Object.hasOwn(EXAMPLES, example)) {
    page.settings.example = DEFAULTS.example;
    fillForm();
  }
  await load(EXAMPLES[page.settings.example].make);
}

/** Ends what is asked about the cloud. */
function stopAsking() {
  page.asking?.abort();
  page.cutting?.abort();
  page.asking = page.cutting = undefined;
  at("progress").hidden = true;
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
  showAnswer(known ?? { tensors: {}, fields: {} }, { isNew: true });
  if (!known) return ask();
  showRequest(requestOf(page.settings));
  document.body.dataset.state = "settled";
}

/**
 * The id of a cloud, which is registered first if the service does not know it.
 *
 * @param {Cloud} cloud
 * @param {AbortSignal} [signal]
 */
async function idOf(cloud, signal) {
  if (page.cloud === cloud && page.cloudId) return page.cloudId;
  const id = await register(cloud.points, cloud.normals, signal);
  if (page.cloud === cloud) page.cloudId = id;
  return id;
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

// Requests.

/** Asks the service. A later question ends an earlier one. */
async function ask() {
  page.asking?.abort();
  const asking = new AbortController();
  page.asking = asking;
  const { cloud, settings } = page;
  if (!cloud) return;
  const request = requestOf(settings);
  showRequest(request);
  at("refusal").hidden = true;
  document.body.dataset.state = "asking";
  const timer = setTimeout(() => showProgress({}), 250);
  try {
    const answer = await withCloud(cloud, request, asking.signal);
    if (page.asking === asking) showAnswer(answer, { isNew: settings.operation !== page.shown });
  } catch (error) {
    if (!asking.signal.aborted) refuse(error);
  } finally {
    clearTimeout(timer);
    if (page.asking === asking) {
      at("progress").hidden = true;
      document.body.dataset.state = "settled";
    }
  }
}

/** Sends a request about the cloud, which is registered again if the service has forgotten it. */
async function withCloud(cloud, request, signal) {
  const { path } = OPERATIONS[page.settings.operation];
  return repeated(async () => {
    const id = await idOf(cloud, signal);
    showRequest(request);
    const body = { cloud: { id }, ...request };
    return compute(path, body, { nPoints: cloud.points.rows, signal, follow: showProgress });
  });
}

/** Tries once more if the service has forgotten the cloud. */
async function repeated(send) {
  try {
    return await send();
  } catch (error) {
    if (!(error instanceof Refusal) || error.slug !== "unknown-cloud") throw error;
    page.cloudId = undefined;
    return send();
  }
}

/** @param {Progress} [progress] */
function showProgress(progress) {
  const [bar, text] = [at("progress").querySelector("progress"), at("progress").querySelector("span")];
  if (!bar || !text) return;
  if (progress?.fraction === undefined) bar.removeAttribute("value");
  else bar.value = progress.fraction;
  const left = progress?.seconds_left ?? 0;
  text.textContent = `${progress?.stage ?? "computing"}${left > 1 ? `, ${Math.round(left)} s left` : ""}`;
  at("progress").hidden = false;
}

at("cancel").addEventListener("click", () => {
  page.asking?.abort();
  at("progress").hidden = true;
  at("summary").textContent = "Cancelled.";
});

function refuse(error) {
  const isRefusal = error instanceof Refusal;
  const remedy = isRefusal ? remedyOf(error, page.settings) : undefined;
  const title = isRefusal ? error.problem.title : "This did not work";
  showRefusal(at("refusal"), { title, detail: error.message, remedy }, change);
}

// Pictures.

/**
 * @param {Answer} answer
 * @param {{ isNew: boolean }} options
 */
function showAnswer(answer, { isNew }) {
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
function chosen() {
  return page.quantities.find(({ id }) => id === page.settings.quantity) ?? page.quantities[0];
}

/**
 * The range of colours, and which points are hidden, from the settings.
 *
 * @param {Quantity | undefined} quantity
 * @returns {ColourRange}
 */
function rangeNow(quantity) {
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
function showPicture(changed = {}) {
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

// The pointer and the keyboard.

at("scene").addEventListener("pointermove", (event) => {
  if (event.buttons !== 0) return;
  const point = scene.pick(event.offsetX, event.offsetY);
  const tip = at("tip");
  tip.hidden = point === undefined;
  if (point === undefined) return;
  const why = page.reasonOf.get(point);
  tip.textContent = `${valueAt(chosen(), point)}${why ? ` (${why.replaceAll("_", " ")})` : ""}`;
  tip.style.left = `${event.offsetX + 14}px`;
  tip.style.top = `${event.offsetY + 14}px`;
});
at("scene").addEventListener("pointerleave", () => {
  at("tip").hidden = true;
});
let pressed = [0, 0];
at("scene").addEventListener("pointerdown", (event) => {
  pressed = [event.clientX, event.clientY];
});
at("scene").addEventListener("click", (event) => {
  // The end of a turn is no click.
  if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5)
    pin(scene.pick(event.offsetX, event.offsetY));
});

/** @param {number | undefined} point */
function pin(point) {
  page.point = point;
  const { answer, cloud } = page;
  if (point === undefined || !answer || !cloud) return;
  showPinned(at("pinned"), point, { ...page, answer, cloud });
}

/** Pins the point that is nearest to the middle of the picture. */
function pinMiddle() {
  const { clientWidth: width, clientHeight: height } = at("scene");
  for (let reach = 0; reach < 400; reach += 8) {
    for (const [x, y] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ]) {
      const found = scene.pick(width / 2 + reach * x, height / 2 + reach * y);
      if (found !== undefined) return pin(found);
    }
  }
}

/** Arrows turn the view. Once a point is pinned, they walk to its neighbours. */
at("scene").addEventListener("keydown", (event) => {
  const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  if (event.key === "Escape") {
    page.point = undefined;
    at("pinned").hidden = true;
  }
  if (event.key === "Enter") pinMiddle();
  if (!step) return;
  event.preventDefault();
  if (page.point === undefined) return scene.turn(-0.1 * step[0], -0.1 * step[1]);
  const [x, y] = scene.onCanvas(page.point);
  for (let reach = 6; reach < 200; reach += 6) {
    const next = scene.pick(x + reach * step[0], y + reach * step[1]);
    if (next !== undefined && next !== page.point) return pin(next);
  }
});

/**
 * Directions of the views. Home has none.
 * @type {Record<string, number[]>} */
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

for (const button of all("[data-view]")) {
  const axis = AXES[button.dataset.view ?? ""];
  button.addEventListener("click", () => scene.fit(axis));
}

// What leaves the page.

function showRequest(request) {
  const { settings, cloudId, cloud } = page;
  const address = new URL(".", document.baseURI).href;
  const fileName = settings.example ? undefined : cloud?.name;
  at("code").textContent = snippet(page.language, {
    address,
    cloudId,
    operation: settings.operation,
    request,
    fileName,
  });
}

at("languages").replaceChildren(
  ...Object.entries(LANGUAGES).map(([language, title]) => {
    const button = element("button", {
      type: "button",
      textContent: title,
      ariaPressed: String(language === page.language),
    });
    button.addEventListener("click", () => {
      page.language = language;
      for (const other of at("languages").children) other.ariaPressed = String(other === button);
      showRequest(requestOf(page.settings));
    });
    return button;
  }),
);

/** Copies a text. Browsers allow it on secure origins only. */
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    at("summary").textContent = "Copied.";
  } catch {
    window.prompt("Copy this", text);
  }
}

at("copy").addEventListener("click", () => copy(at("code").textContent ?? ""));
at("link").addEventListener("click", () => copy(location.origin + location.pathname + toHash(page.settings)));

/** @type {Record<string, string>} */
const SAVED = { ply: "model/ply", glb: "model/gltf-binary" };

for (const button of all("[data-save]")) {
  button.addEventListener("click", () => save(button.dataset.save ?? "").catch(refuse));
}

/** @param {string} kind */
async function save(kind) {
  const { cloud, settings } = page;
  if (!cloud) return;
  if (kind === "png" || kind === "plain") return offer(await pictureOf(kind === "png"), `${cloud.name}.png`);
  const file = await repeated(async () => {
    const body = { cloud: { id: await idOf(cloud) }, ...requestOf(settings) };
    const asked = { mediaType: SAVED[kind], nPoints: cloud.points.rows };
    return download(OPERATIONS[settings.operation].path, body, asked);
  });
  return offer(file, `${cloud.name.replace(/\.[^.]*$/, "")}.${kind}`);
}

function offer(blob, name) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name.replace(/^.*[/\\]/, "") });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The scene as a picture, with the histogram and its title below if wanted. */
async function pictureOf(hasLegend) {
  scene.render();
  const [view, legend] = [at("scene"), at("histogram")];
  const height = hasLegend ? legend.height + 24 * window.devicePixelRatio : 0;
  const canvas = element("canvas", { width: view.width, height: view.height + height });
  const context = canvas.getContext("2d");
  if (!context) throw new Error("this browser draws no pictures");
  const styles = getComputedStyle(document.body);
  context.fillStyle = styles.backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(view, 0, 0);
  if (hasLegend) {
    context.fillStyle = styles.color;
    context.font = `${14 * window.devicePixelRatio}px system-ui, sans-serif`;
    context.fillText(at("title").textContent, 12, view.height + 18 * window.devicePixelRatio);
    context.drawImage(legend, 0, view.height + 24 * window.devicePixelRatio);
  }
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}

// The beginning.

const dark = window.matchMedia("(prefers-color-scheme: dark)");
const paint = () => {
  scene.background(getComputedStyle(document.documentElement).getPropertyValue("--stage").trim());
  histogram.draw();
};
dark.addEventListener("change", paint);

fillForm();
paint();
loadExample();
