//! Memory that blocks take on the heap, in bytes, including what the allocator rounds up.

/// Size in bytes up to which blocks share a page of the allocator with others of their size class.
const LARGEST_CLASS: usize = 512 << 10;

/// Size in bytes of a slice. Larger blocks take whole slices.
const SLICE: usize = 64 << 10;

/// Returns the bytes of memory that a heap block of `n_bytes` takes.
///
/// The rule is that of mimalloc (3.3). It has four size classes to a doubling, on pages of 64 KiB, 512 KiB or
/// 4 MiB. The rest of a page that fits no block stays empty. Larger blocks take whole slices. Slices are
/// handed out from runs of 64, which leave about one slice unused for each block. With transparent huge pages
/// all of that is resident.
///
/// Other allocators round by similar amounts, at other sizes.
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

/// Returns the bytes of memory that the heap block of a vector takes.
pub fn vec_bytes<T>(vec: &Vec<T>) -> usize {
    block_bytes(vec.capacity() * size_of::<T>())
}

/// Returns the bytes that an `Arc<T>` asks the heap for: the value and two counters.
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
