// @ts-check
// What is seen leaves the page in files; phones show all of it; every control has an effect or says why not.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { read } from "../../page/model/files.js";
import { distinctNames } from "../../page/model/leaving/export.js";
import { open, opened, PHONE, settled, sphere, textOf } from "./browser.mjs";

/** Clicks a button that saves a file, and reads that. */
async function saved(page, kind) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(`[data-save=${kind}]`)]);
  return read(new Uint8Array(readFileSync(await download.path())), download.suggestedFilename());
}

/** The colours of points, red, green and blue of each. */
const coloursOf = ({ values }) => ["red", "green", "blue"].map((name) => values.get(name) ?? []);

test("what is seen is saved with its colours and the columns of the file", () =>
  opened("#example=ball", async (page) => {
    await settled(page);
    const rows = sphere(300).split("\n");
    const lines = rows.map((row, at) => [...row.split(" "), at, 300 - at].join(","));
    await open(page, "mine.csv", ["x,y,z,height above sea,red", ...lines].join("\n"));
    for (const kind of ["ply", "csv"]) {
      const cloud = await saved(page, kind);
      assert.deepEqual(
        [...cloud.points.data],
        rows.flatMap((row) => row.split(" ").map(Number)),
      );
      assert.equal(cloud.normals?.rows, 300);
      assert.equal(cloud.values.get("height_above_sea")?.[7], 7);
      assert.equal(cloud.values.get("file_red")?.[7], 293);
      assert.ok(Math.abs(cloud.values.get("mean_curvature")?.[7] ?? 0) > 0.5);
      assert.ok((cloud.values.get("mean_curvature_std")?.[7] ?? 0) > 0);
      const [red, green, blue] = coloursOf(cloud);
      assert.equal(red.length, 300);
      assert.ok(new Set([...red].map((_, at) => `${red[at]} ${green[at]} ${blue[at]}`)).size > 3);
    }
    // By height: the first points have the lowest colour, the last the highest.
    await page.selectOption("[name=quantity]", "given.height above sea");
    const [red, , blue] = coloursOf(await saved(page, "ply"));
    assert.ok(blue[0] > red[0] && red[299] > blue[299]);
  }));

test("a mesh is saved with its triangles", () =>
  opened("#example=sphere&operation=mesh", async (page) => {
    await settled(page);
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("[data-save=ply]")]);
    const text = readFileSync(await download.path(), "latin1");
    assert.match(text, /element face [1-9]\d+\nproperty list uchar int vertex_indices\nend_header/);
  }));

test("names of columns are words, each once", () => {
  const names = ["a b", "a_b", "Red", "größe", ""].map((name) => ({ name, values: [] }));
  assert.deepEqual(distinctNames(names), ["a_b", "a_b_2", "file_Red", "gr__e", "column"]);
});

test("a phone shows the picture with its legend and the tapped point", () =>
  opened(
    "#example=ball",
    async (page) => {
      await settled(page);
      const boxOf = async (selector) => {
        const box = await page.locator(selector).boundingBox();
        assert.ok(box, selector);
        return { ...box, right: box.x + box.width, bottom: box.y + box.height };
      };
      const [stage, legend] = [await boxOf("#stage"), await boxOf("figure")];
      assert.ok(stage.width > 380 && legend.width > 350, "both are as wide as the phone");
      assert.ok(legend.y >= stage.bottom - 1 && legend.y < stage.bottom + 24, "the legend is below the picture");
      assert.ok(legend.bottom <= PHONE.height, `legend ends at ${legend.bottom}`);
      await page.touchscreen.tap(stage.x + stage.width / 2, stage.y + stage.height / 3);
      await page.waitForSelector("#pinned:visible");
      const pinned = await boxOf("#pinned");
      assert.ok(pinned.y > stage.y && pinned.bottom <= stage.bottom + 1, "the point is over the picture");
      await page.screenshot({ path: "target/page/phone-point.png" });
      const wide = await page.evaluate(() =>
        [...document.querySelectorAll("body *")]
          .filter((element) => element.checkVisibility() && !element.closest("#labels, pre"))
          .filter((element) => element.getBoundingClientRect().right > window.innerWidth + 0.5)
          .map((element) => element.outerHTML.slice(0, 80)),
      );
      assert.deepEqual(wide, []);
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
    },
    { viewport: PHONE, hasTouch: true },
  ));

test("controls without an effect say why", () =>
  opened(
    "#example=ball",
    async (page) => {
      await settled(page);
      await page.click("text=Kernel and solver");
      const state = async (name) => {
        const field = page.locator(`[name=${name}]`);
        return (await field.isEnabled()) || (await page.locator("label", { has: field }).getAttribute("title"));
      };
      assert.equal(await state("epsilon"), "Only Laplace's kernel has ε.");
      assert.equal(await state("duplicates"), "No two points are equal.");
      assert.equal(await state("suppress"), true);
      await page.selectOption("[name=family]", "laplace");
      await settled(page);
      assert.equal(await state("epsilon"), true);
      await page.selectOption("[name=family]", "auto");
      await settled(page);
      await page.selectOption("[name=operation]", "normals");
      await settled(page);
      assert.match(String(await state("directions")), /principal directions/);
      await page.fill("[name=lengthScale]", "0.7");
      await settled(page);
      assert.equal(await page.inputValue("[name=family]"), "gauss");
    },
    // Laplace's kernel without ε has no curvatures.
    { expected: ["422"] },
  ));

test("principal directions of the first picture are asked for", () =>
  opened("", async (page) => {
    await settled(page);
    assert.match(await textOf(page, "#diagnostics"), /computed when the page was made/);
    await page.check("[name=directions]");
    await page.waitForFunction(() =>
      document.querySelector("#quantity, [name=quantity]")?.textContent?.includes("principal"),
    );
    assert.ok(await page.isChecked("[name=directions]"));
  }));
