// @ts-check
// Snippets that the page offers to copy. They are run, and nothing but the intended request may happen.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { OPERATIONS, requestOf } from "../../page/model/operations.js";
import { LANGUAGES, snippet } from "../../page/model/snippets.js";
import { DEFAULTS, fromHash } from "../../page/model/state.js";
import { asked, HOSTILE } from "./running.mjs";

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

/** Runs the snippets of a request in every language, and looks for the request in what they do. */
function check({ address, fileName, operation = "curvatures", request, cloudId = "0".repeat(64) }) {
  const url = `${address}${OPERATIONS[operation].path}`;
  const body = { cloud: { id: cloudId }, ...request };
  const of = (language) => asked(language, snippet(language, { address, cloudId, operation, request, fileName }));
  const [[given, header, json, dash, sent]] = of("curl");
  assert.deepEqual(
    [given, header, json, dash, JSON.parse(sent)],
    [url, "-H", "Content-Type: application/json", "-d", body],
  );
  const cloud = /\.ply$/.test(fileName) ? fileName : "...";
  assert.deepEqual(of("python"), [
    ["client", address.slice(0, -1)],
    ["cloud", cloud],
    [OPERATIONS[operation].method, request],
  ]);
  const [[fetched, { method, body: text }]] = of("typescript");
  assert.deepEqual([fetched, method, JSON.parse(text)], [url, "POST", body]);
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
    const given = Object.fromEntries(texts.filter((name) => name !== "quantity").map((name) => [name, text]));
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
  const quoted = snippet("python", {
    address: "http://localhost:8080/",
    operation: "mesh",
    request: {},
    fileName: "a\u202eb.ply",
  });
  assert.ok(quoted.includes('client.cloud("a\\u202eb.ply")'), quoted);
});

for (const language of Object.keys(LANGUAGES)) {
  test(`a hostile link changes nothing of what a snippet in ${language} does`, () => {
    for (const text of HOSTILE) {
      const hash = `#${new URLSearchParams({ solver: text, surfaceModel: text, family: text, operation: text })}`;
      const request = requestOf(fromHash(hash, words));
      const given = { address: "http://localhost:8080/", cloudId: "0", operation: "curvatures", request };
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
      cloudId: text,
    });
    check({ address: "http://localhost:8080/", fileName: `${text}.csv`, request: { open: true, alpha: null } });
  }
});
