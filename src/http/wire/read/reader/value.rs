//! The deserializer of a value, from the text or from a table.

use std::ops::Range;

use serde::de::{Deserializer, Error as _, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::Error;

use super::entries::Entries;
use super::object::{GIVEN_TWICE, Members};
use super::table::Table;
use super::text::Token;
use super::{MAX_NESTING, Reader, shortened};
use crate::http::wire::read::limits::List;

const BELONGS_IN_A_TENSOR: &str = "numbers belong in tensors: send this list as one, named by its path such as cloud.points, \
                                   and not in the metadata entry request";

/// A value that is about to be read.
pub(super) struct Value<'r, 'a> {
    pub(super) reader: &'r mut Reader<'a>,
    pub(super) source: Source,
    /// Kind of list that the value is, if it is a list.
    pub(super) list: List,
    /// Lists and objects around the value.
    pub(super) depth: usize,
}

/// Where a value comes from.
pub(super) enum Source {
    /// The next value of the text, and the tables that belong into it if it is an object.
    Text(Range<usize>),
    /// An object that is not in the text and consists of tables.
    Tables(Range<usize>),
    /// A table, by its index.
    Table(usize),
    /// A row of a table: the indices of both.
    Row(usize, usize),
    /// A number of a table.
    Number(f64),
}

impl<'r, 'a> Value<'r, 'a> {
    /// Reads the value, or the beginning of a list or an object.
    pub(super) fn token(&mut self) -> Result<Token<'a>, Error> {
        let token = match &self.source {
            Source::Text(tables) => return self.token_of_text(tables.is_empty()),
            Source::Tables(_) => Token::Object,
            Source::Table(at) => match &self.reader.tables[*at].table {
                Table::Refused(reason) => return Err(Error::custom(reason)),
                Table::Tensor(_) | Table::Vertices(_) => Token::List,
            },
            Source::Row(..) => Token::List,
            Source::Number(x) => Token::Float(*x),
        };
        Ok(token)
    }

    fn token_of_text(&mut self, is_alone: bool) -> Result<Token<'a>, Error> {
        let Self { reader, list, depth, .. } = self;
        let token = reader.text.token()?;
        if matches!(token, Token::Object | Token::List) && *depth == MAX_NESTING {
            return Err(reader.text.fail("recursion limit exceeded"));
        }
        match token {
            Token::Object => return Ok(token),
            Token::List if reader.are_numbers_in_tables && *list != List::Other => {
                if reader.text.peek() != Some(b']') {
                    return Err(Error::custom(BELONGS_IN_A_TENSOR));
                }
            }
            _ => {}
        }
        // Tables belong into objects only.
        if !is_alone {
            return Err(Error::custom(GIVEN_TWICE));
        }
        Ok(match token {
            Token::String(string) => Token::String(shortened(string)),
            token => token,
        })
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
        match &self.source {
            Source::Number(x) => visitor.visit_f64(*x),
            Source::Text(tables) if tables.is_empty() && self.reader.text.is_number() => {
                visitor.visit_f64(self.reader.text.number()?)
            }
            _ => Err(self.token()?.refused(&visitor)),
        }
    }

    #[inline(always)]
    fn deserialize_seq<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        match self.token()? {
            Token::List => self.visit_list(visitor),
            other => Err(other.refused(&visitor)),
        }
    }

    /// Recognizes lists that are known by their type instead of their name.
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        let list = List::of_type(name).unwrap_or(self.list);
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
        if let Source::Text(_) = self.source {
            self.reader.text.skip()?;
        }
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf unit unit_struct
        tuple tuple_struct map identifier
    }
}
