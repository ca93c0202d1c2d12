// @ts-check
// Snippets run as they are copied: what the page shows, beside the files that it names, against the server.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { KEY_VARIABLE, LANGUAGES } from "../../page/model/leaving/snippets.js";
import { open, opened, settled, sphere, textOf } from "./browser.mjs";
import { ran, started } from "./running.mjs";

/**
 * Runs the snippets of the page in every language, and looks for numbers in their answers.
 *
 * @param {import("playwright-core").Page} page
 * @param {Record<string, string>} files
 * @param {{ n: number, variables?: Record<string, string> }} expected
 */
async function check(page, files, { n, variables }) {
  const button = page.locator("#needs button");
  if ((await button.count()) > 0) {
    const [saved] = await Promise.all([page.waitForEvent("download"), button.click()]);
    files = { ...files, [saved.suggestedFilename()]: readFileSync(await saved.path(), "latin1") };
  }
  const contents = Object.fromEntries(Object.entries(files).map(([name, text]) => [name, Buffer.from(text, "latin1")]));
  for (const [language, title] of Object.entries(LANGUAGES)) {
    await page.click(`#languages button:text-is("${title}")`);
    const { stdout, written } = ran(language, await textOf(page, "#code"), contents, variables);
    if (language === "curl") assert.equal(JSON.parse(written["curvatures.json"]).mean_curvatures.length, n);
    else assert.match(stdout, language === "python" ? /Curvatures/ : /\[[^\]]*\d/, title);
  }
}

/** @type {[string, number][]} */
const EXAMPLES = [
  ["ellipse", 64],
  ["fineHalf", 256],
  ["torus", 2000],
];
for (const [example, n] of EXAMPLES) {
  test(`snippets of the example ${example} run`, () =>
    opened(`#example=${example}&family=gauss&alpha=1e-6`, async (page) => {
      await settled(page);
      await check(page, {}, { n });
    }));
}

test("snippets of the first picture run", () =>
  opened("", async (page) => {
    await settled(page);
    await check(page, {}, { n: 12_000 });
  }));

test("snippets of a file run, also where the service does not read it", () =>
  opened("#example=ball", async (page) => {
    await settled(page);
    await open(page, "my scan.xyz", sphere(300));
    await check(page, {}, { n: 300 });
    const text = `ply\nformat ascii 1.0\nelement vertex 300\n${["x", "y", "z"].map((axis) => `property float ${axis}\n`).join("")}end_header\n${sphere(300)}\n`;
    await open(page, "it's.ply", text);
    await check(page, { "it's.ply": text }, { n: 300 });
  }));

test("snippets run with a key", async () => {
  const { address, stop } = await started(["--api-keys", "a-key-for-this-test"]);
  try {
    await opened(
      "#example=ellipse",
      async (page) => {
        await settled(page);
        await page.fill("#key", "a-key-for-this-test");
        await page.press("#key", "Enter");
        await page.waitForFunction(() => document.querySelector("#summary")?.textContent.includes("mean curvature"));
        assert.ok(!(await textOf(page, "body")).includes("a-key-for-this-test"));
        await check(page, {}, { n: 64, variables: { [KEY_VARIABLE]: "a-key-for-this-test" } });
      },
      { address, expected: ["401"] },
    );
  } finally {
    await stop();
  }
});
