// @ts-check
// Places of the picture: spacings of points, what is cut away, the point under the pointer.

import assert from "node:assert/strict";
import { test } from "node:test";

import { uniform } from "../../page/model/examples.js";
import { spacingsOf } from "../../page/model/spacings.js";
import { DEFAULTS } from "../../page/model/state.js";
import { boxOf, edgesOf } from "../../page/view/frame.js";
import { Picker } from "../../page/view/picker.js";

/** A square grid of `side` points a side, `step` apart, from a corner. */
function square(side, step, [x, y]) {
  return Array.from({ length: side * side }, (_, at) => [
    x + step * (at % side),
    y + step * Math.floor(at / side),
    0,
  ]).flat();
}

test("spacings follow the density of the points", async () => {
  const places = Float32Array.from([...square(60, 0.1, [0, 0]), ...square(60, 0.01, [10, 10])]);
  const spacings = await spacingsOf(places, 3);
  const shares = [0.1, 0.01].map((step, part) => {
    const own = spacings.subarray(3600 * part, 3600 * (part + 1));
    // The sixth neighbour on a grid is √2 steps away: 1.02 times the spacing. Z-order curves miss some.
    return own.filter((h) => h > 0.9 * step && h < 2 * step).length / own.length;
  });
  for (const share of shares) assert.ok(share > 0.9, `${shares}`);
});

test("spacings of a curve are the distances along it", async () => {
  const places = Float32Array.from({ length: 300 }, (_, at) => (at % 3 === 0 ? 0.2 * (at / 3) : 0));
  const spacings = await spacingsOf(places, 2);
  const middle = spacings[50];
  assert.ok(Math.abs(middle - 0.2) < 0.02, `${middle}`);
});

test("one point and equal points have spacings that are numbers", async () => {
  for (const places of [new Float32Array(3), new Float32Array(300)]) {
    assert.ok((await spacingsOf(places, 3)).every((h) => Number.isFinite(h)));
  }
});

test("a box is cut by a plane or by its faces", () => {
  const cloud = { low: [0, 0, 0], high: [2, 4, 8] };
  assert.equal(boxOf(cloud, DEFAULTS), undefined);
  const below = boxOf(cloud, { ...DEFAULTS, cut: "z", cutAt: 0.25 });
  assert.equal(below?.high[2], 2);
  assert.ok(below && below.low[2] < -1e20);
  assert.equal(boxOf(cloud, { ...DEFAULTS, cut: "y", cutAt: 0.5, cutFlip: true })?.low[1], 2);
  const inner = boxOf(cloud, { ...DEFAULTS, cut: "box", x0: 0.5, y1: 0.5 });
  assert.deepEqual([inner?.low[0], inner?.high[1]], [1, 2]);
  assert.ok(inner && inner.high[0] > 1e20);
});

test("a box has twelve edges", () => {
  const edges = edgesOf([0, 0, 0], [2, 2, 2], [1, 1, 1]);
  assert.equal(edges.length, 12 * 6);
  assert.ok(edges.every((x) => Math.abs(x) === 1));
});

test("the nearest point in front is picked, as by looking at all", () => {
  const random = uniform(5);
  const n = 5000;
  const places = Float32Array.from({ length: 3 * n }, () => 2 * random() - 1);
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const view = { places, elements: identity, width: 400, height: 300, key: "a" };
  const picker = new Picker();
  const isSeen = (place) => place % 3 !== 0;
  picker.prepare(view, isSeen);
  for (let trial = 0; trial < 200; trial++) {
    const [x, y] = [400 * random(), 300 * random()];
    const scores = Array.from({ length: n }, (_, at) => {
      const off = Math.hypot(200 * (1 + places[3 * at]) - x, 150 * (1 - places[3 * at + 1]) - y);
      return off <= 10 && isSeen(at) ? places[3 * at + 2] + 1e-4 * off : Infinity;
    });
    const least = Math.min(...scores);
    const found = picker.at(x, y, 10);
    assert.equal(
      found === undefined ? Infinity : scores[found].toFixed(4),
      least === Infinity ? least : least.toFixed(4),
    );
  }
});
