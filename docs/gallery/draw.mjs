// @ts-check
// Draws the figures of the paper: opens each scene on the page of the server at GRAMIAN_URL, saves its
// picture beside this file, and writes docs/gallery.md with links to the scenes. Then draws the pictures of
// docs/page.md. With the argument `page` it draws those alone.

import { writeFileSync } from "node:fs";
import { createRequire } from "node:module";

const require = createRequire(`${process.cwd()}/target/sdk/node_modules/`);
const { chromium } = require("playwright-core");

const base = `${process.env.GRAMIAN_URL}/`;

const LAPLACE = (epsilon) => `family=laplace&lengthScale=1&epsilon=${epsilon}`;
const GAUSS = "family=gauss&lengthScale=1";
const PLANE = "operation=normals&std=false&surfaceModel=signature&section=2&arrows=true";

const SCENES = [
  ["curve", `example=curve&${PLANE}&${LAPLACE(1)}`, "A closed curve from 64 of its points. Laplace's kernel, ε = 1."],
  [
    "part",
    `example=part&${PLANE}&${LAPLACE(1)}`,
    "The same from 24 points of a part. Inside and outside cannot be told, and the gradient vanishes at the inflection point.",
  ],
  [
    "triangle-gauss",
    `example=triangle&${PLANE}&${GAUSS}`,
    "A triangle from 48 points. Gauss' kernel cuts it into smooth pieces.",
  ],
  [
    "triangle-laplace",
    `example=triangle&${PLANE}&${LAPLACE(1e-5)}`,
    "The same with Laplace's kernel, ε = 1e-5, which takes corners.",
  ],
  ["half-16", `example=half&${PLANE}&${GAUSS}`, "Half an ellipse, 16 points: the level set continues the curve."],
  ["half-256", `example=fineHalf&${PLANE}&${GAUSS}`, "Half an ellipse, 256 points."],
  ["square", `example=square&${PLANE}&${GAUSS}`, "A square."],
  ["corner", `example=corner&${PLANE}&${GAUSS}`, "The same square without a corner."],
  [
    "noisy-gauss",
    `example=noisy&${PLANE}&${GAUSS}&alpha=0.1`,
    "An ellipse from 32 points that were moved by up to 0.1, α = 0.1. Gauss' kernel. Yellow: the exact ellipse.",
  ],
  ["noisy-laplace", `example=noisy&${PLANE}&${LAPLACE(1e-5)}&alpha=0.1`, "The same with Laplace's kernel, ε = 1e-5."],
  ["noisy-smooth", `example=noisy&${PLANE}&${LAPLACE(1)}&alpha=0.1`, "The same with ε = 1."],
  ["noisier", `example=noisier&${PLANE}&${LAPLACE(1)}&alpha=0.1`, "Points that were moved by up to 0.25, ε = 1."],
  ["torus-random", "example=torus", "Mean curvatures on a torus, 2,000 random points."],
  ["torus-lattice", "example=lattice", "The same on 1,500 points of a lattice."],
  ["sphere", "example=ball&surfaceModel=signature&std=false", "Mean curvatures on a sphere, 600 points; they are 1."],
];

const GRAPHICS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

/**
 * Pictures of the page by name: the scene, the size of the window, and the colours.
 *
 * @type {[string, string, { width: number, height: number }, "light" | "dark"][]}
 */
const PAGES = [
  ["page", "", { width: 1400, height: 800 }, "light"],
  ["page-dark", "", { width: 1400, height: 800 }, "dark"],
  ["page-phone", "", { width: 390, height: 844 }, "light"],
  ["page-million", "example=million&std=true", { width: 1400, height: 800 }, "light"],
];

/** Time for a million points on a slow machine, in milliseconds. */
const PATIENCE = 600_000;

const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", ...GRAPHICS] });

/**
 * Opens a scene, and waits until it has been drawn.
 *
 * @param {string} name
 * @param {string} hash
 * @param {import("playwright-core").BrowserContextOptions} options
 * @param {(page: import("playwright-core").Page) => Promise<unknown>} draw
 */
async function drawn(name, hash, options, draw) {
  const page = await browser.newPage(options);
  await page.goto(`${base}#${hash}`);
  await page.waitForSelector("body[data-state=settled]", { timeout: PATIENCE });
  await page.waitForLoadState("networkidle");
  await page.waitForTimeout(1000);
  if (await page.isVisible("#refusal")) throw new Error(`${name}: ${await page.textContent("#refusal")}`);
  await draw(page);
  await page.close();
  console.log(name);
}

const areAll = process.argv[2] !== "page";
for (const [name, hash] of areAll ? SCENES : []) {
  await drawn(name, hash, { viewport: { width: 1200, height: 640 } }, (page) =>
    page.locator("#scene").screenshot({ path: `docs/gallery/${name}.png` }),
  );
}
for (const [name, hash, viewport, colorScheme] of PAGES) {
  await drawn(name, hash, { viewport, colorScheme }, (page) => page.screenshot({ path: `docs/${name}.png` }));
}
await browser.close();

const rows = SCENES.map(
  ([name, hash, text]) => `## ${text}\n\n[![${text}](gallery/${name}.png)](http://localhost:8080/#${hash})\n`,
);
writeFileSync(
  "docs/gallery.md",
  `# Gallery

The figures of Guidotti's paper, drawn by the service and its page. Each picture leads to the same scene on the page of a server at
localhost:8080. Dots are the data, green shades the level regions of u, and the red line is its level on the surface: the mean of u over the
data. Lines from the dots are normals.

\`docs/gallery/draw target/release/gramian\` draws all of them again.

${rows.join("\n")}`,
);
