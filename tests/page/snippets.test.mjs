// @ts-check
// Snippets that the page offers to copy. They are run, and nothing but the intended request may happen.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { OPERATIONS, requestOf } from "../../page/model/operations.js";
import { LANGUAGES, snippet, sourceOf } from "../../page/model/leaving/snippets.js";
import { DEFAULTS, fromHash } from "../../page/model/state.js";
import { Tensor } from "../../page/model/tensors.js";
import { asked, HOSTILE, ID } from "./running.mjs";

const page = readFileSync(new URL("../../page/index.html", import.meta.url), "utf8");
const {
  components: { schemas },
  paths,
} = JSON.parse(readFileSync(new URL("../../openapi/openapi.json", import.meta.url), "utf8"));

/** The choices of the page by the names of its settings. */
const words = Object.fromEntries(
  [...page.matchAll(/<select name="(\w+)">(.*?)<\/select>/gs)].map(([, name, options]) => {
    return [name, [...options.matchAll(/value="(\w+)"/g)].map(([, word]) => word)];
  }),
);
words.operation = Object.keys(OPERATIONS);

/** A cloud of a file with points in space, too many to be in a snippet. */
function cloudOf(name, n = 100, d = 3) {
  return {
    name,
    points: new Tensor(
      Float64Array.from({ length: d * n }, (_, at) => at),
      [n, d],
    ),
    values: new Map(),
  };
}

/** The words of a curl command for a POST of a media type. */
const posted = (url, type) => ["--fail-with-body", "-sS", url, "-H", `Content-Type: ${type}`];

/** Runs the snippets of a request in every language, and looks for the request in what they do. */
function check({ address, fileName, operation = "curvatures", request }) {
  const { path, method } = OPERATIONS[operation];
  const source = sourceOf(cloudOf(fileName), true);
  const { file = "", mediaType = "" } = source;
  const of = (language) =>
    asked(language, snippet(language, { address, operation, request, source }), { [file]: "the points" });
  const body = { cloud: { id: ID }, ...request };
  const [registered, computed] = of("curl");
  assert.deepEqual(registered, [...posted(`${address}v1/clouds`, mediaType), "--data-binary", "@-", "the points"]);
  assert.deepEqual(computed.slice(0, 8), [...posted(address + path, "application/json"), "-o", `${method}.json`, "-d"]);
  assert.deepEqual(JSON.parse(computed[8]), body);
  assert.deepEqual(of("python"), [
    ["client", address.slice(0, -1)],
    ["cloud", `./${file}`],
    [method, request],
  ]);
  const [[clouds, { body: points }], [fetched, { method: verb, body: text }]] = of("typescript");
  assert.deepEqual([clouds, points, fetched, verb], [`${address}v1/clouds`, "the points", address + path, "POST"]);
  assert.deepEqual(JSON.parse(text), body);
}

test("the words of the page are those of the document", () => {
  const lists = {
    solver: "SolverChoice",
    surfaceModel: "SurfaceModelChoice",
    duplicates: "DuplicatePolicy",
    quality: "MeshQuality",
  };
  for (const [name, schema] of Object.entries(lists))
    assert.deepEqual([...words[name]].sort(), [...schemas[schema].enum].sort(), name);
  assert.deepEqual([...words.family].sort(), ["auto", ...schemas.KernelFamily.enum].sort());
  for (const { path } of Object.values(OPERATIONS)) assert.ok(paths[`/${path}`].post, path);
});

test("links choose among the words of the page, and nothing else", () => {
  const texts = Object.keys(DEFAULTS).filter((name) => typeof DEFAULTS[name] === "string");
  for (const text of [...HOSTILE, "", "none of them", "__proto__"]) {
    const given = Object.fromEntries(
      texts.filter((name) => !["quantity", "fileName", "unit"].includes(name)).map((name) => [name, text]),
    );
    assert.deepEqual(fromHash(`#${new URLSearchParams(given)}`, words), DEFAULTS, text);
  }
  for (const [name, text] of [
    ["solver", "iterative"],
    ["surfaceModel", "offset"],
    ["family", "laplace"],
    ["quality", "raw"],
  ]) {
    assert.equal(fromHash(`#${name}=${text}`, words)[name], text);
  }
});

test("snippets ask for what is on screen", () => {
  const settings = fromHash(
    "#operation=mesh&family=laplace&epsilon=1e-3&alpha=0.25&open=true&step=0.5&duplicates=merge",
    words,
  );
  check({ address: "http://localhost:8080/", fileName: "scan.ply", operation: "mesh", request: requestOf(settings) });
  const source = sourceOf(cloudOf("a\u202eb.ply"), true);
  const quoted = snippet("python", { address: "http://localhost:8080/", operation: "mesh", request: {}, source });
  assert.ok(quoted.includes('client.cloud("./a\\u202eb.ply")'), quoted);
});

test("few points are in the snippet, others in a file that the service reads", () => {
  const place = (cloud, isOwn) => {
    const { inline, file, isMade } = sourceOf(cloud, isOwn);
    return inline ? inline.points.length : [file, isMade];
  };
  assert.equal(place(cloudOf("ellipse", 64, 2), false), 64);
  assert.deepEqual(place(cloudOf("half an ellipse", 256, 2), false), ["half-an-ellipse.json", true]);
  assert.deepEqual(place(cloudOf("torus"), false), ["torus.ply", true]);
  assert.deepEqual(place(cloudOf("scan.XYZ"), true), ["scan.ply", true]);
  assert.deepEqual(place(cloudOf("scan.PLY"), true), ["scan.PLY", false]);
  assert.deepEqual(place({ ...cloudOf("scan.ply"), nLeftOut: 3 }, true), ["scan.ply", true]);
  assert.deepEqual(place(cloudOf("flat.npy", 100, 2), true), ["flat.npy", false]);
});

for (const language of Object.keys(LANGUAGES)) {
  test(`a hostile link changes nothing of what a snippet in ${language} does`, () => {
    for (const text of HOSTILE) {
      const hash = `#${new URLSearchParams({ solver: text, surfaceModel: text, family: text, operation: text })}`;
      const request = requestOf(fromHash(hash, words));
      const source = sourceOf(cloudOf("ball", 3), false);
      const given = { address: "http://localhost:8080/", operation: "curvatures", request, source };
      assert.deepEqual(request, { include: ["std"] });
      assert.ok(asked(language, snippet(language, given)).length > 0);
    }
  });
}

test("hostile names of files, servers and words are texts in every language", () => {
  for (const text of HOSTILE) {
    const address = new URL(`http://localhost:8080/${text.replaceAll("\\", "")}/`).href;
    check({
      address,
      fileName: `${text}.ply`,
      request: { solver: text, kernel: { family: text, [text]: 1 } },
    });
    check({ address: "http://localhost:8080/", fileName: `${text}.csv`, request: { open: true, alpha: null } });
  }
});
