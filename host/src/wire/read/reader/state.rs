//! The state of one parse.

use serde::de::Error as _;
use serde_json::Error;

use super::source::Source;
use super::table::{Block, NamedTable};
use super::text::Text;
use crate::problem::Problem;
use crate::wire::read::limits::{Excess, ParseContext};

/// Grants between two cancellation checks: some 100 µs of points.
const GRANTS_PER_CHECK: u32 = 16;

/// Reason for stopping a parse. It takes precedence over any other error of the request.
pub enum Stop {
    Cancelled,
    TooLarge(Excess),
    /// The data of a table cannot be read.
    Malformed(Box<Problem>),
}

/// The member `operation`, which some bodies have beside those of their request.
pub(super) enum Operation {
    /// The member is like any other.
    Shown,
    /// The member is kept from the request.
    Taken(Option<String>),
}

/// State of one parse.
pub struct Reader<'a> {
    pub(super) context: &'a ParseContext<'a>,
    pub(super) text: Text<'a>,
    /// Those of an object stand side by side.
    pub(super) tables: Vec<NamedTable<'a>>,
    /// Index of the table that is being read, and numbers of it.
    table: usize,
    block: Block,
    /// Whether lists of numbers are tables, and in the text only when they are empty.
    pub(super) are_numbers_in_tables: bool,
    pub(super) operation: Operation,
    grants_until_check: u32,
    /// Room for the numbers of a row.
    pub(super) row: Vec<f64>,
    /// Length of the row that was just read, if it has too many entries.
    pub(super) too_wide: Option<usize>,
    stop: Option<Stop>,
    /// Path of the error, innermost segment first.
    path: Vec<String>,
}

impl<'a> Reader<'a> {
    /// A reader of a JSON document.
    pub fn new(text: &'a [u8], context: &'a ParseContext<'a>) -> Self {
        Self {
            context,
            text: Text::new(text),
            tables: Vec::new(),
            table: 0,
            block: Block::EMPTY,
            are_numbers_in_tables: false,
            operation: Operation::Shown,
            grants_until_check: 0,
            row: Vec::new(),
            too_wide: None,
            stop: None,
            path: Vec::new(),
        }
    }

    /// Adds the numbers of the request, which the text must not have then. Tables of the same object stand
    /// side by side.
    pub fn with_tables(self, tables: Vec<NamedTable<'a>>) -> Self {
        Self { tables, are_numbers_in_tables: true, ..self }
    }

    /// Keeps the member `operation` from the request.
    pub fn without_operation(self) -> Self {
        Self { operation: Operation::Taken(None), ..self }
    }

    /// The member `operation` that was kept from the request, if there was one.
    pub fn into_operation(self) -> Option<String> {
        match self.operation {
            Operation::Shown => None,
            Operation::Taken(operation) => operation,
        }
    }

    /// What is known about the error after which the parse ended.
    pub fn into_failure(self) -> Failure<'a> {
        let segments = self.path.iter().rev().map(|segment| segment.replace('~', "~0").replace('/', "~1"));
        let pointer = segments.flat_map(|segment| ["/".to_owned(), segment]).collect();
        Failure { stop: self.stop, pointer, flaw: self.text.flaw(), text: self.text.whole() }
    }

    /// Checks for cancellation now and then. Called before every grant of a list.
    pub(super) fn tick(&mut self) -> Result<(), Error> {
        if self.grants_until_check > 0 {
            self.grants_until_check -= 1;
            return Ok(());
        }
        self.grants_until_check = GRANTS_PER_CHECK;
        if self.context.observer.is_cancelled() { Err(self.stopped(Stop::Cancelled)) } else { Ok(()) }
    }

    #[cold]
    pub(super) fn stopped(&mut self, stop: Stop) -> Error {
        self.stop = Some(stop);
        Error::custom("stopped")
    }

    #[cold]
    pub(super) fn passed(&mut self, segment: impl ToString, error: Error) -> Error {
        self.path.push(segment.to_string());
        error
    }

    /// Starts to read a table. Returns it as a list.
    pub(super) fn open(&mut self, table: usize) -> Result<Source, Error> {
        (self.table, self.block) = (table, Block::EMPTY);
        match &self.tables[table].table {
            Ok(table) => Ok(Source::List { length: table.length(), width: table.width() }),
            Err(reason) => Err(Error::custom(reason)),
        }
    }

    /// Reads the next number of the table.
    #[inline]
    pub(super) fn number(&mut self) -> Result<f64, Error> {
        let x = match self.block.next() {
            Some(x) => x,
            None => self.number_of_next_block()?,
        };
        if x.is_finite() { Ok(x) } else { Err(not_finite(x)) }
    }

    #[inline(never)]
    fn number_of_next_block(&mut self) -> Result<f64, Error> {
        let filled = match &mut self.tables[self.table].table {
            Ok(table) => self.block.fill(table.as_mut()),
            Err(_) => Ok(()),
        };
        match filled {
            // NaN stands for numbers beyond the end.
            Ok(()) => Ok(self.block.next().unwrap_or(f64::NAN)),
            Err(problem) => Err(self.stopped(Stop::Malformed(problem))),
        }
    }
}

#[cold]
fn not_finite(x: f64) -> Error {
    Error::custom(format!("{x} is not finite"))
}

/// Why a parse failed, apart from the error itself.
pub struct Failure<'a> {
    pub stop: Option<Stop>,
    /// JSON Pointer to the error (RFC 6901): a slash before each segment, `~` written as `~0` and `/` as
    /// `~1`.
    pub pointer: String,
    /// Why the text is not JSON, if the reader came upon it.
    pub flaw: Option<String>,
    pub text: &'a [u8],
}
