// @ts-check
// Refusals of the service in the words of the page: points, surfaces and its own controls, with what helps.

/** @import { Problem, Remedy, Settings } from "../types.d.ts" */

/** Names of controls by the members of requests that they set. */
const CONTROLS = {
  "/alpha": "Noise α",
  "/duplicates": "Equal points",
  "/include": "Error bars",
  "/kernel": "Kernel",
  "/kernel/epsilon": "Regularization ε of Laplace",
  "/kernel/family": "Kernel",
  "/kernel/length_scale": "Length scale ℓ",
  "/open": "The surface ends with its points",
  "/quality": "Triangles",
  "/solver": "Solver",
  "/step": "Step",
  "/surface_model": "Surface model",
};

/** @type {Record<string, Remedy>} */
const REMEDIES = {
  anyKernel: { label: "Choose the kernel automatically", set: { family: "auto", lengthScale: 0, epsilon: 0 } },
  anyNoise: { label: "Choose the noise automatically", set: { alpha: 0 } },
  everything: {
    label: "Choose kernel, noise and solver automatically",
    set: { solver: "auto", surfaceModel: "auto", family: "auto", lengthScale: 0, epsilon: 0, alpha: 0 },
  },
  anyStep: { label: "Choose the step automatically", set: { step: 0 } },
  open: { label: "Let the surface end with its points", set: { open: true } },
  merge: { label: "Merge equal points", set: { duplicates: "merge" } },
  drop: { label: "Drop the repeated points", act: "dropRepeats" },
  withoutBars: { label: "Compute without error bars", set: { std: false } },
  again: { label: "Try again", act: "again" },
};

/**
 * @typedef {object} Context
 * @property {Settings} settings
 * @property {number} n Number of points of the cloud.
 */

/**
 * What a problem means here: a title, a sentence or two, and remedies. Titles say what is wrong.
 *
 * @typedef {object} Words
 * @property {string} title
 * @property {(problem: Problem, context: Context) => string} text
 * @property {(problem: Problem, context: Context) => Remedy[]} [remedies]
 */

const AGAIN = () => [REMEDIES.again];
const EVERYTHING = () => [REMEDIES.everything];
const OF_THE_PAGE =
  "The page and the service do not fit together. Load the page again; if that does not help, this is a bug.";

/** @type {(title: string) => Words} */
const mismatch = (title) => ({ title, text: () => OF_THE_PAGE, remedies: AGAIN });

