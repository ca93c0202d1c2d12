//! Entries of a list: counted to the end, but kept only up to the limit.

use serde::de::{Deserialize, DeserializeSeed, Error as _, SeqAccess};
use serde_json::Error;

use super::Value;
use super::source::Source;
use super::state::{Reader, Stop};
use super::text::Token;
use crate::wire::read::limits::{Excess, List};

/// Entries that a list is granted at a time. Within a grant, counting an entry is a single decrement.
const ENTRIES_PER_GRANT: usize = 64;

/// Refusal of entries that a type of a fixed length does not read.
const LONGER_THAN_EXPECTED: &str = "the list is longer than expected";

/// The entries of a list, all counted, of which at most `max_length` are kept.
pub(super) struct Entries<'r, 'a> {
    reader: &'r mut Reader<'a>,
    /// Number of entries, which is known beforehand if they are not in the text.
    known_length: Option<usize>,
    source_of_entry: Source,
    list: List,
    /// Kind of list that an entry is, if it is a list.
    list_of_entry: List,
    /// Lists and objects around an entry.
    depth: usize,
    max_length: usize,
    /// Entries that will have been read when the current grant is used up.
    n_granted: usize,
    /// Entries left of the current grant.
    n_left: usize,
    is_first: bool,
    is_over: bool,
}

impl<'r, 'a> Entries<'r, 'a> {
    /// The entries of a list whose beginning was read.
    #[inline(always)]
    pub(super) fn new(list: Value<'r, 'a>) -> Self {
        let Value { reader, source, list, depth } = list;
        let known_length = source.length();
        let lists = reader.context.lists;
        let max_length = lists.max_entries(list);
        // A row gets its first grant when it is created. A row of a table may be too long from the start.
        let fits = known_length.is_none_or(|length| length <= max_length);
        let n_granted = if list == List::ROW && fits { max_length.min(ENTRIES_PER_GRANT) } else { 0 };
        Self {
            reader,
            known_length,
            source_of_entry: source.of_entry(),
            list,
            list_of_entry: lists.of_entries(list),
            depth: depth + 1,
            max_length,
            n_granted,
            n_left: n_granted,
            is_first: true,
            is_over: false,
        }
    }

    /// Checks that no entry is left, since types of a fixed length read no more than that.
    pub(super) fn end(&mut self) -> Result<(), Error> {
        let has_more = !self.is_over && self.goes_on()?;
        if has_more { Err(Error::custom(LONGER_THAN_EXPECTED)) } else { Ok(()) }
    }

    /// Reads all entries, which are numbers. Replaces what is in `numbers`.
    #[inline(never)]
    pub(super) fn read_numbers(mut self, numbers: &mut Vec<f64>) -> Result<(), Error> {
        numbers.clear();
        while self.has_next()? {
            match self.number() {
                Ok(number) => numbers.push(number),
                Err(error) => return Err(self.reader.passed(self.length(), error)),
            }
            self.n_left -= 1;
        }
        Ok(())
    }

    /// Reads the next entry, which is a number.
    #[inline(always)]
    fn number(&mut self) -> Result<f64, Error> {
        match self.source_of_entry {
            Source::Text if self.reader.text.is_number() => self.reader.text.number(),
            _ => f64::deserialize(self.value()),
        }
    }

    /// Whether another entry is to be read. Entries beyond the limit are only counted.
    #[inline(always)]
    fn has_next(&mut self) -> Result<bool, Error> {
        if self.n_left == 0 && !self.is_granted_more()? {
            return self.count(None).map(|()| false);
        }
        match self.goes_on() {
            Ok(goes_on) => Ok(goes_on),
            Err(error) => Err(self.reader.passed(self.length(), error)),
        }
    }

    /// Number of entries read so far.
    fn length(&self) -> usize {
        self.n_granted - self.n_left
    }

    /// Whether another entry follows.
    #[inline(always)]
    fn goes_on(&mut self) -> Result<bool, Error> {
        let goes_on = match self.known_length {
            Some(length) => self.length() < length,
            None => self.reader.text.goes_on(b']', &mut self.is_first)?,
        };
        if !goes_on {
            self.is_over = true;
        }
        Ok(goes_on)
    }

    /// The value of the next entry.
    #[inline(always)]
    fn value(&mut self) -> Value<'_, 'a> {
        let (source, list) = (self.source_of_entry, self.list_of_entry);
        Value { reader: &mut *self.reader, source, list, depth: self.depth }
    }

    fn is_granted_more(&mut self) -> Result<bool, Error> {
        self.reader.tick()?;
        let n_free = self.max_length - self.n_granted;
        if self.known_length.is_some_and(|length| length > self.max_length) {
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
    fn count(&mut self, width: Option<usize>) -> Result<(), Error> {
        let length = match self.known_length {
            Some(length) => length,
            None => self.count_text()?,
        };
        self.is_over = true;
        if length <= self.max_length && width.is_none() {
            return Ok(());
        }
        // A row that is too long ends here. Its list goes on, so that all points are counted.
        if self.list == List::ROW {
            self.reader.too_wide = Some(length);
            return Ok(());
        }
        Err(self.reader.stopped(Stop::TooLarge(Excess { list: self.list, length, width })))
    }

    fn count_text(&mut self) -> Result<usize, Error> {
        let mut length = self.length();
        loop {
            if length.is_multiple_of(ENTRIES_PER_GRANT) {
                self.reader.tick()?;
            }
            match self.pass() {
                Ok(true) => length += 1,
                Ok(false) => return Ok(length),
                Err(error) => return Err(self.reader.passed(length, error)),
            }
        }
    }

    /// Skips an entry: a number or a row of numbers. Returns whether there was one.
    fn pass(&mut self) -> Result<bool, Error> {
        if !self.goes_on()? {
            return Ok(false);
        }
        let mut entry = Value { list: List::OTHER, ..self.value() };
        match entry.token()? {
            Token::Unsigned(_) | Token::Signed(_) | Token::Float(_) => {}
            Token::List => {
                let mut row = Entries::new(entry);
                while row.next_element::<f64>()?.is_some() {}
            }
            other => return Err(other.refused(&"a number or a list of numbers")),
        }
        Ok(true)
    }
}

impl<'a> SeqAccess<'a> for Entries<'_, 'a> {
    type Error = Error;

    #[inline(always)]
    fn next_element_seed<S: DeserializeSeed<'a>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        if !self.has_next()? {
            return Ok(None);
        }
        match seed.deserialize(self.value()) {
            Ok(entry) => {
                self.n_left -= 1;
                if self.list_of_entry == List::ROW
                    && let Some(width) = self.reader.too_wide.take()
                {
                    return self.count(Some(width)).map(|()| None);
                }
                Ok(Some(entry))
            }
            Err(error) => Err(self.reader.passed(self.length(), error)),
        }
    }

    /// Capped at the limit: callers reserve memory for this many entries.
    fn size_hint(&self) -> Option<usize> {
        let expected = match self.known_length {
            Some(length) => Some(length - self.length()),
            None if self.is_first => self.reader.text.expected_entries(),
            None => None,
        };
        expected.map(|length| length.min(self.max_length))
    }
}
