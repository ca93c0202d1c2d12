//! Bytes that blocks take on the heap, what the allocator rounds up included.

/// Blocks up to here share a page of the allocator with others of their size class.
const LARGEST_CLASS: usize = 512 << 10;

/// Beyond, blocks take whole slices of this size.
const SLICE: usize = 64 << 10;

/// Bytes that a block of so many bytes takes: mimalloc (3.3) has four size classes to a doubling, on pages of 64 KiB,
/// 512 KiB or 4 MiB whose rest stays empty, and whole slices beyond. Slices are handed out from runs of 64, which leave about
/// one unused for each block. With transparent huge pages all of that is resident.
///
/// Other allocators round by as much, somewhere else.
pub fn block_bytes(n_bytes: usize) -> usize {
    match n_bytes {
        0 => 0,
        1..=64 => n_bytes.next_multiple_of(16),
        _ if n_bytes <= LARGEST_CLASS => {
            let class = n_bytes.next_multiple_of(1 << ((n_bytes - 1).ilog2() - 2));
            let page = match class >> 10 {
                0..=10 => 64 << 10,
                11..=84 => 512 << 10,
                _ => 4 << 20,
            };
            page / (page / class)
        }
        _ => n_bytes.next_multiple_of(SLICE) + SLICE,
    }
}

/// Bytes of the block behind a vector.
pub fn vec_bytes<T>(vec: &Vec<T>) -> usize {
    block_bytes(vec.capacity() * size_of::<T>())
}

/// Bytes of the block behind an `Arc<T>`: the value and two counters.
pub const fn arc_payload<T>() -> usize {
    size_of::<T>() + 2 * size_of::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_round_up_to_a_share_of_a_page_or_to_slices() {
        let sizes = [0, 1, 17, 64, 65, 512, 513, 5000, 8192, 300 << 10, 512 << 10, (512 << 10) + 1];
        let taken = [0, 16, 32, 64, 80, 512, 642, 5461, 8192, 349_525, 512 << 10, 640 << 10];
        assert_eq!(sizes.map(block_bytes), taken);
    }
}
