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
mod source;
mod state;
mod table;
mod text;

use std::borrow::Cow;

use serde::de::{DeserializeOwned, Deserializer, Error as _, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::Error;

use super::limits::List;
use entries::Entries;
use object::{GIVEN_TWICE, Members};
use source::{Source, Tables};
pub use state::{Reader, Stop};
pub use table::{Given, NamedTable, Table};
use text::Token;

/// Longest text, in characters, that types see and that errors repeat to clients. No valid text is as long.
const MAX_SHOWN_CHARACTERS: usize = 200;

/// Deepest nesting of lists and objects, the limit of `serde_json`.
pub const MAX_NESTING: usize = 128;

const BELONGS_IN_A_TENSOR: &str = "numbers belong in tensors: send this list as one, named by its path such as cloud.points, \
                                   and not in the metadata entry request";

/// Reads a whole document.
///
/// # Errors
/// Returns the error of the type, or that of a text which is not JSON. [`Reader::into_failure`] says more
/// about it.
pub fn read<T: DeserializeOwned>(reader: &mut Reader<'_>) -> Result<T, Error> {
    let source = Source::TextAndTables(Tables { start: 0, end: reader.tables.len() });
    let request = T::deserialize(Value { reader, source, list: List::OTHER, depth: 0 })?;
    reader.text.end().map(|()| request)
}

/// A value that is about to be read.
struct Value<'r, 'a> {
    reader: &'r mut Reader<'a>,
    source: Source,
    /// Kind of list that the value is, if it is a list.
    list: List,
    /// Lists and objects around the value.
    depth: usize,
}

impl<'r, 'a> Value<'r, 'a> {
    /// Reads the value, or the beginning of a list or an object.
    fn token(&mut self) -> Result<Token<'a>, Error> {
        match self.source {
            Source::Text => self.token_of_text(Tables::NONE),
            Source::TextAndTables(tables) => self.token_of_text(tables),
            Source::Tables(_) => Ok(Token::Object),
            Source::List { .. } => Ok(Token::List),
            Source::Number => self.reader.number().map(Token::Float),
        }
    }

    fn token_of_text(&mut self, tables: Tables) -> Result<Token<'a>, Error> {
        let Self { reader, list, depth, .. } = self;
        let token = reader.text.token()?;
        if matches!(token, Token::Object | Token::List) && *depth == MAX_NESTING {
            return Err(reader.text.fail("recursion limit exceeded"));
        }
        match token {
            Token::Object => return Ok(token),
            Token::List
                if reader.are_numbers_in_tables
                    && *list != List::OTHER
                    && reader.text.peek() != Some(b']') =>
            {
                return Err(Error::custom(BELONGS_IN_A_TENSOR));
            }
            _ => {}
        }
        // Tables belong into objects only.
        if tables.start < tables.end {
            return Err(Error::custom(GIVEN_TWICE));
        }
        Ok(match token {
            Token::String(string) => Token::String(shortened(string)),
            token => token,
        })
    }

    /// Reads the beginning of a list, if it is a list that belongs here. A shortcut for the rows of points.
    #[inline(always)]
    fn opens_list(&mut self) -> bool {
        match self.source {
            Source::List { .. } => true,
            Source::Text if self.depth < MAX_NESTING && !self.reader.are_numbers_in_tables => {
                self.reader.text.opens_list()
            }
            Source::Text | Source::TextAndTables(_) | Source::Tables(_) | Source::Number => false,
        }
    }

    /// Shows the list whose beginning was read to a visitor.
    #[inline(always)]
    fn visit_list<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Error> {
        let mut entries = Entries::new(self);
        let list = visitor.visit_seq(&mut entries)?;
        entries.end().map(|()| list)
    }
}

impl<'de> Deserializer<'de> for Value<'_, 'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        match self.token()? {
            Token::Object => visitor.visit_map(Members::new(self)),
            Token::List => self.visit_list(visitor),
            Token::String(string) => visitor.visit_str(&string),
            Token::Bool(x) => visitor.visit_bool(x),
            Token::Null => visitor.visit_unit(),
            Token::Unsigned(x) => visitor.visit_u64(x),
            Token::Signed(x) => visitor.visit_i64(x),
            Token::Float(x) => visitor.visit_f64(x),
        }
    }

    #[inline(always)]
    fn deserialize_f64<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        match self.source {
            Source::Text if self.reader.text.is_number() => visitor.visit_f64(self.reader.text.number()?),
            Source::Number => visitor.visit_f64(self.reader.number()?),
            _ => Err(self.token()?.refused(&visitor)),
        }
    }

    #[inline(always)]
    fn deserialize_seq<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        if self.opens_list() {
            return self.visit_list(visitor);
        }
        match self.token()? {
            Token::List => self.visit_list(visitor),
            other => Err(other.refused(&visitor)),
        }
    }

    /// Shows the numbers of a row in one piece, as the bytes of f64, and any other list entry by entry. The
    /// numbers are read by code that does not depend on the visitor and so is compiled here, not with the
    /// types of the service.
    #[inline(always)]
    fn deserialize_bytes<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        if !self.opens_list() {
            match self.token()? {
                Token::List => {}
                other => return Err(other.refused(&visitor)),
            }
        }
        if self.list != List::ROW {
            return self.visit_list(visitor);
        }
        let Value { reader, source, list, depth } = self;
        let mut numbers = std::mem::take(&mut reader.row);
        Entries::new(Value { reader: &mut *reader, source, list, depth }).read_numbers(&mut numbers)?;
        let shown = visitor.visit_bytes(bytemuck::cast_slice(&numbers))?;
        reader.row = numbers;
        Ok(shown)
    }

    /// Recognizes lists that are known by their type instead of their name.
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        let list = self.reader.context.lists.of_type(name).unwrap_or(self.list);
        visitor.visit_newtype_struct(Value { list, ..self })
    }

    /// A member that is there has a value: null is refused by the type that the option holds.
    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_some(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        mut self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.token()? {
            Token::Object => visitor.visit_map(Members::new(self)),
            other => Err(other.refused(&"an object")),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        mut self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.token()? {
            Token::String(word) => visitor.visit_enum((&*word).into_deserializer()),
            other => Err(other.refused(&"a string")),
        }
    }

    /// Skips a value without limits, because nothing of it is kept.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.source {
            Source::Text | Source::TextAndTables(_) => self.reader.text.skip()?,
            Source::Tables(_) => {}
            Source::List { .. } | Source::Number => return self.deserialize_any(visitor),
        }
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string byte_buf unit unit_struct
        tuple tuple_struct map identifier
    }
}

/// Cuts a text after 200 characters: clients may send megabytes where a name or number belongs.
pub fn shortened(text: Cow<'_, str>) -> Cow<'_, str> {
    match text.char_indices().nth(MAX_SHOWN_CHARACTERS) {
        None => text,
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
    }
}

#[cfg(test)]
mod tests;
