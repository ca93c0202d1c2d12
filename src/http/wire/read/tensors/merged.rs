//! A deserializer that merges tensors into JSON text, so that both are read as one document.
//!
//! The members of an object are those of the text, followed by those that only exist as tensors. No
//! intermediate document is built, so a request takes no more memory than its numbers.

use serde::de::value::{MapDeserializer, SeqDeserializer, StrDeserializer};
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

use super::tensor::Node;
use crate::http::wire::read::limits::List;

/// A tensor and its path of member names, at least one.
pub(super) struct Named<'a> {
    pub(super) path: Vec<&'a str>,
    pub(super) node: Node<'a>,
}

const GIVEN_TWICE: &str =
    "this is given twice: as a tensor, and as another tensor or a field of the metadata entry request";
const BELONGS_IN_A_TENSOR: &str = "numbers belong in tensors: send this list as one, named by its path such as cloud.points, \
                                   and not in the metadata entry request";

/// A value of the text, and the tensors that belong into it if it is an object.
pub(super) struct Merged<'t, D> {
    text: D,
    tensors: Vec<&'t Named<'t>>,
    /// Length of the path to this value.
    depth: usize,
    /// Whether this value is a numeric list, which must be sent as a tensor unless it is empty.
    is_tensor: bool,
}

impl<'t, D> Merged<'t, D> {
    /// Merges the tensors into a whole document.
    pub(super) fn new(text: D, tensors: &'t [Named<'t>]) -> Self {
        Self { text, tensors: tensors.iter().collect(), depth: 0, is_tensor: false }
    }
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Merged<'_, D> {
    type Error = D::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        let Self { text, tensors, depth, is_tensor } = self;
        text.deserialize_any(Merge { visitor, tensors, depth, is_tensor })
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// A seed that deserializes its value from a [`Merged`].
struct Within<'t, S> {
    seed: S,
    tensors: Vec<&'t Named<'t>>,
    depth: usize,
    is_tensor: bool,
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Within<'_, S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, text: D) -> Result<S::Value, D::Error> {
        let Self { seed, tensors, depth, is_tensor } = self;
        seed.deserialize(Merged { text, tensors, depth, is_tensor })
    }
}

/// A visitor that also shows the tensors to the visitor of the type.
struct Merge<'t, V> {
    visitor: V,
    tensors: Vec<&'t Named<'t>>,
    depth: usize,
    is_tensor: bool,
}

impl<V> Merge<'_, V> {
    /// Returns the visitor for a value that is not an object. Fails if there are tensors, because none can
    /// belong into it.
    fn alone<E: Error>(self) -> Result<V, E> {
        if self.tensors.is_empty() { Ok(self.visitor) } else { Err(E::custom(GIVEN_TWICE)) }
    }
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Merge<'_, V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.visitor.expecting(f)
    }

    fn visit_bool<E: Error>(self, x: bool) -> Result<V::Value, E> {
        self.alone()?.visit_bool(x)
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<V::Value, E> {
        self.alone()?.visit_i64(x)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<V::Value, E> {
        self.alone()?.visit_u64(x)
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<V::Value, E> {
        self.alone()?.visit_f64(x)
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.alone()?.visit_unit()
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<V::Value, E> {
        self.alone()?.visit_str(text)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<V::Value, A::Error> {
        if !self.is_tensor {
            return self.alone()?.visit_seq(entries);
        }
        if entries.next_element::<IgnoredAny>()?.is_some() {
            return Err(A::Error::custom(BELONGS_IN_A_TENSOR));
        }
        self.alone()?.visit_seq(SeqDeserializer::new(std::iter::empty::<f64>()))
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<V::Value, A::Error> {
        let Self { visitor, tensors, depth, .. } = self;
        let of_name = (Vec::new(), false);
        visitor.visit_map(Members { text: Some(members), tensors, depth, of_name })
    }
}

/// The members of an object, from the text and from the tensors.
struct Members<'t, A> {
    /// `None` after the last member of the text.
    text: Option<A>,
    /// Tensors whose member has not been reached yet.
    tensors: Vec<&'t Named<'t>>,
    depth: usize,
    /// Tensors that belong to the current member, and whether the member is a numeric list.
    of_name: (Vec<&'t Named<'t>>, bool),
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Members<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        let mut name = match &mut self.text {
            Some(text) => text.next_key::<String>()?,
            None => None,
        };
        if name.is_none() {
            self.text = None;
            name = self.tensors.first().map(|tensor| tensor.path[self.depth].to_owned());
        }
        let Some(name) = name else { return Ok(None) };
        let belongs = |tensor: &&Named<'_>| tensor.path[self.depth] == name;
        let (of_name, others) = std::mem::take(&mut self.tensors).into_iter().partition(belongs);
        self.tensors = others;
        self.of_name = (of_name, List::named(&name) != List::Other);
        seed.deserialize(StrDeserializer::new(&name)).map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        let depth = self.depth + 1;
        let (tensors, is_tensor) = std::mem::take(&mut self.of_name);
        let leaf = tensors.iter().find(|tensor| tensor.path.len() == depth);
        match (&mut self.text, leaf) {
            (None, Some(leaf)) if tensors.len() == 1 => {
                seed.deserialize(&leaf.node).map_err(A::Error::custom)
            }
            (_, Some(_)) => Err(A::Error::custom(GIVEN_TWICE)),
            (Some(text), None) => text.next_value_seed(Within { seed, tensors, depth, is_tensor }),
            (None, None) => {
                let text = MapDeserializer::new(std::iter::empty::<(&str, f64)>());
                seed.deserialize(Merged { text, tensors, depth, is_tensor: false })
            }
        }
    }
}
