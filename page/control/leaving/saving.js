// @ts-check
// Pictures and files that leave the page.

import { OPERATIONS, requestOf } from "../../model/operations.js";
import { download } from "../../model/service.js";
import { element } from "../../view/readout.js";
import { all, at } from "../elements.js";
import { page, scene } from "../page.js";
import { idOf, repeated } from "../registered.js";
import { refuse } from "../../words/refusal.js";

/** @type {Record<string, string>} */
const SAVED = { ply: "model/ply", glb: "model/gltf-binary" };

for (const button of all("[data-save]")) {
  button.addEventListener("click", () => save(button.dataset.save ?? "").catch(refuse));
}

/** @param {string} kind */
async function save(kind) {
  const { cloud, settings } = page;
  if (!cloud) return;
  if (kind === "png" || kind === "plain") return offer(await pictureOf(kind === "png"), `${cloud.name}.png`);
  const file = await repeated(async () => {
    const body = { cloud: { id: await idOf(cloud) }, ...requestOf(settings) };
    const asked = { mediaType: SAVED[kind], nPoints: cloud.points.rows };
    return download(OPERATIONS[settings.operation].path, body, asked);
  });
  return offer(file, `${cloud.name.replace(/\.[^.]*$/, "")}.${kind}`);
}

export function offer(blob, name) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name.replace(/^.*[/\\]/, "") });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The scene as a picture, with the histogram and its title below if wanted. */
async function pictureOf(hasLegend) {
  scene.render();
  const [view, legend] = [at("scene"), at("histogram")];
  const height = hasLegend ? legend.height + 24 * window.devicePixelRatio : 0;
  const canvas = element("canvas", { width: view.width, height: view.height + height });
  const context = canvas.getContext("2d");
  if (!context) throw new Error("this browser draws no pictures");
  const styles = getComputedStyle(document.body);
  context.fillStyle = styles.backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(view, 0, 0);
  if (hasLegend) {
    context.fillStyle = styles.color;
    context.font = `${14 * window.devicePixelRatio}px system-ui, sans-serif`;
    context.fillText(at("title").textContent, 12, view.height + 18 * window.devicePixelRatio);
    context.drawImage(legend, 0, view.height + 24 * window.devicePixelRatio);
  }
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}
