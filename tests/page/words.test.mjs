// @ts-check
// Words of the page for everything that the service refuses or warns about.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { DEFAULTS } from "../../page/model/state.js";
import { PROBLEMS, problemInWords, rowsInWords } from "../../page/words/problems.js";
import { REASONS, WARNINGS, warningInWords } from "../../page/words/warnings.js";

const text = (path) => readFileSync(new URL(`../../${path}`, import.meta.url), "utf8");
const { schemas } = JSON.parse(text("openapi/openapi.json")).components;

/** Slugs of the catalogues of problems. */
const slugs = ["src/http/problem/catalogue.rs", "host/src/problem/catalogue.rs"].flatMap((path) =>
  [...text(path).matchAll(/^ {4}[A-Z_]+ "([a-z-]+)"/gm)].map(([, slug]) => slug),
);

/** Words of the interface, which mean nothing to those who see the page alone. */
const OF_THE_INTERFACE = /\b\w+_\w+\b|\bquer(y|ies)\b|\bJSON|\bHTTP|\bRFC|float64|\bpointer|\/v1\b|\bmember/;

const context = { settings: DEFAULTS, n: 100 };

test("every problem, warning and reason of the document has words", () => {
  assert.ok(slugs.length > 20);
  assert.deepEqual(Object.keys(PROBLEMS).sort(), slugs.sort());
  assert.deepEqual(Object.keys(WARNINGS).sort(), [...schemas.WarningCode.enum].sort());
  assert.deepEqual(Object.keys(REASONS).sort(), [...schemas.FlagReason.enum].sort());
});

test("the words are about points and surfaces", () => {
  for (const slug of slugs) {
    for (const pointer of ["", "/alpha", "/kernel/length_scale", "/open", "/step", "/points/17/0", "/solver"]) {
      const problem = {
        title: "",
        detail: "",
        errors: [{ pointer }],
        minimum_alpha: 1e-9,
        point_indices: [3],
        limit: 1,
      };
      const { title, detail, remedies } = problemInWords({ slug, problem }, context);
      const labels = remedies.map(({ label }) => label);
      for (const words of [title, detail, ...labels]) assert.doesNotMatch(words, OF_THE_INTERFACE, slug);
      assert.ok(detail.length > 10, slug);
    }
  }
  for (const code of Object.keys(WARNINGS)) {
    assert.doesNotMatch(warningInWords({ code, detail: "refused (queries: 3 of 1200)" }), OF_THE_INTERFACE, code);
  }
  for (const reason of Object.values(REASONS)) assert.doesNotMatch(reason, OF_THE_INTERFACE, reason);
});

test("remedies set what the page has", () => {
  for (const slug of slugs) {
    const problem = { title: "", detail: "", minimum_alpha: 1.26e-9 };
    for (const { set = {}, act } of problemInWords({ slug, problem }, context).remedies) {
      assert.ok(act ?? Object.keys(set).every((name) => Object.hasOwn(DEFAULTS, name)), slug);
      if (set.alpha) assert.ok(set.alpha >= 1.26e-9);
    }
  }
});

test("a warning has its share of the points", () => {
  const detail = "not confirmed (queries: 24 of 6400)";
  assert.equal(
    warningInWords({ code: "disagrees_with_neighbours", detail }),
    "At 24 of 6,400 points nothing around confirms the curvature",
  );
  assert.equal(warningInWords({ code: "of a newer service", detail: "as it is" }), "as it is");
});

test("of many rows the first are named", () => {
  assert.equal(rowsInWords([7], "Repeated"), "Repeated: point 7.");
  assert.equal(rowsInWords([1, 2, 3, 4, 5000, 6, 7], "Repeated"), "Repeated: points 1, 2, 3, 4, 5,000 and 2 more.");
});
