// @ts-check
// Numbers become colours: ends, middles and logarithms of scales.

import assert from "node:assert/strict";
import { test } from "node:test";

import { colourOf, middleOf, rangeOf, shareOf, sortedOf } from "../../page/view/colours.js";

const plain = { low: 1, high: 100, isLogarithmic: false, map: "first" };
const quantity = (values, isSigned = true) => ({ id: "", title: "", unit: "", values, isSigned });
const options = { isWhole: true, middle: undefined, isLogarithmic: false };

test("values are at their shares of a scale", () => {
  assert.equal(shareOf(50.5, plain), 0.5);
  assert.equal(shareOf(10, { ...plain, isLogarithmic: true }), 0.5);
  assert.ok(shareOf(-1, { ...plain, isLogarithmic: true }) < 0);
  const uneven = { ...plain, low: -1, middle: 0, high: 3 };
  assert.deepEqual(
    [-1, -0.5, 0, 1.5, 3].map((value) => shareOf(value, uneven)),
    [0, 0.25, 0.5, 0.75, 1],
  );
});

test("a quantity with one sign has no middle, unless one is asked for", () => {
  assert.equal(middleOf(quantity([1, 2, 3]), NaN), undefined);
  assert.equal(middleOf(quantity([-3, -2, -1]), NaN), undefined);
  assert.equal(middleOf(quantity([-1, 0, 2]), NaN), 0);
  assert.equal(middleOf(quantity([-1, 0, 2], false), NaN), undefined);
  assert.equal(middleOf(quantity([1, 2, 3]), 2.5), 2.5);
});

test("a range is symmetric about its middle, and logarithmic ones begin above 0", () => {
  assert.deepEqual(rangeOf(quantity([-1, 2, 5]), { ...options, middle: 0 }), [-5, 5]);
  assert.deepEqual(rangeOf(quantity([1, 2, 5]), { ...options, middle: 4 }), [1, 7]);
  assert.deepEqual(rangeOf(quantity([0, 0.1, 5]), { ...options, isLogarithmic: true }), [0.1, 5]);
});

test("rounding alone makes no range", () => {
  const [low, high] = rangeOf(quantity([1, 1 + 2e-16, 1 - 1e-16]), options);
  assert.ok(high - low > 1e-3, `${low} to ${high}`);
});

test("a long array is sampled with its ends", () => {
  const values = Float64Array.from({ length: 1_000_001 }, (_, at) => Math.sin(at));
  values[123_457] = 7;
  values[654_321] = -7;
  const known = sortedOf(values);
  assert.ok(known.length < 200_000);
  assert.deepEqual([known[0], known[known.length - 1]], [-7, 7]);
  assert.ok(Math.abs(known[known.length >> 1]) < 0.02);
});

test("the maps differ, and uncertain colours are grey in each", () => {
  for (const middle of [undefined, 0.5]) {
    const [first, second] = ["first", "second"].map((map) => colourOf(0, 0, { ...plain, middle, map }));
    assert.notDeepEqual(first, second);
    const [red, green, blue] = colourOf(0, 1, { ...plain, middle });
    assert.ok(Math.max(red, green, blue) - Math.min(red, green, blue) < 0.1);
  }
});
