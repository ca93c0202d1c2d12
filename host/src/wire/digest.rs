//! Numbers in a hash, as canonical bytes.

/// Adds numbers to a hash, little-endian, −0.0 as 0.0.
///
/// Bytes go through a buffer on the stack, because hashing number by number costs more than the hash. The
/// loop goes through all points of a request, so it is compiled here, at full speed.
#[inline(never)]
pub fn update_with_floats(hasher: &mut blake3::Hasher, numbers: &[f64]) {
    let mut bytes = [0u8; 4096];
    for chunk in numbers.chunks(bytes.len() / 8) {
        for (slot, x) in bytes.chunks_exact_mut(8).zip(chunk) {
            slot.copy_from_slice(&(x + 0.0).to_le_bytes());
        }
        hasher.update(&bytes[..chunk.len() * 8]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_are_those_of_one_piece() {
        for n in [0, 1, 511, 512, 513, 2000] {
            let mut numbers: Vec<f64> = (0..n).map(|i| f64::from(i) - 700.5).collect();
            let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
            let hash = |numbers: &[f64]| {
                let mut hasher = blake3::Hasher::new();
                update_with_floats(&mut hasher, numbers);
                hasher.finalize()
            };
            assert_eq!(hash(&numbers), blake3::hash(&bytes), "{n}");
            numbers.push(0.0);
            let of_zero = hash(&numbers);
            numbers[n as usize] = -0.0;
            assert_eq!(hash(&numbers), of_zero, "{n}");
        }
    }
}
