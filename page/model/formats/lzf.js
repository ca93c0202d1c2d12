// @ts-check
// LZF, the compression of PCD: runs of bytes as they are, and copies of earlier ones.

/** Most bytes that compressed ones stand for, each. */
const MAX_COPY = 264;

/**
 * Decompresses to exactly `size` bytes. Nothing if the bytes do not have that size, or are damaged.
 *
 * @param {Uint8Array} packed
 * @param {number} size
 */
export function decompressed(packed, size) {
  if (size > packed.length * MAX_COPY) return undefined;
  const whole = new Uint8Array(size);
  let [from, to] = [0, 0];
  while (from < packed.length) {
    const control = packed[from++];
    if (control < 32) {
      const n = control + 1;
      if (from + n > packed.length || to + n > size) return undefined;
      whole.set(packed.subarray(from, from + n), to);
      from += n;
      to += n;
    } else {
      let length = (control >> 5) + 2;
      if (length === 9) length += packed[from++];
      const begins = to - ((control & 0x1f) << 8) - packed[from++] - 1;
      if (from > packed.length || !(begins >= 0) || to + length > size) return undefined;
      // A copy may run into what it writes.
      for (let at = begins; at < begins + length; at++) whole[to++] = whole[at];
    }
  }
  return to === size ? whole : undefined;
}
