// @ts-check
// The page in a real browser: pictures by their pixels, files, parameters, refusals, cancelling, sizes,
// rules.
//
// Asks the server at GRAMIAN_URL. Screenshots are left in target/page.

import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { before, test } from "node:test";

import { base, DESK, open, opened, PHONE, require, settled, sphere, textOf } from "./browser.mjs";
import { asked, HOSTILE } from "./running.mjs";

const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const pictures = "target/page";

before(() => mkdirSync(pictures, { recursive: true }));

/** Number of different colours in the picture, in a coarse raster. */
async function nColours(page, name) {
  await page.waitForTimeout(0);
  const png = await page.locator("#scene").screenshot({ path: `${pictures}/${name}.png` });
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes]));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    if (!context) throw new Error("no canvas");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const colours = new Set();
    for (let at = 0; at < data.length; at += 4)
      colours.add((data[at] >> 4) * 256 + (data[at + 1] >> 4) * 16 + (data[at + 2] >> 4));
    return colours.size;
  }, png.toString("base64"));
}

test("something beautiful shows before any click", () =>
  opened("", async (page) => {
    await settled(page);
    assert.ok(await page.evaluate(() => document.createElement("canvas").getContext("webgl2") !== null));
    assert.ok((await nColours(page, "first")) > 60);
    assert.match(await textOf(page, "#summary"), /^dragon: 12,000 points; mean curvature −/);
    await page.screenshot({ path: `${pictures}/page.png` });
  }));

for (const example of [
  "torus",
  "lattice",
  "sphere",
  "ball",
  "curve",
  "part",
  "triangle",
  "half",
  "fineHalf",
  "square",
  "corner",
  "ellipse",
  "noisy",
  "noisier",
]) {
  test(`the example ${example} renders`, () =>
    opened(`#example=${example}&section=2`, async (page) => {
      await settled(page);
      assert.ok((await nColours(page, example)) > 8);
      assert.ok(!(await page.isVisible("#refusal")), await textOf(page, "#refusal"));
    }));
}

test("a mesh shows with what its vertices rest on", () =>
  opened("#example=torus&operation=mesh&colour=support", async (page) => {
    await settled(page);
    assert.match(await textOf(page, "#summary"), /Euler characteristic 0 and 0 open edges/);
    assert.match(await textOf(page, "#support"), /observed/);
    assert.ok((await nColours(page, "mesh")) > 4);
  }));

test("a dropped file is read, and a parameter changes the answer", () =>
  opened("", async (page) => {
    await settled(page);
    const transfer = await page.evaluateHandle((text) => {
      const made = new DataTransfer();
      made.items.add(new File([text], "ball.xyz"));
      return made;
    }, sphere(300));
    await page.dispatchEvent("body", "drop", { dataTransfer: transfer });
    await page.waitForFunction(() => document.querySelector("#cloud")?.textContent.startsWith("ball.xyz: 300 points"));
    await settled(page);
    const first = await textOf(page, "#diagnostics");
    await page.click("text=Kernel and solver");
    await page.selectOption("[name=family]", "gauss");
    await page.fill("[name=lengthScale]", "0.7");
    await settled(page);
    await page.waitForFunction((before) => document.querySelector("#diagnostics")?.textContent !== before, first);
    // The link is written once the last change is a moment old.
    await page.waitForFunction(() => document.querySelector("#code")?.textContent.includes('"length_scale":0.7'));
    await page.waitForFunction(() => location.hash.includes("lengthScale=0.7"));
  }));

test("a refusal has a remedy, and a button that applies it", () =>
  opened(
    "#example=ellipse&family=laplace&surfaceModel=signature",
    async (page) => {
      await page.click("text=Choose the kernel automatically");
      await settled(page);
      await page.waitForFunction(() => document.querySelector("#summary")?.textContent.includes("mean curvature"));
      assert.ok(await page.isHidden("#refusal"));
      assert.equal(await page.inputValue("[name=family]"), "auto");
    },
    { expected: ["422"] },
  ));

test("a point tells its value and deviation, and its neighbours are reached by keys", () =>
  opened("#example=sphere", async (page) => {
    await settled(page);
    const box = await page.locator("#scene").boundingBox();
    assert.ok(box);
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    await page.waitForSelector("#pinned:visible");
    const first = await textOf(page, "#pinned strong");
    assert.match(await textOf(page, "#pinned"), /mean curvature.*±.*1\/L/);
    await page.keyboard.press("ArrowRight");
    assert.notEqual(await textOf(page, "#pinned strong"), first);
  }));

