//! Deserializers for members of requests. Members are present or absent but never null. Objects and
//! enumerations accept only objects and strings.

use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, IntoDeserializer, MapAccess, Visitor};

use super::points::Points;

/// Deserializes an optional member: `None` if absent, while the type itself refuses null.
///
/// # Errors
/// Returns the errors of the type.
pub fn present<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

/// Lists that count as absent when they are empty.
pub trait List {
    fn is_empty(&self) -> bool;
}

impl List for Vec<f64> {
    fn is_empty(&self) -> bool {
        self.as_slice().is_empty()
    }
}

impl List for Points {
    fn is_empty(&self) -> bool {
        self.n_rows == 0
    }
}

/// Deserializes an optional list, where an empty list counts as absent.
///
/// Meant for lists that make no sense when empty: generated clients send `[]` for what their user left out.
///
/// # Errors
/// Returns the errors of the type.
pub fn present_unless_empty<'de, T, D>(deserializer: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de> + List,
    D: Deserializer<'de>,
{
    T::deserialize(deserializer).map(|list| Some(list).filter(|list| !list.is_empty()))
}

/// Deserializes an object and nothing else. serde would also accept an array of the members in order, which
/// is not part of the contract.
///
/// # Errors
/// Returns the errors of the type, and refuses anything that is not an object.
pub fn object<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    struct ObjectVisitor<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
        type Value = T;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("an object")
        }

        fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<T, A::Error> {
            T::deserialize(MapAccessDeserializer::new(members))
        }
    }

    deserializer.deserialize_map(ObjectVisitor(PhantomData))
}

/// [`object`] for optional members.
///
/// # Errors
/// Returns the errors of [`object`].
pub fn present_object<'de, T, D>(deserializer: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de>,
    D: Deserializer<'de>,
{
    object(deserializer).map(Some)
}

/// An enumeration given as a string and nothing else. serde would also accept `{"dense": null}`, and
/// `serde_json` calls other types a syntax error.
struct Word<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Word<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WordVisitor<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for WordVisitor<T> {
            type Value = Word<T>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a string")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Word<T>, E> {
                T::deserialize(word.into_deserializer()).map(Word)
            }
        }

        deserializer.deserialize_str(WordVisitor(PhantomData))
    }
}

/// Deserializes an enumeration.
///
/// # Errors
/// Refuses anything but one of its strings.
pub fn word<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    Word::deserialize(deserializer).map(|Word(word)| word)
}

/// [`word`] for optional members.
///
/// # Errors
/// Returns the errors of [`word`].
pub fn present_word<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    word(deserializer).map(Some)
}

/// [`word`] for optional lists.
///
/// # Errors
/// Returns the errors of [`word`], with the position in the list.
pub fn present_words<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Vec<T>>, D::Error> {
    let words = Vec::<Word<T>>::deserialize(deserializer)?;
    Ok(Some(words.into_iter().map(|Word(word)| word).collect()))
}
