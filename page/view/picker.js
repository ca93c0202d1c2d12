// @ts-check
// The point under the pointer, from a grid over the canvas that is made once for each view.

/** Pixels of a side of a tile. */
const TILE = 16;

export class Picker {
  constructor() {
    /** What the grid was made for. */
    this.view = "";
    this.width = 0;
    this.height = 0;
    this.begins = new Uint32Array();
    this.points = new Uint32Array();
    this.across = new Float32Array();
    this.down = new Float32Array();
    this.depths = new Float32Array();
  }

  /**
   * Sorts places into the tiles of the canvas, unless it was done for the same view. What `isSeen` refuses is
   * left out.
   *
   * @param {{ places: Float32Array, elements: number[], width: number, height: number, key: string }} view
   * @param {(place: number) => boolean} isSeen
   */
  prepare({ places, elements: m, width, height, key }, isSeen) {
    if (key === this.view) return;
    this.view = key;
    this.width = Math.ceil(width / TILE);
    this.height = Math.ceil(height / TILE);
    const n = places.length / 3;
    if (this.depths.length !== n) {
      for (const name of ["across", "down", "depths"]) this[name] = new Float32Array(n);
      this.points = new Uint32Array(n);
    }
    const { across, down, depths } = this;
    const begins = new Uint32Array(this.width * this.height + 1);
    const tiles = new Int32Array(n);
    for (let at = 0; at < n; at++) {
      const [a, b, c] = [places[3 * at], places[3 * at + 1], places[3 * at + 2]];
      const w = m[3] * a + m[7] * b + m[11] * c + m[15];
      across[at] = (0.5 + (0.5 * (m[0] * a + m[4] * b + m[8] * c + m[12])) / w) * width;
      down[at] = (0.5 - (0.5 * (m[1] * a + m[5] * b + m[9] * c + m[13])) / w) * height;
      depths[at] = (m[2] * a + m[6] * b + m[10] * c + m[14]) / w;
      const isInside = w > 0 && across[at] >= 0 && across[at] < width && down[at] >= 0 && down[at] < height;
      tiles[at] = isInside && isSeen(at) ? this.tileAt(across[at], down[at]) : -1;
      if (tiles[at] >= 0) begins[tiles[at] + 1]++;
    }
    for (let tile = 0; tile < begins.length - 1; tile++) begins[tile + 1] += begins[tile];
    const ends = begins.slice();
    for (let at = 0; at < n; at++) if (tiles[at] >= 0) this.points[ends[tiles[at]]++] = at;
    this.begins = begins;
  }

  tileAt(x, y) {
    return Math.floor(y / TILE) * this.width + Math.floor(x / TILE);
  }

  /** The nearest place in front within reach of a place on the canvas, all in pixels, or undefined. */
  at(x, y, reach) {
    /** @type {number | undefined} */
    let found;
    let least = Infinity;
    const row = (pixel) => Math.floor(pixel / TILE);
    for (let v = Math.max(0, row(y - reach)); v <= Math.min(this.height - 1, row(y + reach)); v++) {
      for (let u = Math.max(0, row(x - reach)); u <= Math.min(this.width - 1, row(x + reach)); u++) {
        const tile = v * this.width + u;
        for (let index = this.begins[tile]; index < this.begins[tile + 1]; index++) {
          const at = this.points[index];
          const off = Math.hypot(this.across[at] - x, this.down[at] - y);
          if (off > reach) continue;
          // A point a little behind but nearer to the pointer is the one that is meant.
          const score = this.depths[at] + 1e-4 * off;
          if (score < least) [found, least] = [at, score];
        }
      }
    }
    return found;
  }
}