test("a computation is cancelled", () =>
  opened(
    "#example=million",
    async (page) => {
      await page.waitForRequest((request) => request.url().endsWith("/events"), { timeout: 120_000 });
      assert.ok((await nColours(page, "million")) > 8, "a million points are drawn while they are asked about");
      const ended = page.waitForRequest((request) => request.method() === "DELETE", { timeout: 60_000 });
      await page.click("#cancel");
      await ended;
      assert.ok(await page.isHidden("#progress"));
    },
    { expected: ["404", "409"] },
  ));

test("a link brings back what it was copied from", () =>
  opened("#example=ellipse&operation=normals&arrows=true&range=full", async (page) => {
    await settled(page);
    assert.equal(await page.inputValue("[name=operation]"), "normals");
    assert.ok(await page.isChecked("[name=arrows]"));
    await page.selectOption("[name=operation]", "curvatures");
    await settled(page);
    await page.goBack();
    await settled(page);
    assert.equal(await page.inputValue("[name=operation]"), "normals");
  }));

test("a mesh and a picture are saved", () =>
  opened("#example=sphere&operation=mesh", async (page) => {
    await settled(page);
    for (const [kind, start] of [
      ["png", "\x89PNG"],
      ["ply", "ply"],
      ["glb", "glTF"],
    ]) {
      const [saved] = await Promise.all([page.waitForEvent("download"), page.click(`[data-save=${kind}]`)]);
      const bytes = readFileSync(await saved.path());
      assert.equal(bytes.subarray(0, start.length).toString("latin1"), start);
    }
  }));

test("a hostile link and a hostile file put nothing into the snippets", () => {
  const [text] = HOSTILE;
  const link = new URLSearchParams({
    example: "ball",
    solver: text,
    surfaceModel: text,
    family: text,
    operation: text,
    duplicates: text,
  });
  return opened(`#${link}`, async (page) => {
    await settled(page);
    for (const name of ["solver", "surfaceModel", "family"])
      assert.equal(await page.inputValue(`[name=${name}]`), "auto");
    await open(
      page,
      `${text}.ply`,
      `ply\nformat ascii 1.0\nelement vertex 300\n${["x", "y", "z"].map((axis) => `property float ${axis}\n`).join("")}end_header\n${sphere(300)}\n`,
    );
    for (const [title, language] of [
      ["curl", "curl"],
      ["Python", "python"],
      ["TypeScript", "typescript"],
    ]) {
      await page.click(`#languages button:text-is("${title}")`);
      const found = asked(language, await textOf(page, "#code"), { [`${text}.ply`]: "the points" });
      const [place, expected] = { python: [found[1][1], `./${text}.ply`], curl: [found[0][2], `${base}v1/clouds`] }[
        language
      ] ?? [found[0][0], `${base}v1/clouds`];
      assert.equal(place, expected);
    }
  });
});

test("a table that can be read in two ways is refused with its line", () =>
  opened("#example=ball", async (page) => {
    await settled(page);
    const rows = "7,85081,-8,24886,39,98910\n8,1,2,3,4,5\n";
    await page.setInputFiles("#file", { name: "torn.csv", mimeType: "text/plain", buffer: Buffer.from(rows) });
    await page.waitForSelector("#refusal:visible");
    assert.match(await textOf(page, "#refusal"), /line 1: commas may be decimal marks here/);
  }));

/** @type {[string, { width: number, height: number }, "light" | "dark"][]} */
const VIEWS = [
  ["desk", DESK, "light"],
  ["phone", PHONE, "light"],
  ["dark", DESK, "dark"],
];

for (const [name, viewport, colorScheme] of VIEWS) {
  test(`axe finds nothing serious: ${name}`, () =>
    opened(
      "#example=sphere",
      async (page) => {
        await settled(page);
        // The policy forbids scripts of elsewhere; the debugger's are not in the page.
        const found = await page.evaluate(`${axe}; axe.run()`);
        const serious = found.violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
        assert.deepEqual(
          serious.map(({ id, nodes }) => [id, nodes[0].html]),
          [],
        );
        await page.screenshot({ path: `${pictures}/${name}.png`, fullPage: true });
        const isWide = await page.evaluate(() => document.documentElement.scrollWidth > window.innerWidth);
        assert.ok(!isWide, "the page is wider than the window");
      },
      { viewport, colorScheme },
    ));
}
