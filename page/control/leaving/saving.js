// @ts-check
// Pictures and files that leave the page.

import { csvOf, plyOf, vectors } from "../../model/leaving/export.js";
import { OPERATIONS, requestOf } from "../../model/operations.js";
import { download } from "../../model/service.js";
import { inTurns } from "../../model/turns.js";
import { rgb, shareOf, SUPPORT, textureOf } from "../../view/colours.js";
import { element } from "../../view/readout.js";
import { all, at } from "../elements.js";
import { page, scene } from "../page.js";
import { chosen, rangeNow } from "../range.js";
import { idOf, repeated } from "../registered.js";
import { refuse } from "../../words/refusal.js";

/** @import { Answer, Cloud, Column, Quantity } from "../../types.d.ts" */

/** Colour of points whose value is not known, as in the picture. */
const PLAIN = [140, 153, 173];

for (const button of all("[data-save]")) {
  button.addEventListener("click", () => save(button.dataset.save ?? "").catch(refuse));
}

/** @param {string} kind */
async function save(kind) {
  const { cloud } = page;
  if (!cloud) return;
  const stem = cloud.name.replace(/\.[^.]*$/, "");
  if (kind === "png" || kind === "plain") return offer(await pictureOf(kind === "png"), `${cloud.name}.png`);
  return offer(kind === "glb" ? await glb(cloud) : await tableOf(cloud, kind), `${stem}.${kind}`);
}

/** The mesh in a file of the service. @param {Cloud} cloud */
function glb(cloud) {
  return repeated(async () => {
    const body = { cloud: { id: await idOf(cloud) }, ...requestOf(page.settings) };
    const asked = { mediaType: "model/gltf-binary", nPoints: cloud.points.rows };
    return download(OPERATIONS[page.settings.operation].path, body, asked);
  });
}

/**
 * Points or vertices with their colours on screen, all quantities of the answer, and the columns of the file.
 *
 * @param {Cloud} cloud
 * @param {string} kind
 */
async function tableOf(cloud, kind) {
  /** @type {Answer["tensors"]} */
  const tensors = page.answer?.tensors ?? {};
  const { vertices, cells } = tensors;
  const normals = tensors.normals ?? cloud.normals;
  const points = vertices ?? cloud.points;
  const quantity = chosen();
  /** @type {Column[]} */
  const columns = normals ? vectors(["nx", "ny", "nz"], normals) : [];
  // MeshLab colours by the property of this name.
  if (quantity && !quantity.channels) columns.push({ name: "quality", values: quantity.values });
  for (const { id, values } of page.quantities) {
    if (id !== "colours" && !id.startsWith("given.")) columns.push({ name: nameOf(id), values });
  }
  if (!vertices) for (const [name, values] of cloud.values) columns.push({ name, values });
  const table = { points, columns, colours: await coloursOf(points.rows, quantity) };
  return kind === "ply" ? plyOf({ ...table, cells }) : csvOf(table);
}

/** The name of a quantity in files, in the singular: principal_curvature_0. */
function nameOf(id) {
  return id.replace(/s(?=\.|$)/, "").replace(".", "_");
}

/**
 * Red, green and blue of each point, as on screen but without light.
 *
 * @param {number} n
 * @param {Quantity | undefined} quantity
 */
async function coloursOf(n, quantity) {
  const colours = new Uint8Array(3 * n);
  const support = page.settings.colour === "support" ? page.answer?.fields.support : undefined;
  const range = rangeNow(quantity);
  const { data, width, height } = textureOf(range);
  const { values, deviations } = quantity ?? {};
  await inTurns(n, (from, to) => {
    for (let row = from; row < to; row++) {
      if (support) colours.set(bytesOf(SUPPORT[support[row]]), 3 * row);
      else if (quantity?.channels) for (let of = 0; of < 3; of++) colours[3 * row + of] = quantity.channels[of][row];
      else {
        const share = values ? shareOf(values[row], range) : NaN;
        const off = range.full > 0 ? (deviations?.[row] ?? 0) / range.full : 0;
        const level = Math.min(Math.floor(Math.min(off, 1) * height), height - 1);
        const at = 4 * (level * width + Math.round(Math.min(Math.max(share, 0), 1) * (width - 1)));
        if (Number.isNaN(share)) colours.set(PLAIN, 3 * row);
        else for (let of = 0; of < 3; of++) colours[3 * row + of] = data[(Number.isNaN(at) ? 0 : at) + of];
      }
    }
  });
  return colours;
}

function bytesOf(hex) {
  return rgb(hex).map((channel) => Math.round(255 * channel));
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
