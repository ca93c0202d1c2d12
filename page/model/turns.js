// @ts-check
// Long work in parts, between which the page answers.

/** Milliseconds of a part. */
const PART = 25;

/** Rows between two looks at the clock. */
const ROWS = 4096;

/** Lets the page answer what has come in the meantime. */
export function turn() {
  return new Promise((resolve) => setTimeout(resolve));
}

/**
 * Works on the rows 0 to n in order, given as ranges.
 *
 * @param {number} n
 * @param {(from: number, to: number) => void} work
 */
export async function inTurns(n, work) {
  let end = performance.now() + PART;
  for (let from = 0; from < n; from += ROWS) {
    if (performance.now() > end) {
      await turn();
      end = performance.now() + PART;
    }
    work(from, Math.min(n, from + ROWS));
  }
}
