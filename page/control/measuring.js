// @ts-check
// The distance between two points that are picked, with all digits of their coordinates.

import { element, list } from "../view/readout.js";
import { at } from "./elements.js";
import { events, page, scene } from "./page.js";

const COLOUR = [0.95, 0.45, 0];

/** The points that are picked, while measuring is on. */
const measuring = { isOn: false, points: /** @type {number[]} */ ([]) };

at("measure").addEventListener("click", () => {
  measuring.isOn = !measuring.isOn;
  measuring.points = [];
  show();
});
events.addEventListener("answered", () => {
  measuring.points = [];
  show();
});

/**
 * Takes a point that was clicked, while measuring is on. A third point begins anew.
 *
 * @param {number | undefined} point
 */
export function measure(point) {
  if (!measuring.isOn) return false;
  if (point !== undefined) measuring.points = [...measuring.points.filter(() => measuring.points.length < 2), point];
  show();
  return true;
}

function show() {
  const { isOn, points } = measuring;
  const { body, ruler } = scene;
  at("measure").ariaPressed = String(isOn);
  at("measured").hidden = !isOn;
  ruler.clear();
  if (!body) return;
  if (points.length > 0) ruler.mark(body, { points, colour: COLOUR });
  if (points.length === 2) ruler.segments(between(body, points), 0xf27300);
  const hint = ["Click a point.", "Click a second point."][points.length];
  at("measured").replaceChildren(hint ? element("p", { textContent: hint }) : list(rowsOf(points)));
  scene.draw();
}

function between(body, points) {
  const place = body.placeOf();
  return Float32Array.from(
    points.flatMap((point) => [...body.arrangement.places.subarray(3 * place(point), 3 * place(point) + 3)]),
  );
}

/** Distance and differences of two points, in full. */
function rowsOf(points) {
  const positions = page.answer?.tensors.vertices ?? page.cloud?.points;
  if (!positions) return [];
  const d = positions.width;
  const [from, to] = points.map((point) => [...positions.data.subarray(point * d, (point + 1) * d)]);
  const differences = to.map((x, axis) => x - from[axis]);
  const unit = page.settings.unit || "L";
  const full = (x) => String(x).replace("-", "−");
  return [
    ["distance", `${full(Math.hypot(...differences))} ${unit}`],
    ...differences.map((x, axis) => [`along ${["x", "y", "z"][axis]}`, `${full(x)} ${unit}`]),
    ["from point", `${points[0]} at ${from.map(full).join(", ")}`],
    ["to point", `${points[1]} at ${to.map(full).join(", ")}`],
  ];
}
