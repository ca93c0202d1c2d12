// @ts-check
// The cloud as the service knows it.

import { Refusal, register } from "../model/service.js";
import { page } from "./page.js";

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

/** Problems of a service that has forgotten what it was told, as one that was restarted. */
const FORGOTTEN = ["unknown-cloud", "unknown-job"];

/** Tries once more if the service has forgotten the cloud. */
export async function repeated(send) {
  try {
    return await send();
  } catch (error) {
    if (!(error instanceof Refusal) || !FORGOTTEN.includes(error.slug)) throw error;
    page.cloudId = undefined;
    return send();
  }
}
