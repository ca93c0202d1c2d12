// @ts-check
// The pointer and the keyboard on the picture.

import { showPinned, valueAt } from "../view/readout.js";
import { all, at } from "./elements.js";
import { page, scene } from "./page.js";
import { measure } from "./measuring.js";
import { chosen } from "./range.js";

at("scene").addEventListener("pointermove", (event) => {
  if (event.buttons !== 0) return;
  const point = scene.pick(event.offsetX, event.offsetY);
  const tip = at("tip");
  tip.hidden = point === undefined;
  if (point === undefined) return;
  const why = page.reasonOf.get(point);
  tip.textContent = `${valueAt(chosen(), point)}${why ? ` (${why.replaceAll("_", " ")})` : ""}`;
  tip.style.left = `${event.offsetX + 14}px`;
  tip.style.top = `${event.offsetY + 14}px`;
});
at("scene").addEventListener("pointerleave", () => {
  at("tip").hidden = true;
});
let pressed = [0, 0];
at("scene").addEventListener("pointerdown", (event) => {
  pressed = [event.clientX, event.clientY];
});
at("scene").addEventListener("click", (event) => {
  // The end of a turn is no click.
  if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5)
    choose(scene.pick(event.offsetX, event.offsetY));
});

/** @param {number | undefined} point */
function choose(point) {
  if (!measure(point)) pin(point);
}

/** @param {number | undefined} point */
function pin(point) {
  page.point = point;
  const { answer, cloud } = page;
  if (point === undefined || !answer || !cloud) return;
  showPinned(at("pinned"), point, { ...page, answer, cloud });
}

/** Pins the point that is nearest to the middle of the picture. */
function pinMiddle() {
  const { clientWidth: width, clientHeight: height } = at("scene");
  for (let reach = 0; reach < 400; reach += 8) {
    for (const [x, y] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ]) {
      const found = scene.pick(width / 2 + reach * x, height / 2 + reach * y);
      if (found !== undefined) return choose(found);
    }
  }
}

/** Arrows turn the view. Once a point is pinned, they walk to its neighbours. */
at("scene").addEventListener("keydown", (event) => {
  const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  if (event.key === "Escape") {
    page.point = undefined;
    at("pinned").hidden = true;
  }
  if (event.key === "Enter") pinMiddle();
  if (!step) return;
  event.preventDefault();
  if (page.point === undefined) return scene.turn(-0.1 * step[0], -0.1 * step[1]);
  const [x, y] = scene.onCanvas(page.point);
  for (let reach = 6; reach < 200; reach += 6) {
    const next = scene.pick(x + reach * step[0], y + reach * step[1]);
    if (next !== undefined && next !== page.point) return pin(next);
  }
});

/**
 * Directions of the views. Home has none.
 * @type {Record<string, number[]>} */
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

for (const button of all("[data-view]")) {
  const axis = AXES[button.dataset.view ?? ""];
  button.addEventListener("click", () => scene.fit(axis));
}
