// @ts-check
// What the page remembers, its picture, and the way in which its parts ask for other settings.

import { EXAMPLES } from "../model/examples.js";
import { OPERATIONS } from "../model/operations.js";
import { begun, fromHash, wordsOf } from "../model/state.js";
import { showRefusal } from "../view/readout.js";
import { Scene } from "../view/scene.js";
import { at, fieldOf, form } from "./elements.js";

/** @import { Settings } from "../types.d.ts" */

fieldOf("example").replaceChildren(
  ...Object.entries(EXAMPLES).map(([name, { title }]) => new Option(title, name)),
  new Option("a file of yours", ""),
);
fieldOf("operation").replaceChildren(...Object.entries(OPERATIONS).map(([name, { title }]) => new Option(title, name)));

/** Words that each setting may have. */
export const WORDS = wordsOf(form);

export const page = begun(fromHash(location.hash, WORDS));

/** Tells when a frame has been drawn, and when settings are asked for. */
export const events = new EventTarget();

export const scene = begin();

/** The scene, or the reason why there can be none. */
function begin() {
  try {
    return new Scene(at("scene"), () => events.dispatchEvent(new Event("drawn")));
  } catch (error) {
    const detail = "This browser draws no pictures in three dimensions: WebGL is missing or switched off.";
    showRefusal(at("refusal"), { title: "No picture", detail });
    throw error;
  }
}

/**
 * Asks for other settings. What follows from them is shown.
 *
 * @param {Partial<Settings>} changed
 * @param {{ isPush?: boolean }} options
 */
export function change(changed, options = {}) {
  events.dispatchEvent(new CustomEvent("settings", { detail: { changed, ...options } }));
}
