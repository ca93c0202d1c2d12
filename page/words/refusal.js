// @ts-check
// Refusals on screen: of the service, of files, and a service that does not answer.

import { at } from "../control/elements.js";
import { change, events, page } from "../control/page.js";
import { isReachable, Lost, Refusal, savedKey } from "../model/service.js";
import { showRefusal } from "../view/readout.js";
import { problemInWords } from "./problems.js";

/** @import { Remedy } from "../types.d.ts" */

/** Milliseconds between two looks for a service that does not answer. */
const LOOK_EVERY = 2000;

/** A file or link that needs a decision, with remedies. */
export class Undecided extends Error {
  /**
   * @param {string} title
   * @param {string} detail
   * @param {Remedy[]} remedies
   */
  constructor(title, detail, remedies) {
    super(detail);
    this.title = title;
    this.remedies = remedies;
  }
}

/** @param {unknown} error */
export function refuse(error) {
  if (error instanceof Lost) return refuseLost();
  if (error instanceof Undecided) return show(error.title, { detail: error.message, remedies: error.remedies });
  if (error instanceof Refusal) {
    const { title, ...words } = problemInWords(error, { settings: page.settings, n: page.cloud?.points.rows ?? 0 });
    show(title, words);
    if (error.slug === "unauthorized") askForKey();
    return;
  }
  show("This did not work", { detail: error instanceof Error ? error.message : String(error), remedies: [] });
}

/**
 * @param {string} title
 * @param {{ detail: string, said?: string, remedies: Remedy[] }} words
 */
function show(title, { remedies, ...words }) {
  const actions = remedies.map(({ label, set, act }) => ({
    label,
    run: () => (set ? change(set, { isPush: true }) : events.dispatchEvent(new Event(act ?? ""))),
  }));
  showRefusal(at("refusal"), { title, ...words, actions });
}

/** Opens the field for the key. Once there is one, the request is repeated. */
function askForKey() {
  const field = at("key");
  at("keyHint").textContent = savedKey()
    ? "The service does not take this key. Look for a typing error, or ask whoever runs the service."
    : "The service answers those who have a key. Whoever runs it hands them out.";
  at("keyPart").open = true;
  at("keyPart").scrollIntoView({ block: "nearest" });
  field.focus();
}

/** Says that the service is lost, and goes on once it is back. */
function refuseLost() {
  const remedies = [{ label: "Try now", act: "again" }];
  const detail =
    "It was stopped, or the connection is interrupted. The page looks for it, and goes on once it is back.";
  show("The service does not answer", { detail, remedies });
  const shown = at("refusal").firstElementChild;
  const look = async () => {
    // Another refusal, an answer or the reader has closed this one.
    if (at("refusal").hidden || at("refusal").firstElementChild !== shown) return;
    if (await isReachable()) events.dispatchEvent(new Event("again"));
    else setTimeout(look, LOOK_EVERY);
  };
  setTimeout(look, LOOK_EVERY);
}
