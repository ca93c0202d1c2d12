// @ts-check
// The form of settings, and the link that keeps them.

import { toHash } from "../model/state.js";
import { all, at, fieldOf } from "./elements.js";
import { page } from "./page.js";

/** Keeps the settings in the link, at most every third of a second: browsers refuse more. */
export function keepInLink(isPush) {
  clearTimeout(page.keeping);
  const keep = () =>
    history[isPush ? "pushState" : "replaceState"](null, "", location.pathname + toHash(page.settings));
  if (isPush) keep();
  else page.keeping = window.setTimeout(keep, 300);
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
