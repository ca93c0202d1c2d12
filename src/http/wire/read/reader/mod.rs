//! The deserializer of all requests, whatever the format of their body.
//!
//! A request is a JSON text, and beside it tables of numbers, of which members are made that the text lacks.
//! [`Value`] is the only deserializer, with one kind of list and one kind of object. So the code that serde
//! derives is compiled once per type, and not once per type and format.
//!
//! LIMITS. A list of numbers that exceeds its limit is counted to its end but not kept. It is then refused
//! with its actual length. Types that derive `Deserialize` cannot be told limits, so the reader knows each
//! list by its name. Two alternatives were rejected. Thread-local state would not show in the types. Checks
//! after parsing would come too late, because the memory is already taken.
//!
//! CANCELLATION. Every few thousand entries the reader asks the observer whether the request is cancelled.
//!
//! PATHS. An error collects member names and list positions on its way out. Requests without errors pay
//! nothing for this. (`serde_path_to_error` offers the same at the price of a second parse, and cannot do the
//! rest.)
//!
//! TEXT is shortened before a type sees it, because error messages repeat what they refuse. No valid name or
//! word is as long as the limit.
//!
//! SHAPES are those of the contract: members are present or absent but never null, structs are objects, and
//! enumerations are strings. serde alone would take null for absent, a list for a struct and an object for a
//! word.

mod entries;
mod object;
mod table;
mod text;
mod value;

use std::borrow::Cow;

use serde::de::{DeserializeOwned, Error as _};
use serde_json::Error;

use super::limits::{Excess, List, ParseContext};
use crate::http::problem::Problem;
pub(super) use table::{Named, Table};
use text::Text;
use value::{Source, Value};

/// Grants between two cancellation checks: some 100 µs of points.
const GRANTS_PER_CHECK: u32 = 16;

/// Longest text, in characters, that types see and that errors repeat to clients. No valid text is as long.
const MAX_SHOWN_CHARACTERS: usize = 200;

/// Deepest nesting of lists and objects, the limit of `serde_json`.
pub(super) const MAX_NESTING: usize = 128;

/// Reason for stopping a parse. It takes precedence over any other error of the request.
pub(super) enum Stop {
    Cancelled,
    TooLarge(Excess),
    /// The data of a table cannot be read.
    Malformed(Box<Problem>),
}

/// The place of a member that no request has: [`super::parse::WithOperation`].
enum Operation {
    /// The member is like any other.
    Shown,
    /// The member is kept from the request.
    Taken(Option<String>),
}

/// State of one parse.
pub(super) struct Reader<'a> {
    context: &'a ParseContext<'a>,
    text: Text<'a>,
    /// Those of an object stand side by side.
    tables: Vec<Named<'a>>,
    /// Whether lists of numbers are tables, and in the text only when they are empty.
    are_numbers_in_tables: bool,
    operation: Operation,
    grants_until_check: u32,
    /// Length of the row that was just read, if it has too many entries.
    too_wide: Option<usize>,
    stop: Option<Stop>,
    /// Path of the error, innermost segment first.
    path: Vec<String>,
}

impl<'a> Reader<'a> {
    /// A reader of a JSON document.
    pub(super) fn new(text: &'a [u8], context: &'a ParseContext<'a>) -> Self {
        Self {
            context,
            text: Text::new(text),
            tables: Vec::new(),
            are_numbers_in_tables: false,
            operation: Operation::Shown,
            grants_until_check: 0,
            too_wide: None,
            stop: None,
            path: Vec::new(),
        }
    }

    /// Adds the numbers of the request, which the text must not have then. Tables of the same object stand side
    /// by side.
    pub(super) fn with_tables(self, tables: Vec<Named<'a>>) -> Self {
        Self { tables, are_numbers_in_tables: true, ..self }
    }

    /// Keeps the member `operation` from the request.
    pub(super) fn without_operation(self) -> Self {
        Self { operation: Operation::Taken(None), ..self }
    }

    /// Reads the whole document.
    ///
    /// # Errors
    /// Returns the error of the type, or that of a text which is not JSON. [`Reader::into_failure`] says more
    /// about it.
    pub(super) fn read<T: DeserializeOwned>(&mut self) -> Result<T, Error> {
        let source = Source::Text(0..self.tables.len());
        let request = T::deserialize(Value { reader: self, source, list: List::Other, depth: 0 })?;
        self.text.end().map(|()| request)
    }

    /// The member `operation` that was kept from the request, if there was one.
    pub(super) fn into_operation(self) -> Option<String> {
        match self.operation {
            Operation::Shown => None,
            Operation::Taken(operation) => operation,
        }
    }

    /// What is known about the error after which the parse ended.
    pub(super) fn into_failure(self) -> Failure<'a> {
        let segments = self.path.iter().rev().map(|segment| segment.replace('~', "~0").replace('/', "~1"));
        let pointer = segments.flat_map(|segment| ["/".to_owned(), segment]).collect();
        Failure { stop: self.stop, pointer, flaw: self.text.flaw(), text: self.text.whole() }
    }

    /// Checks for cancellation now and then. Called before every grant of a list.
    fn tick(&mut self) -> Result<(), Error> {
        if self.grants_until_check > 0 {
            self.grants_until_check -= 1;
            return Ok(());
        }
        self.grants_until_check = GRANTS_PER_CHECK;
        if self.context.observer.is_cancelled() { Err(self.stopped(Stop::Cancelled)) } else { Ok(()) }
    }

    #[cold]
    fn stopped(&mut self, stop: Stop) -> Error {
        self.stop = Some(stop);
        Error::custom("stopped")
    }

    #[cold]
    fn passed(&mut self, segment: impl ToString, error: Error) -> Error {
        self.path.push(segment.to_string());
        error
    }

    /// Reads a number of a table.
    #[inline]
    fn number(&mut self, table: usize, row: usize, column: usize) -> Result<f64, Error> {
        match self.tables[table].table.number(row, column) {
            Ok(x) if x.is_finite() => Ok(x),
            Ok(x) => Err(Error::custom(format!("{x} is not finite"))),
            Err(problem) => Err(self.stopped(Stop::Malformed(problem))),
        }
    }
}

/// Why a parse failed, apart from the error itself.
pub(super) struct Failure<'a> {
    pub(super) stop: Option<Stop>,
    /// JSON Pointer to the error (RFC 6901): a slash before each segment, `~` written as `~0` and `/` as
    /// `~1`.
    pub(super) pointer: String,
    /// Why the text is not JSON, if the reader came upon it.
    pub(super) flaw: Option<String>,
    pub(super) text: &'a [u8],
}

/// Cuts a text after 200 characters: clients may send megabytes where a name or number belongs.
pub(super) fn shortened(text: Cow<'_, str>) -> Cow<'_, str> {
    match text.char_indices().nth(MAX_SHOWN_CHARACTERS) {
        None => text,
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
    }
}

#[cfg(test)]
mod tests;
