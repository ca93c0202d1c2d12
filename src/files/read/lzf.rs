//! LZF, the compression of PCD (Lehmann 2005): runs of bytes as they are, and copies of earlier ones.

/// Most bytes that three compressed ones stand for.
const MAX_COPY: usize = 264;

/// Decompresses to exactly `size` bytes. `None` if the bytes do not have that size, or are damaged.
pub fn decompressed(packed: &[u8], size: usize) -> Option<Vec<u8>> {
    if size > packed.len().saturating_mul(MAX_COPY) {
        return None;
    }
    let (mut bytes, mut whole) = (packed.iter().copied(), Vec::with_capacity(size));
    while let Some(control) = bytes.next() {
        let control = usize::from(control);
        if control < 32 {
            for _ in 0..=control {
                whole.push(bytes.next()?);
            }
        } else {
            let mut length = (control >> 5) + 2;
            if length == 9 {
                length += usize::from(bytes.next()?);
            }
            let distance = ((control & 0x1f) << 8) + usize::from(bytes.next()?) + 1;
            let begins = whole.len().checked_sub(distance)?;
            // A copy may run into what it writes.
            for at in begins..begins + length {
                whole.push(whole[at]);
            }
        }
        if whole.len() > size {
            return None;
        }
    }
    (whole.len() == size).then_some(whole)
}
