//! A deserializer that wraps another one and guards what passes through it.
//!
//! LIMITS. A list of numbers that exceeds its limit is counted to its end but not kept. It is then refused
//! with its actual length. Types that derive `Deserialize` cannot be told limits, so the deserializer knows
//! each list by its name. Two alternatives were rejected. Thread-local state would not show in the types.
//! Checks after parsing would come too late, because the memory is already taken.
//!
//! CANCELLATION. Every few thousand entries the guard asks the observer whether the request is cancelled.
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
mod shapes;

use std::borrow::Cow;
use std::cell::{Cell, RefCell};

use serde::de::value::StrDeserializer;
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

use super::limits::{Excess, List, ParseContext};
use entries::Entries;
use shapes::{Object, Word};

/// Grants between two cancellation checks: some 100 µs of points.
const GRANTS_PER_CHECK: u32 = 16;

/// Longest text, in characters, that types see and that errors repeat to clients. No valid text is as long.
const MAX_SHOWN_CHARACTERS: usize = 200;

/// Reason for stopping a parse. It takes precedence over any other error of the request.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stop {
    Cancelled,
    TooLarge(Excess),
}

/// State shared by all guarded parts of one parse.
pub(super) struct Guard<'c> {
    context: &'c ParseContext<'c>,
    grants_until_check: Cell<u32>,
    stop: Cell<Option<Stop>>,
    /// Length of the row that was just read, if it has too many entries.
    too_wide: Cell<Option<usize>>,
    /// Path of the error, innermost segment first.
    /// Whether the inner deserializer is only asked for `any`, see [`Guard::asking_for_any`].
    path: RefCell<Vec<String>>,
    asks_for_any: bool,
}

impl<'c> Guard<'c> {
    pub(super) fn new(context: &'c ParseContext<'c>) -> Self {
        Self {
            context,
            grants_until_check: Cell::new(0),
            stop: Cell::new(None),
            too_wide: Cell::new(None),
            path: RefCell::default(),
            asks_for_any: false,
        }
    }

    /// Creates a guard that asks the inner deserializer for any type instead of a specific one.
    ///
    /// Needed for deserializers that word type errors themselves: their messages would repeat a text of any
    /// length.
    pub(super) fn asking_for_any(context: &'c ParseContext<'c>) -> Self {
        Self { asks_for_any: true, ..Self::new(context) }
    }

    /// Wraps the deserializer of a request.
    pub(super) fn around<D>(&self, inner: D) -> Guarded<'_, D> {
        Guarded { inner, guard: self, list: List::Other }
    }

    /// The reason why the parse was stopped, or `None` if it failed for another reason or not at all.
    pub(super) fn stop(&self) -> Option<Stop> {
        self.stop.get()
    }

    /// JSON Pointer to the error (RFC 6901): a slash before each segment, `~` written as `~0` and `/` as
    /// `~1`.
    pub(super) fn pointer(&self) -> String {
        let path = self.path.borrow();
        let segments = path.iter().rev().map(|segment| segment.replace('~', "~0").replace('/', "~1"));
        segments.flat_map(|segment| ["/".to_owned(), segment]).collect()
    }

    /// Checks for cancellation now and then. Called before every grant of a list.
    fn tick<E: Error>(&self) -> Result<(), E> {
        let n_left = self.grants_until_check.get();
        if n_left > 0 {
            self.grants_until_check.set(n_left - 1);
            return Ok(());
        }
        self.grants_until_check.set(GRANTS_PER_CHECK);
        if self.context.observer.is_cancelled() { Err(self.stopped(Stop::Cancelled)) } else { Ok(()) }
    }

    #[cold]
    fn stopped<E: Error>(&self, stop: Stop) -> E {
        self.stop.set(Some(stop));
        E::custom("stopped")
    }

    #[cold]
    fn passed<E>(&self, segment: impl ToString, error: E) -> E {
        self.path.borrow_mut().push(segment.to_string());
        error
    }
}

/// A deserializer under guard.
pub(super) struct Guarded<'g, D> {
    inner: D,
    guard: &'g Guard<'g>,
    /// Kind of list that the value is, if it is a list.
    list: List,
}

