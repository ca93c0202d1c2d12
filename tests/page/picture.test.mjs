// @ts-check
// The picture's controls in a browser: each changes what is seen, and what is said of it.

import assert from "node:assert/strict";
import { test } from "node:test";

import { open, opened, settled, textOf } from "./browser.mjs";

/**
 * The picture as shares of three kinds of pixels: background, points and what is darker or lighter.
 *
 * @param {import("playwright-core").Page} page
 */
async function seen(page) {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  const png = await page.locator("#scene").screenshot();
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes]));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    if (!context) throw new Error("no canvas");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const colours = new Map();
    for (let at = 0; at < data.length; at += 4) {
      const key = `${data[at]} ${data[at + 1]} ${data[at + 2]}`;
      colours.set(key, (colours.get(key) ?? 0) + 1);
    }
    const most = Math.max(...colours.values());
    return { covered: 1 - most / (data.length / 4), nColours: colours.size };
  }, png.toString("base64"));
}

/** Opens the page with settings beside those of a sphere, and looks at the picture. */
async function pictureOf(settings) {
  let found = { covered: 0, nColours: 0 };
  await opened(`#example=ball&operation=normals&std=false&${settings}`, async (page) => {
    await settled(page);
    found = await seen(page);
  });
  return found;
}

test("dots cover a sphere without holes, and their size can be chosen", async () => {
  const [usual, small] = [await pictureOf(""), await pictureOf("dots=0.3")];
  // A third of the pixels, with the buttons over them, or spots of 0.3² of the disc.
  assert.ok(usual.covered > 0.28 && usual.covered > 1.5 * small.covered, `${usual.covered} ${small.covered}`);
});

test("what is cut away is not drawn", async () => {
  const [whole, half] = [await pictureOf(""), await pictureOf("cut=x&cutAt=0.5&away=true")];
  const share = half.covered / whole.covered;
  assert.ok(share > 0.2 && share < 0.7, `${share}`);
});

test("a unit stands wherever L stood", () =>
  opened("#example=torus&unit=mm", async (page) => {
    await settled(page);
    assert.match(await textOf(page, "#title"), /1\/mm$/);
    assert.match(await textOf(page, "#summary"), /1\/mm/);
    assert.match(await textOf(page, "#scale"), / mm$/);
    assert.ok(await page.isHidden("#unitOfLength"));
    await page.focus("#scene");
    await page.keyboard.press("Enter");
    assert.match(await textOf(page, "#pinned"), /radius [\d.]+ ± [\d.e−]+ mm/);
    assert.doesNotMatch(await textOf(page, "aside"), /\b1\/L|\d L\b/);
  }));

test("two points are measured with all digits", () =>
  opened("#example=sphere", async (page) => {
    await settled(page);
    await page.click("#measure");
    await page.focus("#scene");
    await page.keyboard.press("Enter");
    assert.equal(await textOf(page, "#measured"), "Click a second point.");
    const box = await page.locator("#scene").boundingBox();
    assert.ok(box);
    await page.mouse.click(box.x + box.width / 2 + 60, box.y + box.height / 2 + 40);
    const rows = await textOf(page, "#measured");
    const [, distance, x, y, z] =
      rows.match(/distance([\d.]+) Lalong x(−?[\d.e−]+) Lalong y(−?[\d.e−]+) Lalong z(−?[\d.e−]+) L/) ?? [];
    const length = Math.hypot(...[x, y, z].map((text) => Number(text.replaceAll("−", "-"))));
    assert.ok(length > 0.1);
    assert.equal(Number(distance), length);
    assert.ok(distance.length > 12, distance);
  }));

test("a scan's own colours are shown, and its columns are logarithmic where they are positive", () =>
  opened("#example=ball&operation=normals&std=false", async (page) => {
    await settled(page);
    const rows = Array.from({ length: 400 }, (_, at) => {
      const [z, angle] = [1 - (2 * at + 1) / 400, at * 2.4];
      const across = Math.sqrt(1 - z * z);
      return [across * Math.cos(angle), across * Math.sin(angle), z, 255, at % 256, 0, 10 ** (at % 5)].join(",");
    });
    await open(page, "scan.csv", `x,y,z,red,green,blue,intensity\n${rows.join("\n")}`);
    await page.selectOption("[name=quantity]", "colours");
    assert.equal(await textOf(page, "#title"), "colours of the file");
    assert.ok(await page.isDisabled("[name=logarithmic]"));
    await page.selectOption("[name=quantity]", "given.intensity");
    await page.check("[name=logarithmic]");
    assert.equal(await page.inputValue("[name=low]"), "1");
    assert.equal(await page.inputValue("[name=high]"), "10000");
  }));

test("terrain has z up, and other clouds y", () =>
  opened("#example=ball&operation=normals&std=false", async (page) => {
    await settled(page);
    const ground = Array.from({ length: 900 }, (_, at) =>
      [at % 30, Math.floor(at / 30), 0.3 * Math.sin(at % 30)].join(" "),
    );
    await open(page, "ground.xyz", ground.join("\n"));
    assert.ok((await seen(page)).covered > 0.02);
    await page.evaluate(() =>
      document.querySelectorAll("details").forEach((part) => {
        part.open = true;
      }),
    );
    await page.check("[name=frame]");
    assert.deepEqual(await page.locator("#labels span").allTextContents(), ["x: 29 L", "y: 29 L", "z: 0.5972 L"]);
  }));

test("a section has no stairs: lines stay as thin when the view comes near", () =>
  opened(
    "#example=noisy&operation=normals&std=false&surfaceModel=signature&section=2&family=gauss&lengthScale=1",
    async (page) => {
      await settled(page);
      await page.waitForLoadState("networkidle");
      const far = await seen(page);
      const box = await page.locator("#scene").boundingBox();
      assert.ok(box);
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      for (let turn = 0; turn < 5; turn++) await page.mouse.wheel(0, -400);
      const near = await seen(page);
      assert.ok(far.nColours > 100 && near.nColours > 20, `${far.nColours} ${near.nColours}`);
    },
  ));
