// @ts-check
// Questions to the service, and how far they are.

import { OPERATIONS, requestOf } from "../model/operations.js";
import { compute } from "../model/service.js";
import { at } from "./elements.js";
import { events, page } from "./page.js";
import { showAnswer } from "./picture.js";
import { idOf, repeated } from "./registered.js";
import { refuse } from "../words/refusal.js";
import { showRequest } from "./leaving/request.js";

events.addEventListener("again", () => ask());

/** @import { Answer, Cloud, Progress } from "../types.d.ts" */

/** Answers that are kept for each cloud, for those who go back to earlier settings. */
const KEPT = 6;

/**
 * Answers by their requests, in the order of their arrival.
 *
 * @type {WeakMap<Cloud, Map<string, Answer>>}
 */
const answers = new WeakMap();

/** Asks the service. A later question ends an earlier one. Answers that are still known are shown again. */
export async function ask() {
  page.asking?.abort();
  const asking = new AbortController();
  page.asking = asking;
  const { cloud, settings } = page;
  if (!cloud) return;
  const request = requestOf(settings);
  showRequest(request);
  at("refusal").hidden = true;
  const kept = answers.get(cloud) ?? new Map();
  answers.set(cloud, kept);
  const name = `${settings.operation} ${JSON.stringify(request)}`;
  if (kept.has(name)) {
    at("progress").hidden = true;
    document.body.dataset.state = "asking";
    await showAnswer(kept.get(name), { isNew: settings.operation !== page.shown });
    if (page.asking === asking) document.body.dataset.state = "settled";
    return;
  }
  document.body.dataset.state = "asking";
  const timer = setTimeout(() => showProgress({}), 250);
  try {
    const answer = await withCloud(cloud, request, asking.signal);
    kept.set(name, answer);
    for (const oldest of [...kept.keys()].slice(0, -KEPT)) kept.delete(oldest);
    if (page.asking === asking) await showAnswer(answer, { isNew: settings.operation !== page.shown });
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

/** Ends what is asked about the cloud. */
export function stopAsking() {
  page.asking?.abort();
  page.cutting?.abort();
  page.asking = page.cutting = undefined;
  at("progress").hidden = true;
}
