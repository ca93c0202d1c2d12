// @ts-check
// The page in Debian's Chromium, from the server at GRAMIAN_URL.

import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { after, before } from "node:test";

export const require = createRequire(`${process.cwd()}/target/sdk/node_modules/`);
const { chromium } = require("playwright-core");

export const base = `${process.env.GRAMIAN_URL}/`;

/** Without these, there is no WebGL where there is no graphics processor. */
const GRAPHICS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

export const DESK = { width: 1400, height: 900 };
export const PHONE = { width: 390, height: 844 };

let browser;

before(async () => {
  browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", ...GRAPHICS] });
});
after(() => browser.close());

/**
 * Opens the page and calls `use`. Nothing may be logged as an error, asked of others, or against the
 * policy.
 *
 * @param {string} hash
 * @param {(page: import("playwright-core").Page) => Promise<void>} use
 * @param {import("playwright-core").BrowserContextOptions & {
 *   expected?: string[],
 *   address?: string,
 * }} options
 */
export async function opened(hash, use, { viewport = DESK, expected = [], address = base, ...options } = {}) {
  const context = await browser.newContext({ viewport, ...options });
  const page = await context.newPage();
  const wrong = [];
  page.on("console", (message) => {
    const text = message.text();
    // Warnings of the software renderer are about itself.
    if (message.type() === "error" && !expected.some((part) => text.includes(part))) wrong.push(text);
  });
  page.on("pageerror", (error) => wrong.push(error.stack));
  page.on("request", (request) => {
    if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url()))
      wrong.push(`asked ${request.url()}`);
  });
  try {
    await page.goto(address + hash);
    await use(page);
    assert.deepEqual(wrong, []);
  } finally {
    await context.close();
  }
}

export function settled(page) {
  return page.waitForSelector("body[data-state=settled]", { timeout: 120_000 });
}

/**
 * @param {import("playwright-core").Page} page
 * @param {string} selector
 */
export async function textOf(page, selector) {
  return (await page.textContent(selector)) ?? "";
}

/** A sphere as an XYZ file. */
export function sphere(n) {
  const rows = Array.from({ length: n }, (_, at) => {
    const z = 1 - (2 * at + 1) / n;
    const angle = at * Math.PI * (3 - Math.sqrt(5));
    return [Math.sqrt(1 - z * z) * Math.cos(angle), Math.sqrt(1 - z * z) * Math.sin(angle), z].join(" ");
  });
  return rows.join("\n");
}

export async function open(page, name, text) {
  await page.setInputFiles("#file", { name, mimeType: "text/plain", buffer: Buffer.from(text) });
  await page.waitForFunction((wanted) => document.querySelector("#cloud")?.textContent.startsWith(wanted), name);
  await settled(page);
}
