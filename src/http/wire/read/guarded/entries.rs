//! The entries of a list under guard: counted, and kept as far as there may be so many.

use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};

use super::{Guard, Seed, Stop, shortened};
use crate::http::wire::read::limits::{Excess, List};

/// Entries that a list is granted at a time, so that most of them cost nothing but a decrement.
const ENTRIES_PER_GRANT: usize = 64;

/// The entries of a list: as many as it may have, all of them counted. Bare ones are numbers without a guard.
pub(super) struct Entries<'g, A, const IS_BARE: bool> {
    inner: A,
    guard: &'g Guard<'g>,
    list: List,
    max_length: usize,
    /// Entries that may have come when the grant is used up, and what is left of it.
    n_granted: usize,
    n_left: usize,
}

impl<'de, 'g, A: SeqAccess<'de>, const IS_BARE: bool> Entries<'g, A, IS_BARE> {
    pub(super) fn new(inner: A, guard: &'g Guard<'g>, list: List) -> Self {
        let max_length = guard.context.max_entries(list);
        // A row is granted its first coordinates with itself. Of a tensor it knows its length, and may be too long from the start.
        let fits = known_length(&inner, guard).is_none_or(|length| length <= max_length);
        let is_granted = list == List::Coordinates && fits;
        let n_granted = if is_granted { max_length.min(ENTRIES_PER_GRANT) } else { 0 };
        Self { inner, guard, list, max_length, n_granted, n_left: n_granted }
    }

    /// Entries that have come.
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

    /// Of no more entries than will be kept: room is made for as many.
    fn size_hint(&self) -> Option<usize> {
        self.inner.size_hint().map(|length| length.min(self.max_length))
    }
}

impl<'de, A: SeqAccess<'de>, const IS_BARE: bool> Entries<'_, A, IS_BARE> {
    fn is_granted_more(&mut self) -> Result<bool, A::Error> {
        self.guard.tick()?;
        let n_free = self.max_length - self.n_granted;
        // Tensors know their length beforehand.
        if known_length(&self.inner, self.guard).is_some_and(|n_rest| n_rest > n_free) {
            return Ok(false);
        }
        self.n_left = n_free.min(ENTRIES_PER_GRANT);
        self.n_granted += self.n_left;
        Ok(self.n_left > 0)
    }

    /// Counts what is left without keeping it. Behind a row of too many entries, their number is told.
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
        // A row ends here for the point that it is, and the list of points goes on to be counted.
        if self.list == List::Coordinates {
            self.guard.too_wide.set(Some(length));
            return Ok(None);
        }
        Err(self.guard.stopped(Stop::TooLarge(Excess { list: self.list, length, width })))
    }
}

/// Entries that are left, of a list whose length is known for certain: that of a tensor. Plain JSON has but a guess.
fn known_length<'de, A: SeqAccess<'de>>(entries: &A, guard: &Guard<'_>) -> Option<usize> {
    if guard.asks_for_any { entries.size_hint() } else { None }
}

/// A number, or a row of numbers, that is not kept.
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

    /// What would be repeated to the client.
    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        Err(E::invalid_type(serde::de::Unexpected::Str(&shortened(text)), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, row: A) -> Result<(), A::Error> {
        let mut row = Entries::<_, false>::new(row, self.0, List::Other);
        while row.next_element::<f64>()?.is_some() {}
        Ok(())
    }
}
