// @ts-check
// The service: requests, jobs with progress, and refusals.

import { decode, encode } from "./tensors.js";

/** @import { Answer, Problem, Progress } from "../types.d.ts" */
/** @import { Tensor } from "./tensors.js" */

const TENSORS = "application/x-safetensors";

/** Points from which a request runs as a job, whose progress can be shown. */
const JOB_FROM = 4000;

const KEY = "gramian-key";

/** A problem document of the service. */
export class Refusal extends Error {
  /** @param {Problem} problem */
  constructor(problem) {
    super(problem.detail);
    this.problem = problem;
    this.slug = (problem.type ?? "").replace(/^.*\//, "");
  }
}

/** The service does not answer: it was stopped, or the network is interrupted. */
export class Lost extends Error {}

/** Statuses by which a proxy says, without a problem document, that there is no service behind it. */
const ABSENT = [502, 503, 504];

/** Whether the service answers. */
export async function isReachable() {
  try {
    return (await fetch("health/live", { cache: "no-store" })).ok;
  } catch {
    return false;
  }
}

let ownKey = "";

/** The key of this tab. Browsers that allow no storage forget it when the page is left. */
export function savedKey() {
  try {
    return sessionStorage.getItem(KEY) ?? ownKey;
  } catch {
    return ownKey;
  }
}

/** Keeps the key for this tab. It is never part of a link. */
export function saveKey(key) {
  ownKey = key;
  try {
    if (key) sessionStorage.setItem(KEY, key);
    else sessionStorage.removeItem(KEY);
  } catch {
    // Without storage, the page itself remembers it.
  }
}

async function ask(path, options) {
  const key = savedKey();
  const headers = { ...options.headers, ...(key ? { Authorization: `Bearer ${key}` } : {}) };
  const response = await sent(path, { ...options, headers });
  if (response.ok) return response;
  const isProblem = response.headers.get("Content-Type")?.startsWith("application/problem+json");
  if (!isProblem && ABSENT.includes(response.status)) throw new Lost();
  const problem = isProblem ? await response.json() : { title: "No answer", detail: `HTTP status ${response.status}` };
  throw new Refusal({ status: response.status, ...problem });
}

/** A body in safetensors. Browsers send a blob beside the page, and an array within it. */
function blobOf(tensors, request) {
  return new Blob([encode(tensors, request)]);
}

async function sent(path, options) {
  try {
    return await fetch(path, options);
  } catch (error) {
    throw options.signal?.aborted ? error : new Lost();
  }
}

/** A part of an answer, whose connection may break off. */
async function arriving(part, signal) {
  try {
    return await part;
  } catch (error) {
    throw signal?.aborted ? error : new Lost();
  }
}

/**
 * Registers a cloud. Returns its id.
 *
 * @param {Tensor} points
 * @param {Tensor} [normals]
 * @param {AbortSignal} [signal]
 * @returns {Promise<string>}
 */
export async function register(points, normals, signal) {
  /** @type {Record<string, Tensor>} */
  const tensors = normals ? { points, normals } : { points };
  const headers = { "Content-Type": TENSORS, Accept: "application/json" };
  const response = await ask("v1/clouds", { method: "POST", body: blobOf(tensors, {}), headers, signal });
  return (await response.json()).cloud_id;
}

/**
 * Computes an answer. `follow` is called with the progress of long computations. Aborting the signal cancels
 * the computation in the service too.
 *
 * @param {string} path
 * @param {object} request
 * @param {{
 *   nPoints: number,
 *   signal?: AbortSignal,
 *   follow?: (progress?: Progress) => void,
 *   tensors?: Record<string, Tensor>,
 * }} options
 * @returns {Promise<Answer>}
 */
export async function compute(path, request, { nPoints, signal, follow, tensors }) {
  const body = tensors ? blobOf(tensors, request) : JSON.stringify(request);
  const headers = { "Content-Type": tensors ? TENSORS : "application/json", Accept: TENSORS };
  const began = performance.now();
  const found = await answered(path, { method: "POST", body, headers, signal }, { nPoints, follow });
  return {
    ...decode(found.buffer),
    seconds: (performance.now() - began) / 1000,
    timing: timings(found.headers.get("Server-Timing") ?? ""),
  };
}

/**
 * A file of an answer, for download.
 *
 * @param {string} path
 * @param {object} request
 * @param {{ mediaType: string, nPoints: number }} options
 */
export async function download(path, request, { mediaType, nPoints }) {
  const headers = { "Content-Type": "application/json", Accept: mediaType };
  const found = await answered(path, { method: "POST", body: JSON.stringify(request), headers }, { nPoints });
  return new Blob([found.buffer], { type: mediaType });
}

/**
 * Sends a request, as a job if it may take long.
 *
 * @param {string} path
 * @param {RequestInit & { headers: Record<string, string> }} options
 * @param {{ nPoints: number, follow?: (progress?: Progress) => void }} effort
 */
async function answered(path, options, { nPoints, follow }) {
  return nPoints < JOB_FROM ? whole(await ask(path, options), options.signal) : asJob(path, options, follow);
}

async function whole(response, signal) {
  return { buffer: await arriving(response.arrayBuffer(), signal), headers: response.headers };
}

async function asJob(path, options, follow) {
  const { signal } = options;
  // The request is not broken off: a job whose id nobody has would run to its end.
  const headers = { ...options.headers, Prefer: "respond-async" };
  const response = await ask(path, { ...options, signal: undefined, headers });
  if (response.status !== 202) return whole(response, signal);
  const job = `v1/jobs/${response.headers.get("Location")?.split("/").pop()}`;
  try {
    signal?.throwIfAborted();
    while (!(await followed(`${job}/events`, signal, follow))) await new Promise((resume) => setTimeout(resume, 1000));
    return await whole(await ask(`${job}/result`, { signal }), signal);
  } finally {
    // Cancels the job, or deletes the result that was fetched.
    ask(job, { method: "DELETE" }).catch(() => {});
  }
}

/** Reads server-sent events. Says whether the job is done; a stream may break off before. */
async function followed(path, signal, follow) {
  const response = await ask(path, { headers: { Accept: "text/event-stream" }, signal });
  if (!response.body) return false;
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await arriving(reader.read(), signal);
    if (done) return false;
    text += value;
    const events = text.split("\n\n");
    text = events.pop() ?? "";
    for (const event of events) {
      const data = event
        .split("\n")
        .filter((line) => line.startsWith("data:"))
        .map((line) => line.slice(5));
      if (data.length > 0) follow?.(JSON.parse(data.join("\n")).progress);
      if (/^event: *done$/m.test(event)) return true;
    }
  }
}

/** Milliseconds by name, from a Server-Timing header. */
function timings(header) {
  const entries = header.split(",").map((entry) => entry.trim().match(/^([\w-]+);dur=([\d.]+)/));
  return Object.fromEntries(
    entries.filter((entry) => entry !== null).map(([, name, duration]) => [name, Number(duration)]),
  );
}
