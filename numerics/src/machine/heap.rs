//! Memory that blocks take on the heap, in bytes, including what the allocator rounds up.

/// Size in bytes from which a block takes whole slices of the allocator, and the size of a slice.
const LARGEST_CLASS: usize = 512 << 10;
const SLICE: usize = 64 << 10;

/// Returns the bytes of memory that a heap block of `n_bytes` takes, on average.
///
/// mimalloc has four size classes to a doubling, so that a block of any size wastes an eighth on average, the
/// rest of its page included. Larger blocks take whole slices, and leave about one unused. Counts of caches
/// are within 5 % of the resident set (tests/footprint.rs).
pub fn block_bytes(n_bytes: usize) -> usize {
    match n_bytes {
        0..=LARGEST_CLASS => n_bytes + n_bytes / 8,
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
