// @ts-check
// Controls that have no effect on what is shown are disabled, and say why.

import { fieldOf } from "../control/elements.js";
import { events, page } from "../control/page.js";
import { chosen } from "../control/range.js";

/**
 * Reasons why controls have no effect now, by their names. An empty reason stands for an effect.
 *
 * @returns {Record<string, string>}
 */
function reasons() {
  const { answer, cloud, settings } = page;
  const quantity = chosen();
  const { normals, principal_directions: directions, cells } = answer?.tensors ?? {};
  const isFlat = cloud?.points.width === 2;
  const isPainted =
    (settings.colour === "support" && answer?.fields.support !== undefined) || quantity?.channels !== undefined;
  const ofColours = !quantity || isPainted ? "The colours on screen do not stand for numbers." : "";
  const ofBars = ofColours || (quantity?.deviations ? "" : "This quantity has no error bars.");
  const canHaveDirections = directions !== undefined || (answer !== undefined && answer === cloud?.known);
  return {
    centre: ofColours,
    depth: isFlat ? "Points in a plane have no depth." : "",
    directions: canHaveDirections ? "" : "Only curvatures of points come with principal directions.",
    dots: cells && !isFlat ? "A mesh has no dots." : "",
    arrows: normals ? "" : "There are no normals yet.",
    duplicates: cloud?.repeats?.length === 0 ? "No two points are equal." : "",
    epsilon: settings.family === "laplace" ? "" : "Only Laplace's kernel has ε.",
    hide: ofBars,
    high: ofColours,
    low: ofColours,
    map: ofColours,
    orthographic: isFlat ? "Points in a plane are always in parallel projection." : "",
    range: ofColours,
    sectionAt:
      settings.section === "none" ? "There are no level regions." : isFlat ? "The regions fill the plane." : "",
    suppress: ofBars,
    up: isFlat ? "Points in a plane have no upward axis." : "",
  };
}

/** Enables the controls that have an effect. */
export function showEffects() {
  for (const [name, reason] of Object.entries(reasons())) {
    const field = fieldOf(name);
    field.disabled = reason !== "";
    (field.closest("label") ?? field).title = reason;
  }
}

events.addEventListener("answered", showEffects);
