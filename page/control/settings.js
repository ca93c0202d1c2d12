// @ts-check
// The form of settings, and the link that keeps them.

import { toHash } from "../model/state.js";
import { all, at, fieldOf, form } from "./elements.js";
import { page } from "./page.js";

/**
 * Keeps the settings in the link, at most every third of a second: browsers refuse more.
 *
 * @param {boolean} isPush Whether a step back is to undo the change.
 */
export function keepInLink(isPush) {
  clearTimeout(page.keeping);
  const keep = () => {
    const hash = toHash(page.settings);
    if (hash === location.hash) return;
    history[isPush ? "pushState" : "replaceState"](null, "", location.pathname + hash);
  };
  if (isPush) keep();
  else page.keeping = window.setTimeout(keep, 300);
}

/**
 * The field that is being moved or typed in.
 *
 * @type {string | undefined}
 */
let held;

/**
 * Whether a step back is to undo a change of a field: every choice, and the whole of a movement.
 *
 * @param {{ id: string, name: string, type: string }} field
 */
export function isStep({ id, name, type }) {
  const isMoved = ["range", "number"].includes(type);
  const isFirst = held !== (name || id);
  held = isMoved ? name || id : undefined;
  return !isMoved || isFirst;
}
for (const end of ["change", "focusout"]) {
  form.addEventListener(end, () => {
    held = undefined;
  });
}

export function fillForm() {
  for (const [name, value] of Object.entries(page.settings)) {
    const field = fieldOf(name);
    if (!field) continue;
    if (field.type === "checkbox") field.checked = value === true;
    else if (field !== document.activeElement) field.value = Number.isNaN(value) ? "" : String(value);
  }
  const { operation, colour } = page.settings;
  for (const part of all("[data-for]")) part.hidden = part.dataset.for !== operation;
  const cut = page.settings.cut === "box" || page.settings.cut === "none" ? page.settings.cut : "plane";
  for (const part of all("[data-cut]")) part.hidden = part.dataset.cut !== cut;
  at("bySupport").checked = colour === "support";
  for (const button of all("[data-save=glb]")) button.hidden = operation !== "mesh";
}
