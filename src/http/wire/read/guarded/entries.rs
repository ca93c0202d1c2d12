//! Guarded list entries: counted to the end, but kept only up to the limit.

use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};

use super::{Guard, Seed, Stop, shortened};
use crate::http::wire::read::limits::{Excess, List};

/// Entries that a list is granted at a time. Within a grant, counting an entry is a single decrement.
const ENTRIES_PER_GRANT: usize = 64;

/// The entries of a list, all counted, of which at most `max_length` are kept.
///
/// With `IS_BARE`, entries are plain numbers and are deserialized without a guard of their own.
pub(super) struct Entries<'g, A, const IS_BARE: bool> {
    inner: A,
    guard: &'g Guard<'g>,
    list: List,
    max_length: usize,
    /// Entries that will have been read when the current grant is used up.
    /// Entries left of the current grant.
    n_granted: usize,
    n_left: usize,
}

impl<'de, 'g, A: SeqAccess<'de>, const IS_BARE: bool> Entries<'g, A, IS_BARE> {
    pub(super) fn new(inner: A, guard: &'g Guard<'g>, list: List) -> Self {
        let max_length = guard.context.max_entries(list);
        // A row gets its first grant when it is created. A row of a tensor knows its length, and may be too
        // long from the start.
        let fits = known_length(&inner, guard).is_none_or(|length| length <= max_length);
        let is_granted = list == List::Coordinates && fits;
        let n_granted = if is_granted { max_length.min(ENTRIES_PER_GRANT) } else { 0 };
        Self { inner, guard, list, max_length, n_granted, n_left: n_granted }
    }

    /// Number of entries read so far.
    fn length(&self) -> usize {
        self.n_granted - self.n_left
    }
}

impl<'de, A: SeqAccess<'de>, const IS_BARE: bool> SeqAccess<'de> for Entries<'_, A, IS_BARE> {
    type Error = A::Error;

    #[inline]
    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        if self.n_left == 0 && !self.is_granted_more()? {
            return self.end(None);
        }
        let list = self.list.of_entries();
        let entry = if IS_BARE {
            self.inner.next_element_seed(seed)
        } else {
            self.inner.next_element_seed(Seed { seed, guard: self.guard, list })
        };
        match entry {
            Ok(Some(entry)) => {
                self.n_left -= 1;
                if !IS_BARE
                    && list == List::Coordinates
                    && let Some(width) = self.guard.too_wide.take()
                {
                    return self.end(Some(width));
                }
                Ok(Some(entry))
            }
            Ok(None) => Ok(None),
            Err(error) => Err(self.guard.passed(self.length(), error)),
        }
    }

    /// Capped at the limit: callers reserve memory for this many entries.
    fn size_hint(&self) -> Option<usize> {
        self.inner.size_hint().map(|length| length.min(self.max_length))
    }
}

impl<'de, A: SeqAccess<'de>, const IS_BARE: bool> Entries<'_, A, IS_BARE> {
    fn is_granted_more(&mut self) -> Result<bool, A::Error> {
        self.guard.tick()?;
        let n_free = self.max_length - self.n_granted;
        // Lists in tensors know their length beforehand.
        if known_length(&self.inner, self.guard).is_some_and(|n_rest| n_rest > n_free) {
            return Ok(false);
        }
        self.n_left = n_free.min(ENTRIES_PER_GRANT);
        self.n_granted += self.n_left;
        Ok(self.n_left > 0)
    }

    /// Counts the remaining entries without keeping them.
    ///
    /// `width` is the length of the entry just read, if that was a row with too many coordinates. The error
    /// then reports the number of rows as well.
    #[cold]
    fn end<T>(&mut self, width: Option<usize>) -> Result<Option<T>, A::Error> {
        let mut length = self.length();
        match known_length(&self.inner, self.guard) {
            Some(n_rest) => length += n_rest,
            None => loop {
                if length.is_multiple_of(ENTRIES_PER_GRANT) {
                    self.guard.tick()?;
                }
                match self.inner.next_element_seed(Passed(self.guard)) {
                    Ok(Some(())) => length += 1,
                    Ok(None) => break,
                    Err(error) => return Err(self.guard.passed(length, error)),
                }
            },
        }
        if length <= self.max_length && width.is_none() {
            return Ok(None);
        }
        // A row that is too long ends here. Its list goes on, so that all points are counted.
        if self.list == List::Coordinates {
            self.guard.too_wide.set(Some(length));
            return Ok(None);
        }
        Err(self.guard.stopped(Stop::TooLarge(Excess { list: self.list, length, width })))
    }
}

/// Number of entries left, if known for certain, which holds for tensors. Plain JSON only has a guess.
fn known_length<'de, A: SeqAccess<'de>>(entries: &A, guard: &Guard<'_>) -> Option<usize> {
    if guard.asks_for_any { entries.size_hint() } else { None }
}

/// A number or a row of numbers that is skipped.
struct Passed<'g>(&'g Guard<'g>);

impl<'de> DeserializeSeed<'de> for Passed<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Passed<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number or a list of numbers")
    }

    fn visit_i64<E: Error>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E: Error>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E: Error>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    /// Refuses a text. It is shortened because the error repeats it to the client.
    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        Err(E::invalid_type(serde::de::Unexpected::Str(&shortened(text)), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, row: A) -> Result<(), A::Error> {
        let mut row = Entries::<_, false>::new(row, self.0, List::Other);
        while row.next_element::<f64>()?.is_some() {}
        Ok(())
    }
}
