// @ts-check
// The way of somebody who brings a scan to the page and has read docs/page.md alone: each control is found by
// a name that the document has.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { opened, settled, sphere, textOf } from "./browser.mjs";

const DOCUMENT = readFileSync("docs/page.md", "utf8");

/** A name that the document has, as it is on the page. */
function documented(name) {
  assert.ok(DOCUMENT.includes(name), `docs/page.md does not name ${name}`);
  return name;
}

/** A file with a column of its own. */
const SCAN = sphere(900)
  .split("\n")
  .map((row, at) => `${row} ${at % 7}`);

test("from a file to numbers, pictures and a link", () =>
  opened("", async (page) => {
    const control = (name) => page.getByLabel(documented(name), { exact: false }).first();
    const press = (name) => page.getByRole("button", { name: documented(name), exact: true }).click();
    const saved = async (name) => {
      const [download] = await Promise.all([page.waitForEvent("download"), press(name)]);
      return readFileSync(await download.path(), "latin1");
    };
    await settled(page);
    const buffer = Buffer.from(`x y z age\n${SCAN.join("\n")}`);
    await page.setInputFiles("#file", { name: "scan.xyz", mimeType: "text/plain", buffer });
    await page.waitForFunction(() => document.querySelector("#cloud")?.textContent.includes("scan.xyz: 900 points"));
    await settled(page);
    assert.match(await textOf(page, "#title"), /mean curvature/);

    await control("Colour by").selectOption("given.age");
    assert.match(await textOf(page, "#title"), /age/);
    await control("Colour by").selectOption("mean_curvatures");
    for (const part of ["Dots and light", "Cut away", "Axes and unit"])
      await page.getByText(part, { exact: true }).click();
    await control("Unit of length").fill("mm");
    await control("Unit of length").press("Tab");
    await control("Box with its lengths").check();
    assert.match(await textOf(page, "#title"), /1\/mm/);

    await press("Measure");
    await page.focus("#scene");
    await page.keyboard.press("Enter");
    assert.match(await textOf(page, "#measured"), /second point/);
    await press("Measure");

    assert.ok((await saved("Picture")).startsWith("\x89PNG"));
    assert.match(await saved("PLY with colours"), /^ply[\s\S]*property \w+ quality/);
    assert.match(await saved("CSV"), /^x,y,z,[^\n]*age/);
    assert.match(page.url(), /fileName=scan\.xyz/);
  }));
