//! Buffers for the n² numbers of a factorization, mapped in huge pages and kept for the next factorization.
//!
//! WHY. The operating system hands out fresh memory page by page, at the first touch. For the 128 MB of 4,000
//! points this takes a third of the factorization's own time or more with pages of 4 KiB. With huge pages it
//! takes some 10 ms, and with memory that was used before nothing. So a buffer that is given back is kept.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use memmap2::MmapMut;

use super::heap::vec_bytes;
use crate::error::{NumericsError, Result};

/// Size in bytes from which buffers are mapped. The allocator recycles smaller ones by itself, and they would
/// fill no huge page.
const MAPPED_BYTES: usize = 4 << 20;

/// Divisor that limits the waste of reuse: a kept buffer serves a request if it is at most 1/32 larger.
///
/// So the memory that a factor takes is close to its own size.
const SLACK: usize = 32;

/// A store for the last large buffer that was given back, up to a size limit. The next taker reuses it.
#[derive(Debug, Default)]
pub struct SpareBuffer {
    kept: Mutex<Option<MmapMut>>,
    max_bytes: usize,
}

impl SpareBuffer {
    /// Returns an empty store that keeps a buffer of at most `max_bytes`. A limit of 0 keeps none.
    pub fn up_to(max_bytes: usize) -> Arc<Self> {
        Arc::new(Self { kept: Mutex::new(None), max_bytes })
    }

    /// Returns a buffer of `n_numbers` numbers with unspecified contents: zeros, or the numbers of an earlier
    /// user.
    ///
    /// # Errors
    /// [`NumericsError::OutOfMemory`].
    pub(crate) fn take(self: &Arc<Self>, n_numbers: usize) -> Result<Buffer> {
        let n_bytes = n_numbers.saturating_mul(size_of::<f64>());
        if n_bytes < MAPPED_BYTES {
            return Ok(Buffer { pages: Pages::Heap(vec![0.0; n_numbers]), n_numbers, home: None });
        }
        // A kept buffer that does not fit is unmapped here, before the new one is mapped.
        let kept = self.kept().take();
        let fits = |map: &MmapMut| (n_bytes..=n_bytes + n_bytes / SLACK).contains(&map.len());
        let map = match kept.filter(fits) {
            Some(map) => map,
            None => map_huge(n_bytes)?,
        };
        Ok(Buffer { pages: Pages::Mapped(map), n_numbers, home: Some(self.clone()) })
    }

    /// Returns the size in bytes of the kept buffer, or 0.
    pub fn n_bytes(&self) -> usize {
        self.kept().as_ref().map_or(0, |map| map.len())
    }

    #[expect(clippy::disallowed_methods, reason = "one buffer, for as long as it takes to move it")]
    fn kept(&self) -> MutexGuard<'_, Option<MmapMut>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn give_back(&self, map: MmapMut) {
        if map.len() <= self.max_bytes {
            *self.kept() = Some(map);
        }
    }
}

fn map_huge(n_bytes: usize) -> Result<MmapMut> {
    let map = MmapMut::map_anon(n_bytes).map_err(|_| NumericsError::OutOfMemory { n_bytes })?;
    // This is only a hint, so a refusal (a system without huge pages) does no harm.
    #[cfg(target_os = "linux")]
    let _ = map.advise(memmap2::Advice::HugePage);
    Ok(map)
}

/// A contiguous buffer of f64. When dropped, a mapped one goes back to its [`SpareBuffer`].
pub(crate) struct Buffer {
    pages: Pages,
    n_numbers: usize,
    home: Option<Arc<SpareBuffer>>,
}

enum Pages {
    Heap(Vec<f64>),
    Mapped(MmapMut),
    /// No memory: the destructor has moved it out.
    Gone,
}

impl Buffer {
    /// Returns the bytes of memory that the buffer takes, used or not.
    pub(crate) fn n_bytes(&self) -> usize {
        match &self.pages {
            Pages::Heap(numbers) => vec_bytes(numbers),
            Pages::Mapped(map) => map.len(),
            Pages::Gone => 0,
        }
    }

    /// Returns the memory to the operating system instead of giving it back to the [`SpareBuffer`].
    pub(crate) fn discard(mut self) {
        self.home = None;
    }
}

impl Deref for Buffer {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        match &self.pages {
            Pages::Heap(numbers) => numbers,
            // Mappings begin at a page boundary, so they are aligned for f64.
            Pages::Mapped(map) => bytemuck::cast_slice(&map[..self.n_numbers * size_of::<f64>()]),
            Pages::Gone => &[],
        }
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f64] {
        match &mut self.pages {
            Pages::Heap(numbers) => numbers,
            Pages::Mapped(map) => bytemuck::cast_slice_mut(&mut map[..self.n_numbers * size_of::<f64>()]),
            Pages::Gone => &mut [],
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let (Pages::Mapped(map), Some(home)) =
            (std::mem::replace(&mut self.pages, Pages::Gone), &self.home)
        {
            home.give_back(map);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LARGE: usize = MAPPED_BYTES / 4;

    fn address(buffer: &Buffer) -> *const f64 {
        buffer.as_ptr()
    }

    #[test]
    fn a_large_buffer_is_kept_for_the_next_of_its_size() {
        let spare = SpareBuffer::up_to(1 << 30);
        let mut first = spare.take(LARGE).unwrap();
        assert!(first.len() == LARGE && first.iter().all(|&x| x == 0.0));
        first.fill(7.0);
        let at = address(&first);
        drop(first);
        let second = spare.take(LARGE - LARGE / 64).unwrap();
        assert_eq!(address(&second), at);
        assert!(second.iter().all(|&x| x == 7.0));
        // While the kept buffer is in use, another taker gets a fresh one.
        assert_ne!(address(&spare.take(LARGE).unwrap()), at);
    }

    #[test]
    fn what_does_not_fit_or_is_too_large_or_discarded_is_not_kept() {
        let spare = SpareBuffer::up_to(LARGE * 8);
        let is_kept = || spare.kept.lock().unwrap().is_some();
        drop(spare.take(LARGE).unwrap());
        assert!(is_kept());
        drop(spare.take(2 * LARGE).unwrap());
        assert!(!is_kept(), "too large to keep, and it displaced the one before");
        spare.take(LARGE).unwrap().discard();
        assert!(!is_kept());
        drop(spare.take(1000).unwrap());
        assert!(!is_kept(), "small ones belong to the allocator");
    }

    #[test]
    fn memory_that_does_not_exist_is_refused() {
        let found = SpareBuffer::up_to(0).take(usize::MAX / 16);
        assert!(matches!(found, Err(NumericsError::OutOfMemory { .. })));
    }
}
