//! A request with the additional member `operation`.

use std::cell::Cell;
use std::fmt;
use std::marker::PhantomData;

use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

/// Name of the additional member.
const OPERATION: &str = "operation";

/// A request `T` with an optional member `operation` beside the members of `T`.
#[derive(Debug)]
pub struct WithOperation<T> {
    pub operation: Option<String>,
    pub request: T,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for WithOperation<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(RequestVisitor(PhantomData))
    }
}

struct RequestVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for RequestVisitor<T> {
    type Value = WithOperation<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<WithOperation<T>, A::Error> {
        let operation = Cell::new(None);
        let request = T::deserialize(MapAccessDeserializer::new(Without { map, operation: &operation }))?;
        Ok(WithOperation { operation: operation.into_inner(), request })
    }
}

/// The members of the request other than `operation`, which is stored in the cell.
struct Without<'a, A> {
    map: A,
    operation: &'a Cell<Option<String>>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Without<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, mut seed: K) -> Result<Option<K::Value>, A::Error> {
        loop {
            seed = match self.map.next_key_seed(Key(seed))? {
                None => return Ok(None),
                Some(Found::Member(key)) => return Ok(Some(key)),
                Some(Found::Operation(seed)) => seed,
            };
            let found = self.map.next_value::<String>()?;
            if self.operation.replace(Some(found)).is_some() {
                return Err(A::Error::duplicate_field(OPERATION));
            }
        }
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

/// A seed for a member name. It wraps the seed of the type, so that errors about a name carry its position.
struct Key<K>(K);

/// Result of reading a name. `Operation` returns the unused seed, for the next name.
enum Found<K, V> {
    Operation(K),
    Member(V),
}

impl<'de, K: DeserializeSeed<'de>> DeserializeSeed<'de> for Key<K> {
    type Value = Found<K, K::Value>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl<'de, K: DeserializeSeed<'de>> Visitor<'de> for Key<K> {
    type Value = Found<K, K::Value>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a name")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        match name {
            OPERATION => Ok(Found::Operation(self.0)),
            _ => self.0.deserialize(StrDeserializer::new(name)).map(Found::Member),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde::de::IgnoredAny;

    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Request {
        alpha: f64,
    }

    fn read(text: &str) -> Result<(Option<String>, f64), String> {
        let read = serde_json::from_str::<WithOperation<Request>>(text);
        read.map(|read| (read.operation, read.request.alpha)).map_err(|error| error.to_string())
    }

    #[test]
    fn the_operation_may_stand_anywhere_and_once() {
        let named = Some("normals".to_owned());
        assert_eq!(read(r#"{"operation": "normals", "alpha": 2}"#), Ok((named.clone(), 2.0)));
        assert_eq!(read(r#"{"alpha": 2, "operation": "normals"}"#), Ok((named, 2.0)));
        assert_eq!(read(r#"{"alpha": 2}"#), Ok((None, 2.0)));
        for (text, told) in [
            (r#"{"operation": "a", "operation": "b", "alpha": 2}"#, "duplicate field `operation`"),
            (r#"{"operation": 3, "alpha": 2}"#, "invalid type: integer `3`"),
            (r#"{"operation": "a", "alpha": 2, "beta": 3}"#, "unknown field `beta`"),
            (r#"{"operation": "a"}"#, "missing field `alpha`"),
        ] {
            assert!(read(text).unwrap_err().contains(told), "{text}");
        }
        assert!(serde_json::from_str::<WithOperation<IgnoredAny>>(r#"{"operation": "a", "x": [1]}"#).is_ok());
    }
}
