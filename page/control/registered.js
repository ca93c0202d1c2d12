// @ts-check
// The cloud as the service knows it, and refusals.

import { remedyOf } from "../model/operations.js";
import { Refusal, register } from "../model/service.js";
import { showRefusal } from "../view/readout.js";
import { at } from "./elements.js";
import { change, page } from "./page.js";

/** @import { Cloud } from "../types.d.ts" */

/**
 * The id of a cloud, which is registered first if the service does not know it.
 *
 * @param {Cloud} cloud
 * @param {AbortSignal} [signal]
 */
export async function idOf(cloud, signal) {
  if (page.cloud === cloud && page.cloudId) return page.cloudId;
  const id = await register(cloud.points, cloud.normals, signal);
  if (page.cloud === cloud) page.cloudId = id;
  return id;
}

/** Tries once more if the service has forgotten the cloud. */
export async function repeated(send) {
  try {
    return await send();
  } catch (error) {
    if (!(error instanceof Refusal) || error.slug !== "unknown-cloud") throw error;
    page.cloudId = undefined;
    return send();
  }
}

export function refuse(error) {
  const isRefusal = error instanceof Refusal;
  const remedy = isRefusal ? remedyOf(error, page.settings) : undefined;
  const title = isRefusal ? error.problem.title : "This did not work";
  showRefusal(at("refusal"), { title, detail: error.message, remedy }, change);
}
