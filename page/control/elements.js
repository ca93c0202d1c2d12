// @ts-check
// The elements of the page.

/** @import { Elements } from "../types.d.ts" */

/**
 * An element of the document.
 *
 * @template {keyof Elements} Id
 * @param {Id} id
 * @returns {Elements[Id]}
 */
export function at(id) {
  return /** @type {any} */ (document.getElementById(id));
}

export const form = at("settings");

/**
 * The field of a setting.
 *
 * @param {string} name
 * @returns {HTMLInputElement}
 */
export function fieldOf(name) {
  return /** @type {any} */ (form.elements.namedItem(name));
}

/**
 * Elements that a selector finds.
 *
 * @param {string} selector
 * @returns {NodeListOf<HTMLElement>}
 */
export function all(selector) {
  return document.querySelectorAll(selector);
}
