// @ts-check
// The request as code in each language, ready to be copied.

import { LANGUAGES, snippet } from "../model/snippets.js";
import { requestOf } from "../model/operations.js";
import { toHash } from "../model/state.js";
import { element } from "../view/readout.js";
import { at } from "./elements.js";
import { page } from "./page.js";

export function showRequest(request) {
  const { settings, cloudId, cloud } = page;
  const address = new URL(".", document.baseURI).href;
  const fileName = settings.example ? undefined : cloud?.name;
  at("code").textContent = snippet(page.language, {
    address,
    cloudId,
    operation: settings.operation,
    request,
    fileName,
  });
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