impl<'g, D> Guarded<'g, D> {
    fn watch<V>(&self, visitor: V) -> Watched<'g, V> {
        Watched { visitor, guard: self.guard, list: self.list }
    }
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Guarded<'_, D> {
    type Error = D::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        let visitor = self.watch(visitor);
        self.inner.deserialize_any(visitor)
    }

    #[inline]
    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        if self.guard.asks_for_any {
            return self.deserialize_any(visitor);
        }
        let visitor = self.watch(visitor);
        self.inner.deserialize_f64(visitor)
    }

    /// Recognizes lists that are known by their type instead of their name.
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        let list = List::of_type(name).unwrap_or(self.list);
        Guarded { list, ..self }.deserialize_any(visitor)
    }

    /// Skips a value without a guard. All that matters is that the inner deserializer does not recurse.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_ignored_any(visitor)
    }

    /// A member that is there has a value: null is refused by the type that the option holds.
    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        visitor.visit_some(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.deserialize_any(Object(visitor))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.deserialize_any(Word(visitor))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf unit unit_struct seq
        tuple tuple_struct map identifier
    }
}

/// A visitor that guards lists and objects and shortens texts.
struct Watched<'g, V> {
    visitor: V,
    guard: &'g Guard<'g>,
    list: List,
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Watched<'_, V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.visitor.expecting(f)
    }

    fn visit_bool<E: Error>(self, x: bool) -> Result<V::Value, E> {
        self.visitor.visit_bool(x)
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<V::Value, E> {
        self.visitor.visit_i64(x)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<V::Value, E> {
        self.visitor.visit_u64(x)
    }

    #[inline]
    fn visit_f64<E: Error>(self, x: f64) -> Result<V::Value, E> {
        self.visitor.visit_f64(x)
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.visitor.visit_unit()
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<V::Value, E> {
        self.visitor.visit_str(&shortened(text))
    }

    #[inline]
    fn visit_seq<A: SeqAccess<'de>>(self, entries: A) -> Result<V::Value, A::Error> {
        let Self { visitor, guard, list } = self;
        // Plain numbers need no guard of their own, unless the deserializer must be asked for `any`. This
        // saves a tenth of the time.
        if matches!(list, List::Coordinates | List::Numbers) && !guard.asks_for_any {
            visitor.visit_seq(Entries::<_, true>::new(entries, guard, list))
        } else {
            visitor.visit_seq(Entries::<_, false>::new(entries, guard, list))
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<V::Value, A::Error> {
        self.visitor.visit_map(Members { inner: members, guard: self.guard, name: Cow::Borrowed("") })
    }
}

/// A seed that deserializes its value under guard.
struct Seed<'g, S> {
    seed: S,
    guard: &'g Guard<'g>,
    list: List,
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Seed<'_, S> {
    type Value = S::Value;

    #[inline]
    fn deserialize<D: Deserializer<'de>>(self, inner: D) -> Result<S::Value, D::Error> {
        let Self { seed, guard, list } = self;
        seed.deserialize(Guarded { inner, guard, list })
    }
}

/// The members of an object, each guarded as the list that its name stands for.
struct Members<'g, 'de, A> {
    inner: A,
    guard: &'g Guard<'g>,
    name: Cow<'de, str>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Members<'_, 'de, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        let Some(Name(name)) = self.inner.next_key()? else { return Ok(None) };
        self.name = name;
        let key = seed.deserialize(StrDeserializer::new(&self.name));
        key.map(Some).map_err(|error| self.guard.passed(&self.name, error))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        let seed = Seed { seed, guard: self.guard, list: List::named(&self.name) };
        self.inner.next_value_seed(seed).map_err(|error| self.guard.passed(&self.name, error))
    }
}

/// A member name, shortened.
struct Name<'de>(Cow<'de, str>);

impl<'de> Deserialize<'de> for Name<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameVisitor;

        impl<'de> Visitor<'de> for NameVisitor {
            type Value = Name<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a name")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Name<'de>, E> {
                Ok(Name(Cow::Owned(shortened(name).into_owned())))
            }

            fn visit_borrowed_str<E: Error>(self, name: &'de str) -> Result<Name<'de>, E> {
                Ok(Name(shortened(name)))
            }
        }

        deserializer.deserialize_str(NameVisitor)
    }
}

/// Cuts a text after 200 characters: clients may send megabytes where a name or number belongs.
pub(super) fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(MAX_SHOWN_CHARACTERS) {
        None => Cow::Borrowed(text),
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
    }
}
