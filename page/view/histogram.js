// @ts-check
// Histogram of a quantity over its colour bar. Both ends can be dragged, and clip.

import { colourOf, cssOf, levelOf, shareOf, shown, sortedOf, ticks } from "./colours.js";

/** @import { ColourRange, Quantity } from "../types.d.ts" */

const BINS = 96;
const BAR = 14;
const FOOT = 34;
const SIDE = 12;

export class Histogram {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(low: number, high: number) => void} changed
   */
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.changed = changed;
    /** @type {Quantity | undefined} */
    this.quantity = undefined;
    /** @type {ColourRange} */
    this.range = { low: 0, high: 1, isLogarithmic: false, map: "first", full: 0, hide: Infinity };
    /**
     * The end that is dragged.
     * @type {"low" | "high" | undefined}
     */
    this.held = undefined;
    this.bins = new Float64Array(BINS);
    /** Ends of the bins, and with them all places, are logarithms if the colours are logarithmic. */
    this.from = 0;
    this.to = 1;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, () => {
        this.held = undefined;
      });
    }
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  /**
   * @param {Quantity | undefined} quantity
   * @param {ColourRange} range
   */
  show(quantity, range) {
    const isOther = quantity !== this.quantity || range.isLogarithmic !== this.range.isLogarithmic;
    Object.assign(this, { quantity, range });
    if (isOther) this.count();
    this.draw();
  }

  /** Counts values over an interval somewhat wider than almost all of them. */
  count() {
    const { isLogarithmic } = this.range;
    const all = this.quantity ? sortedOf(this.quantity.values) : [];
    const known = isLogarithmic ? all.filter((x) => x > 0).map(Math.log10) : all;
    this.bins = new Float64Array(BINS);
    if (known.length === 0) return;
    const at = (share) => known[Math.round(share * (known.length - 1))];
    const [from, to] = [at(0.002), at(0.998)];
    const margin = 0.1 * (to - from) || Math.max(1e-3 * Math.abs(from), 1e-12);
    [this.from, this.to] = [from - margin, to + margin];
    for (const value of known) {
      const bin = Math.floor((BINS * (value - this.from)) / (this.to - this.from));
      this.bins[Math.min(Math.max(bin, 0), BINS - 1)]++;
    }
  }

  /** Ends of what is drawn, which always includes the range. */
  ends() {
    const [low, high] = [this.range.low, this.range.high].map((end) => levelOf(end, this.range.isLogarithmic));
    return [Math.min(this.from, low), Math.max(this.to, high)];
  }

  placeOf(value) {
    const [from, to] = this.ends();
    const level = levelOf(value, this.range.isLogarithmic);
    return SIDE + ((level - from) / (to - from)) * (this.canvas.clientWidth - 2 * SIDE);
  }

  valueAt(x) {
    const [from, to] = this.ends();
    const level = from + ((x - SIDE) / (this.canvas.clientWidth - 2 * SIDE)) * (to - from);
    return this.valueOf(level);
  }

  valueOf(level) {
    return this.range.isLogarithmic ? 10 ** level : level;
  }

  grab(event) {
    if (!this.quantity) return;
    const x = event.offsetX;
    const off = (end) => Math.abs(this.placeOf(this.range[end]) - x);
    this.held = off("low") < off("high") ? "low" : "high";
    if (off(this.held) > 16) this.held = undefined;
    else this.canvas.setPointerCapture(event.pointerId);
  }

  drag(event) {
    if (!this.held) return;
    const value = this.valueAt(event.offsetX);
    const { low, middle, high } = this.range;
    const ends = { low, high, [this.held]: value };
    if (middle !== undefined) {
      const half = Math.abs(value - middle);
      Object.assign(ends, { low: middle - half, high: middle + half });
    }
    if (ends.low < ends.high) this.changed(ends.low, ends.high);
  }

  draw() {
    const { canvas, quantity, range } = this;
    const scale = window.devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    Object.assign(canvas, { width: width * scale, height: height * scale });
    const context = canvas.getContext("2d");
    if (!context || !quantity || width === 0) return;
    context.scale(scale, scale);
    const ink = getComputedStyle(canvas).color;
    this.bars(context, height);
    this.bar(context, height);
    context.fillStyle = ink;
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    for (const place of this.ticks(width < 260 ? 3 : 5)) {
      const x = this.placeOf(place);
      context.fillRect(x, height - FOOT + BAR, 1, 4);
      context.fillText(shown(Math.abs(place) < 1e-12 * range.high ? 0 : place), x, height - 4);
    }
    for (const end of [range.low, range.high]) {
      context.fillRect(this.placeOf(end) - 1, 2, 2, height - FOOT + BAR - 2);
      context.fillRect(this.placeOf(end) - 4, 2, 8, 8);
    }
  }

  /** Round numbers below the bar. */
  ticks(wanted) {
    const { low, high, isLogarithmic } = this.range;
    if (!isLogarithmic || high < 10 * low) return ticks(low, high, wanted);
    const powers = ticks(Math.ceil(Math.log10(low) - 1e-9), Math.log10(high), wanted);
    return powers.filter(Number.isInteger).map((power) => 10 ** power);
  }

  bars(context, height) {
    const [top, base] = [12, height - FOOT];
    const most = Math.max(...this.bins, 1);
    for (let bin = 0; bin < BINS; bin++) {
      const [left, right] = [0, 1].map((side) =>
        this.placeOf(this.valueOf(this.from + ((bin + side) / BINS) * (this.to - this.from))),
      );
      const middle = this.valueOf(this.from + ((bin + 0.5) / BINS) * (this.to - this.from));
      const length = this.bins[bin] > 0 ? Math.max(1, Math.sqrt(this.bins[bin] / most) * (base - top)) : 0;
      context.fillStyle = this.colourAt(middle, 0);
      context.fillRect(left, base - length, Math.max(1, right - left - 0.5), length);
    }
  }

  /** The colour bar. With deviations, rows below show the colours of less certain values. */
  bar(context, height) {
    const [from, to] = [this.placeOf(this.range.low), this.placeOf(this.range.high)];
    const rows = this.range.full > 0 ? 4 : 1;
    for (let row = 0; row < rows; row++) {
      for (let x = Math.floor(from); x < to; x += 2) {
        context.fillStyle = this.colourAt(this.valueAt(x), (row + 0.5) / rows);
        context.fillRect(x, height - FOOT + 2 + (row * BAR) / rows, 2, BAR / rows);
      }
    }
  }

  colourAt(value, s) {
    return cssOf(colourOf(shareOf(value, this.range), s, this.range));
  }
}
