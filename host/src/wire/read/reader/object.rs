//! The members of an object: those of the text, followed by those that only exist as tables.
//!
//! No intermediate document is built, so a request takes no more memory than its numbers.

use std::borrow::Cow;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Error as _, MapAccess};
use serde_json::Error;

use super::source::{Source, Tables};
use super::state::{Operation, Reader};
use super::table::NamedTable;
use super::{Value, shortened};

/// Name of the member that a request can have beside its own.
const OPERATION: &str = "operation";

pub(super) const GIVEN_TWICE: &str =
    "this is given twice: as a tensor, and as another tensor or a field of the metadata entry request";

/// The members of an object, each read as the list that its name stands for.
pub(super) struct Members<'r, 'a> {
    reader: &'r mut Reader<'a>,
    /// Whether the text may have further members.
    is_in_text: bool,
    is_first: bool,
    /// The tables of the object.
    tables: Tables,
    /// Lists and objects around this one.
    depth: usize,
    /// The current member: its name, and the tables that belong to it.
    name: Cow<'a, str>,
    of_name: Tables,
}

impl<'r, 'a> Members<'r, 'a> {
    /// The members of an object whose beginning was read.
    pub(super) fn new(object: Value<'r, 'a>) -> Self {
        let Value { reader, source, depth, .. } = object;
        let (is_in_text, tables) = match source {
            Source::TextAndTables(tables) => (true, tables),
            Source::Tables(tables) => (false, tables),
            Source::Text | Source::List { .. } | Source::Number => (true, Tables::NONE),
        };
        let (name, of_name) = (Cow::Borrowed(""), Tables::NONE);
        Self { reader, is_in_text, is_first: true, tables, depth, name, of_name }
    }

    /// Goes on to the next member that the type may see. Returns whether there is one.
    fn advance(&mut self) -> Result<bool, Error> {
        while self.next_name()? {
            let is_taken = matches!(self.reader.operation, Operation::Taken(_));
            if !is_taken || self.depth > 0 || self.name != OPERATION {
                return Ok(true);
            }
            let found = Operation::Taken(Some(self.next_value()?));
            if let Operation::Taken(Some(_)) = std::mem::replace(&mut self.reader.operation, found) {
                return Err(Error::duplicate_field(OPERATION));
            }
        }
        Ok(false)
    }

    fn next_name(&mut self) -> Result<bool, Error> {
        self.is_in_text = self.is_in_text && self.reader.text.goes_on(b'}', &mut self.is_first)?;
        let tables = &mut self.reader.tables[self.tables.start..self.tables.end];
        let name = if self.is_in_text {
            self.reader.text.name()?
        } else {
            let next = tables.iter().find_map(|table| table.name_at(self.depth));
            let Some(name) = next else { return Ok(false) };
            Cow::Owned(name.to_owned())
        };
        let is_of_name = |table: &NamedTable<'_>| table.name_at(self.depth) == Some(&name);
        let start = self.tables.start + tables.iter().take_while(|table| !is_of_name(table)).count();
        let n = tables.iter_mut().filter(|table| is_of_name(table)).map(NamedTable::reach).count();
        self.of_name = Tables { start, end: start + n };
        self.name = shortened(name);
        Ok(true)
    }

    /// Where the value of the current member comes from.
    fn source(&mut self) -> Result<Source, Error> {
        let Tables { start, end } = self.of_name;
        let is_table = |table: &NamedTable<'_>| table.path.len() == self.depth + 1;
        match (self.is_in_text, self.reader.tables[start..end].iter().any(is_table)) {
            (false, true) if end == start + 1 => self.reader.open(start),
            (_, true) => Err(Error::custom(GIVEN_TWICE)),
            (true, false) if start == end => Ok(Source::Text),
            (true, false) => Ok(Source::TextAndTables(self.of_name)),
            (false, false) => Ok(Source::Tables(self.of_name)),
        }
    }
}

impl<'a> MapAccess<'a> for Members<'_, 'a> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        if !self.advance()? {
            return Ok(None);
        }
        let key = seed.deserialize(StrDeserializer::new(&self.name));
        key.map(Some).map_err(|error: Error| self.reader.passed(&self.name, error))
    }

    fn next_value_seed<S: DeserializeSeed<'a>>(&mut self, seed: S) -> Result<S::Value, Error> {
        let (list, depth) = (self.reader.context.lists.named(&self.name), self.depth + 1);
        let value = self
            .source()
            .and_then(|source| seed.deserialize(Value { reader: &mut *self.reader, source, list, depth }));
        value.map_err(|error| self.reader.passed(&self.name, error))
    }
}
