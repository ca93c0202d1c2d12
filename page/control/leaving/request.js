// @ts-check
// The request as code in each language, ready to be copied.

import { cloudFile } from "../../model/leaving/export.js";
import { requestOf } from "../../model/operations.js";
import { savedKey } from "../../model/service.js";
import { KEY_VARIABLE, LANGUAGES, snippet, sourceOf } from "../../model/leaving/snippets.js";
import { toHash } from "../../model/state.js";
import { element } from "../../view/readout.js";
import { at } from "../elements.js";
import { page } from "../page.js";
import { offer } from "./saving.js";

/** @import { Cloud, Source } from "../../types.d.ts" */

/** @param {Record<string, any>} request */
export function showRequest(request) {
  const { settings, cloud } = page;
  if (!cloud) return;
  const address = new URL(".", document.baseURI).href;
  const source = sourceOf(cloud, settings.example === "");
  const hasKey = savedKey() !== "";
  at("code").textContent = snippet(page.language, {
    address,
    operation: settings.operation,
    request,
    source,
    hasKey,
  });
  showNeeds(cloud, source, hasKey);
}

/**
 * Says what a snippet needs beside itself, and offers the file if the page makes it.
 *
 * @param {Cloud} cloud
 * @param {Source} source
 * @param {boolean} hasKey
 */
function showNeeds(cloud, { file, mediaType = "", isMade }, hasKey) {
  const needs = [];
  if (file) needs.push(`Reads ${file} in the folder where it runs. `);
  if (file && isMade) {
    const button = element("button", { type: "button", textContent: `Save ${file}` });
    button.addEventListener("click", async () => offer(await cloudFile(cloud, mediaType), file));
    needs.push(button, " ");
  }
  if (hasKey) needs.push(`Takes your key from the variable ${KEY_VARIABLE}.`);
  at("needs").replaceChildren(...needs);
  at("needs").hidden = needs.length === 0;
}

at("languages").replaceChildren(
  ...Object.entries(LANGUAGES).map(([language, title]) => {
    const button = element("button", {
      type: "button",
      textContent: title,
      ariaPressed: String(language === page.language),
    });
    button.addEventListener("click", () => {
      page.language = language;
      for (const other of at("languages").children) other.ariaPressed = String(other === button);
      showRequest(requestOf(page.settings));
    });
    return button;
  }),
);

/** Copies a text. Browsers allow it on secure origins only. */
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    at("summary").textContent = "Copied.";
  } catch {
    window.prompt("Copy this", text);
  }
}

at("copy").addEventListener("click", () => copy(at("code").textContent ?? ""));
at("link").addEventListener("click", () => copy(location.origin + location.pathname + toHash(page.settings)));
