// @ts-check
// What stands in the way, and how the page goes on: links to files, lost servers, keys, rows without numbers,
// repeated points, steps back.

import assert from "node:assert/strict";
import { test } from "node:test";

import { opened, settled, sphere, textOf } from "./browser.mjs";
import { started } from "./running.mjs";

/** What the service lets browsers log. */
const STATUSES = [
  "401",
  "404",
  "422",
  "ERR_CONNECTION_REFUSED",
  "ERR_EMPTY_RESPONSE",
  "ERR_CONNECTION_RESET",
  "ERR_ABORTED",
];

/**
 * Waits until the page says something.
 *
 * @param {import("playwright-core").Page} page
 * @param {string} selector
 * @param {string} part
 */
function said(page, selector, part) {
  return page.waitForFunction(
    ([where, what]) => document.querySelector(where)?.textContent.includes(what),
    [selector, part],
    { timeout: 60_000 },
  );
}

/** Chooses a file without waiting for what follows. */
function choose(page, name, text) {
  return page.setInputFiles("#file", { name, mimeType: "text/plain", buffer: Buffer.from(text) });
}

test("a link to a file says which one it needs", () =>
  opened("#example=&fileName=scan.xyz&operation=normals", async (page) => {
    await page.waitForSelector("#refusal:visible");
    assert.match(await textOf(page, "#refusal"), /This link shows scan\.xyz/);
    const [chooser] = await Promise.all([page.waitForEvent("filechooser"), page.click("text=Open scan.xyz")]);
    await chooser.setFiles({ name: "scan.xyz", mimeType: "text/plain", buffer: Buffer.from(sphere(300)) });
    await said(page, "#cloud", "scan.xyz: 300 points");
    await settled(page);
    assert.equal(await page.inputValue("[name=operation]"), "normals");
    assert.ok(await page.isHidden("#refusal"));
    assert.match(page.url(), /fileName=scan\.xyz/);
  }));

test("steps back undo every choice, and bring a file back", () =>
  opened("#example=ball", async (page) => {
    await settled(page);
    await page.click("text=Kernel and solver");
    let asked = 0;
    page.on("request", (request) => {
      if (request.method() === "POST") asked++;
    });
    const choices = [
      ["family", "auto", "gauss"],
      ["solver", "auto", "dense"],
      ["surfaceModel", "auto", "signature"],
      ["quantity", "mean_curvatures", "principal_curvatures.1"],
      ["operation", "curvatures", "normals"],
    ];
    for (const [name, , word] of choices) {
      await page.selectOption(`[name=${name}]`, word);
      await settled(page);
    }
    const before = asked;
    for (const [name, earlier, word] of choices.reverse()) {
      assert.equal(await page.inputValue(`[name=${name}]`), word);
      await page.goBack();
      await settled(page);
      assert.equal(await page.inputValue(`[name=${name}]`), earlier);
    }
    assert.equal(asked, before, "answers that were there are shown again");
    await choose(page, "mine.xyz", sphere(200));
    await said(page, "#cloud", "mine.xyz: 200 points");
    await settled(page);
    await page.goBack();
    await said(page, "#cloud", "sphere: 600 points");
    await page.goForward();
    await said(page, "#cloud", "mine.xyz: 200 points");
    await settled(page);
  }));

test("a movement of a slider is one step back", () =>
  opened("#example=ball", async (page) => {
    await settled(page);
    const steps = await page.evaluate(() => history.length);
    await page.locator("[name=hide]").focus();
    for (const key of ["ArrowLeft", "ArrowLeft", "ArrowLeft"]) await page.keyboard.press(key);
    await page.waitForFunction(() => location.hash.includes("hide=0.97"));
    const after = await page.evaluate(() => history.length);
    assert.ok(after > steps && after <= steps + 3);
    await page.locator("[name=hide]").evaluate((field) => {
      for (const value of ["0.5", "0.4", "0.3"]) {
        /** @type {HTMLInputElement} */ (field).value = value;
        field.dispatchEvent(new Event("input", { bubbles: true }));
      }
      field.dispatchEvent(new Event("change", { bubbles: true }));
    });
    await page.waitForFunction(() => location.hash.includes("hide=0.3"));
    assert.equal(await page.evaluate(() => history.length), after + 1);
  }));

test("a lost server is waited for", async () => {
  const first = await started([]);
  const port = Number(new URL(first.address).port);
  let server = first;
  try {
    await opened(
      "#example=ball",
      async (page) => {
        await settled(page);
        await first.stop();
        await page.selectOption("[name=operation]", "normals");
        await said(page, "#refusal", "The service does not answer");
        server = await started([], port);
        await said(page, "#summary", "gradient of u");
        assert.ok(await page.isHidden("#refusal"));
      },
      { address: first.address, expected: STATUSES },
    );
  } finally {
    await server.stop();
  }
});

test("a missing key opens its field, and the question is asked again", async () => {
  const { address, stop } = await started(["--api-keys", "a-key-for-this-test"]);
  try {
    await opened(
      "#example=ball",
      async (page) => {
        await said(page, "#refusal", "The service needs a key");
        assert.equal(await page.evaluate(() => document.activeElement?.id), "key");
        await page.keyboard.type("another");
        await page.keyboard.press("Enter");
        await said(page, "#keyHint", "does not take this key");
        await page.fill("#key", "a-key-for-this-test");
        await page.keyboard.press("Enter");
        await said(page, "#summary", "mean curvature");
        assert.ok(await page.isHidden("#refusal"));
      },
      { address, expected: STATUSES },
    );
  } finally {
    await stop();
  }
});

test("rows without numbers and columns of text are left out if that is wanted", () =>
  opened("#example=ball", async (page) => {
    await settled(page);
    const rows = sphere(300).split("\n");
    const table = rows.map((row, at) => {
      const cells = row.split(" ");
      if (at === 17 || at === 40) cells[0] = "broken";
      return [...cells, at % 2 ? "stone" : "moss", at].join(";");
    });
    await choose(page, "survey.csv", ["x;y;z;material;height", ...table].join("\n"));
    await said(page, "#refusal", "Not all of survey.csv is numbers");
    const text = await textOf(page, "#refusal");
    assert.match(text, /The column material is text/);
    assert.match(text, /2 of 300 points have no position \(.*points 17, 40/);
    await page.click("text=Leave them out and go on");
    await said(page, "#cloud", "survey.csv: 298 points");
    await settled(page);
    assert.match(await textOf(page, "#cloud"), /2 rows.*left out.*with height/);
    assert.ok(await page.isHidden("#refusal"));
  }));

test("repeated points are named, and dropped or merged", () =>
  opened(
    "#example=ball&surfaceModel=signature&std=false&family=gauss&lengthScale=0.5&alpha=0",
    async (page) => {
      await settled(page);
      const rows = sphere(200).split("\n");
      const text = [...rows, rows[3], rows[5]].join("\n");
      await choose(page, "twice.xyz", text);
      await said(page, "#cleaning", "2 of 202 points repeat earlier ones");
      assert.match(await textOf(page, "#cleaning"), /points 200, 201\./);
      await settled(page);
      await page.click("#cleaning >> text=Drop them");
      await said(page, "#cloud", "twice.xyz: 200 points");
      await settled(page);
      assert.ok(await page.isHidden("#cleaning"));
      await choose(page, "twice.xyz", text);
      await said(page, "#cloud", "twice.xyz: 202 points");
      await page.click("#cleaning >> text=Merge them");
      await settled(page);
      assert.equal(await page.inputValue("[name=duplicates]"), "merge");
    },
    { expected: STATUSES },
  ));