/** @type {Record<string, Words>} */
export const PROBLEMS = {
  "invalid-cloud": {
    title: "These points are no surface",
    text: (problem) =>
      `A surface needs points in at least two dimensions, each with finite coordinates, and normals that are not zero. ${placeOf(problem)}`,
    remedies: (problem) =>
      /\/normals/.test(pointerOf(problem)) ? [{ label: "Go on without the normals", act: "dropNormals" }] : [],
  },
  "duplicate-points": {
    title: "Some points are equal",
    text: ({ point_indices: points = [] }) =>
      `Without noise, a surface cannot pass through a point twice. ${rowsInWords(points, "Repeated")}`,
    remedies: () => [REMEDIES.merge, REMEDIES.drop],
  },
  "dimension-mismatch": mismatch("Points of different dimensions"),
  "length-mismatch": mismatch("Points and their values or normals differ in number"),
  "kernel-not-smooth": {
    title: "This kernel has no curvature at the points",
    text: () =>
      "It has a kink at every point, so normals and curvatures do not exist there. Raise the regularization ε of Laplace, or take another kernel.",
    remedies: (_, { settings }) => [
      REMEDIES.anyKernel,
      ...(settings.family === "laplace" ? [{ label: "Use ε = 1", set: { epsilon: 1 } }] : []),
    ],
  },
  "kernel-not-positive-definite": {
    title: "This kernel does not fit the dimension of the points",
    text: () => "Wendland's kernels work in up to three dimensions.",
    remedies: () => [REMEDIES.anyKernel],
  },
  "not-positive-definite": {
    title: "The kernel is too smooth for points so close together",
    text: () =>
      "Computers do not have enough digits for it. More noise α, a shorter length scale ℓ or a rougher kernel helps.",
    remedies: ({ minimum_alpha: least = 0 }) => [...(least > 0 ? [noiseOf(least)] : []), REMEDIES.anyKernel],
  },
  "not-converged": {
    title: "The iterative solver did not finish",
    text: () => "It got no nearer to the surface. More noise α, a shorter length scale ℓ or another solver helps.",
    remedies: ({ minimum_alpha: least = 0 }) => [
      ...(least > 0 ? [noiseOf(least)] : []),
      { label: "Choose the solver automatically", set: { solver: "auto" } },
      REMEDIES.anyKernel,
    ],
  },
  "unsupported-by-solver": {
    title: "These choices do not go together",
    text: (problem, context) => {
      const control = controlOf(problem);
      const chosen = control ? `“${control}” has no effect` : "Not every kernel and noise can be chosen";
      const who =
        context.settings.solver === "local" || context.settings.surfaceModel === "regression"
          ? "local regressions, which find kernel and noise themselves"
          : "the solver that serves so many points";
      return `${chosen} with ${who}. Leave the choice to the service, or take the surface model “signature”.`;
    },
    remedies: () => [
      REMEDIES.everything,
      { label: "Use the surface model signature", set: { surfaceModel: "signature", solver: "auto" } },
    ],
  },
  "unknown-cloud": {
    title: "The service has forgotten the points",
    text: () => "It keeps clouds as long as it has room. The page sends them again.",
    remedies: AGAIN,
  },
  "unknown-job": {
    title: "The service has forgotten the computation",
    text: () => "It was restarted, or the result was not fetched in time.",
    remedies: AGAIN,
  },
  "invalid-request": {
    title: "A setting is out of its range",
    text: (problem, context) => {
      const control = controlOf(problem);
      if (pointerOf(problem) === "/open") {
        return "The points do not enclose a volume: inside and outside cannot be told apart. If the surface ends where its points end, say so.";
      }
      if (pointerOf(problem) === "/step" && context.settings.step > 0) {
        return "With this step no surface was found. The step may be longer than the shape.";
      }
      return control
        ? `“${control}” has a value that the service does not take. ${placeOf(problem)}`.trim()
        : placeOf(problem) || OF_THE_PAGE;
    },
    remedies: (problem, { settings }) => {
      const pointer = pointerOf(problem);
      if (pointer === "/open") return [REMEDIES.open];
      if (pointer === "/step") return settings.step > 0 ? [REMEDIES.anyStep] : [];
      if (pointer === "/alpha") return [REMEDIES.anyNoise];
      return pointer.startsWith("/kernel") ? [REMEDIES.anyKernel] : EVERYTHING();
    },
  },
  "problem-too-large": {
    title: "This is too much for the service",
    text: ({ limit, required }, { settings, n }) => {
      if (settings.operation === "mesh" && settings.step > 0)
        return "So short a step makes more triangles than the service sends.";
      const much =
        limit !== undefined && required !== undefined && required <= n
          ? ` It takes ${many(limit)} points so, and there are ${many(n)}.`
          : "";
      return `The points, or the answer, are more than the service has room for with these choices.${much}`;
    },
    remedies: (_, { settings }) => [
      ...(settings.operation === "mesh" && settings.step > 0 ? [REMEDIES.anyStep] : []),
      REMEDIES.everything,
      ...(settings.std ? [REMEDIES.withoutBars] : []),
    ],
  },
  "body-too-large": {
    title: "The file is too large for the service",
    text: () =>
      "Whoever runs the service may raise the limit. Otherwise thin the cloud, for example to every second point.",
  },
  "deadline-exceeded": {
    title: "The computation took too long",
    text: () =>
      "The service ends long computations. The automatic choice of the solver is the fastest for many points.",
    remedies: (_, { settings }) => [
      ...(settings.solver === "auto" && settings.surfaceModel === "auto" && settings.family === "auto"
        ? []
        : [REMEDIES.everything]),
      ...(settings.std ? [REMEDIES.withoutBars] : []),
      REMEDIES.again,
    ],
  },
  "request-timeout": {
    title: "The points arrived too slowly",
    text: () => "The connection to the service is slow, or it was interrupted.",
    remedies: AGAIN,
  },
  unauthorized: {
    title: "The service needs a key",
    text: () => "Enter it in the field “Key of the service”. The page then repeats the request.",
  },
  "rate-limited": {
    title: "Too many requests at once",
    text: () => "Your key has a limit of requests a minute. Wait a little, then try again.",
    remedies: AGAIN,
  },
  overloaded: {
    title: "The service is busy",
    text: () => "It is working on other requests. Wait a little, then try again.",
    remedies: AGAIN,
  },
  internal: {
    title: "The service made a mistake",
    text: ({ instance }) =>
      `This is a bug. Whoever runs the service finds it in the log${instance ? ` under ${instance}` : ""}.`,
    remedies: AGAIN,
  },
  "malformed-request": mismatch("The request was damaged on its way"),
  "malformed-json": mismatch("The request was damaged on its way"),
  "malformed-body": mismatch("The request was damaged on its way"),
  "not-found": mismatch("The service does not have this computation"),
  "method-not-allowed": mismatch("The service does not have this computation"),
  "not-acceptable": mismatch("The service does not answer in this format"),
  "unsupported-media-type": mismatch("The service does not read this format"),
};

/**
 * A refusal in words, with remedies. `said` is the sentence of the service, for those who know its interface.
 *
 * @param {{ slug: string, problem: Problem }} refusal
 * @param {Context} context
 */
export function problemInWords({ slug, problem }, context) {
  if (!Object.hasOwn(PROBLEMS, slug)) return { title: problem.title, detail: problem.detail, remedies: [] };
  const { title, text, remedies } = PROBLEMS[slug];
  return {
    title,
    detail: text(problem, context).trim(),
    said: problem.detail,
    remedies: remedies?.(problem, context) ?? [],
  };
}

/**
 * Rows by number, the first ones of many. They count from 0, as points of the picture do.
 *
 * @param {ArrayLike<number>} rows
 * @param {string} what
 */
export function rowsInWords(rows, what) {
  if (rows.length === 0) return "";
  const first = Array.from({ length: Math.min(rows.length, 5) }, (_, at) => many(rows[at]));
  const more = rows.length > first.length ? ` and ${many(rows.length - first.length)} more` : "";
  return `${what}: ${rows.length === 1 ? "point" : "points"} ${first.join(", ")}${more}.`;
}

function many(n) {
  return n.toLocaleString("en");
}

/** @returns {Remedy} */
function noiseOf(least) {
  const alpha = Number(least.toPrecision(2));
  return { label: `Use the noise α = ${alpha}`, set: { alpha: alpha < least ? 2 * alpha : alpha } };
}

/** @param {Problem} problem */
function pointerOf({ errors }) {
  return errors?.[0]?.pointer ?? "";
}

/** The control whose setting was refused. */
function controlOf(problem) {
  const pointer = pointerOf(problem);
  return CONTROLS[pointer] ?? CONTROLS[pointer.replace(/(?<=.)\/.*$/, "")];
}

/** The point that was refused. */
function placeOf(problem) {
  const point = pointerOf(problem).match(/\/(points|normals)\/(\d+)/);
  return point ? `See ${point[1] === "points" ? "point" : "the normal of point"} ${many(Number(point[2]))}.` : "";
}
