// @ts-check
// The page: settings in, requests to the service, pictures and words out.

import { ask } from "./control/asking.js";
import { loadExample } from "./control/clouds.js";
import { at, form } from "./control/elements.js";
import { change, events, page, scene, WORDS } from "./control/page.js";
import { histogram, showPicture } from "./control/picture.js";
import "./control/pointer.js";
import { chosen, rangeNow } from "./control/range.js";
import "./control/leaving/saving.js";
import { fillForm, isStep, keepInLink } from "./control/settings.js";
import { requestOf } from "./model/operations.js";
import { saveKey, savedKey } from "./model/service.js";
import { showEffects } from "./words/effects.js";
import { DEFAULTS, fromHash } from "./model/state.js";

/** Points up to which every movement of a slider is answered. */
const AT_ONCE = 3000;

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
events.addEventListener("settings", (event) => {
  const { changed, isPush = false } = /** @type {CustomEvent} */ (event).detail;
  // A length scale is that of a kernel.
  if (changed.lengthScale > 0 && page.settings.family === "auto") changed.family = "gauss";
  Object.assign(page.settings, changed);
  fillForm();
  keepInLink(isPush);
  if ("example" in changed) return loadExample();
  // The answer that comes with an example has no principal directions.
  const isMissing = changed.directions && page.answer === page.cloud?.known;
  if (isMissing || Object.keys(changed).some((name) => REQUEST_SETTINGS.includes(name))) ask();
  else showPicture(changed);
  showEffects();
});

form.addEventListener("input", (event) => {
  const field = /** @type {HTMLInputElement} */ (event.target);
  const { name, type, checked, value } = field;
  if (!(name in DEFAULTS)) return;
  const kind = typeof DEFAULTS[name];
  const given = type === "checkbox" ? checked : kind === "number" ? Number(value) : value;
  // Slow answers wait for the end of a movement.
  if (REQUEST_SETTINGS.includes(name) && type === "range" && !isSmall()) return;
  const isEnd = name === "low" || name === "high";
  if (isEnd && value === "") return;
  const { low, high } = isEnd ? rangeNow(chosen()) : {};
  const own = isEnd ? { range: "own", low, high } : {};
  change({ ...own, [name]: given }, { isPush: isStep(field) });
});
form.addEventListener("submit", (event) => event.preventDefault());
at("bySupport").addEventListener("change", () =>
  change({ colour: at("bySupport").checked ? "support" : "quantity" }, { isPush: true }),
);
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
    change({ [name]: value }, { isPush: isStep(slider) });
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
  const isOf = (settings) => [settings.example, settings.fileName, settings.operation, requestOf(settings)];
  const [[example, file, ...asked], [example2, file2, ...asked2]] = [before, page.settings].map(isOf);
  if (example !== example2 || file !== file2) loadExample();
  else if (JSON.stringify(asked) !== JSON.stringify(asked2)) ask();
  else showPicture(page.settings);
});
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const paint = () => {
  scene.background(getComputedStyle(document.documentElement).getPropertyValue("--stage").trim());
  histogram.draw();
};
dark.addEventListener("change", paint);

fillForm();
paint();
loadExample();
