// @ts-check
// The reader of files, which works beside the page.

import { Tensor } from "../model/tensors.js";

/** @import { ReadCloud } from "../types.d.ts" */

/** @type {Worker | undefined} */
let worker;

/** Number of the last reading. */
let last = 0;

/** What is waited for, by number. */
const waiting = new Map();

function begun() {
  const made = new Worker("page/reading/worker.js", { type: "module" });
  made.addEventListener("message", ({ data: { number, cloud, refused } }) => {
    const { resolve, reject } = waiting.get(number);
    waiting.delete(number);
    if (refused === undefined) resolve(restored(cloud));
    else reject(new Error(refused));
  });
  made.addEventListener("error", () => {
    // It ended, for example because memory is full. The next file gets another one.
    for (const { reject } of waiting.values())
      reject(new Error("the file could not be read: the browser has no memory left"));
    waiting.clear();
    worker = undefined;
  });
  return made;
}

/** A cloud that came as plain data. */
function restored(cloud) {
  const tensor = (plain) => plain && new Tensor(plain.data, plain.shape);
  return { ...cloud, points: tensor(cloud.points), normals: tensor(cloud.normals) };
}

/**
 * The cloud of a file, or of an example by its name.
 *
 * @param {{ file?: File, example?: string }} wanted
 * @returns {Promise<ReadCloud>}
 */
export function readCloud(wanted) {
  worker ??= begun();
  last += 1;
  const number = last;
  return new Promise((resolve, reject) => {
    waiting.set(number, { resolve, reject });
    worker?.postMessage({ number, ...wanted });
  });
}
