//! An answer as named members, independent of its format: JSON, safetensors or npy.
//!
//! Numbers are never copied. Binary bodies are the computed buffers, and large JSON is written chunk by chunk
//! while it is sent.

use std::collections::HashMap;
use std::sync::Arc;

use bytes::Bytes;
use safetensors::Dtype;
use safetensors::tensor::{Metadata, TensorInfo};
use serde::Serialize;

use super::array::Array;
use super::chunk::{Chunk, ChunkBuilder};
use super::integers::Integers;
use super::json;
use super::model::{Model, Shape};
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::wire::negotiation::Format;

/// An answer made of named members. The macro `answer!` declares one.
pub trait Answer {
    /// Takes the members out, in the order of their declaration.
    ///
    /// # Errors
    /// 422 `invalid-request` if a number is not finite, because JSON cannot represent it.
    fn into_parts(self: Box<Self>) -> Result<Parts, Problem>;
}

/// Declares an answer: its schema for the `OpenAPI` document and its [`Answer`] implementation.
///
/// `as` names the type of a member in the document, where it differs from the type in the code.
#[macro_export]
macro_rules! answer {
    (
        $(#[$meta:meta])*
        pub struct $name:ident { $($(#[$field_meta:meta])* $field:ident: $type:ty $(as $schema:ty)?,)* }
    ) => {
        $(#[$meta])*
        #[derive(utoipa::ToSchema)]
        pub struct $name {
            $($(#[$field_meta])* $(#[schema(value_type = $schema)])? $field: $type,)*
        }

        impl $crate::wire::write::answer::Answer for $name {
            fn into_parts(self: Box<Self>) -> Result<$crate::wire::write::answer::Parts, $crate::problem::Problem> {
                let mut parts = $crate::wire::write::answer::Parts::default();
                $($crate::wire::write::answer::Member::add_to(self.$field, stringify!($field), &mut parts)?;)*
                Ok(parts)
            }
        }
    };
}

/// Makes types members that are JSON in every format.
#[macro_export]
macro_rules! json_members {
    ($($type:ty),*) => {
        $(impl $crate::wire::write::answer::Member for $type {
            fn add_to(
                self,
                name: &'static str,
                parts: &mut $crate::wire::write::answer::Parts,
            ) -> Result<(), $crate::problem::Problem> {
                parts.add_json(name, &self)
            }
        })*
    };
}

/// A value that can be a member of an answer.
pub trait Member {
    /// Adds the value under this name.
    ///
    /// # Errors
    /// Returns the errors of [`Answer::into_parts`].
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem>;
}

impl Member for Array {
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        if !self.is_finite() {
            return Err(beyond_float64());
        }
        parts.members.push((name, Part::Numbers(self)));
        Ok(())
    }
}

impl Member for Integers {
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        parts.members.push((name, Part::Integers(self)));
        Ok(())
    }
}

impl<T: Serialize> Member for Vec<T> {
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        parts.add_json(name, &self)
    }
}

json_members!(f64, bool, usize);

/// An absent value is left out, not written as null.
impl<M: Member> Member for Option<M> {
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        self.map_or(Ok(()), |member| member.add_to(name, parts))
    }
}

fn beyond_float64() -> Problem {
    let detail =
        "the answer is outside the range of float64; scale the points, the values or the length scale";
    Problem::new(catalogue::INVALID_REQUEST, detail)
}

impl Member for Shape {
    fn add_to(self, _name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        parts.shape = Some(self);
        Ok(())
    }
}

/// The members of an answer, in order.
#[derive(Default)]
pub struct Parts {
    members: Vec<(&'static str, Part)>,
    /// Where the answer lies in space, for the formats of models.
    shape: Option<Shape>,
}

enum Part {
    Numbers(Array),
    Integers(Integers),
    /// JSON text.
    Json(Vec<u8>),
}

impl Parts {
    /// Adds a member that is JSON in every format.
    ///
    /// # Errors
    /// 422 `invalid-request` for a number that is not finite. Answers are computed from numbers of the
    /// client, so those were too large.
    pub fn add_json(&mut self, name: &'static str, value: &impl Serialize) -> Result<(), Problem> {
        let text = json::to_vec(value).map_err(|_| beyond_float64())?;
        self.members.push((name, Part::Json(text)));
        Ok(())
    }

    /// Returns the body in chunks.
    ///
    /// # Errors
    /// 500 `internal` for a format that the answer does not have.
    pub fn write(self, format: Format) -> Result<Vec<Chunk>, Problem> {
        match format {
            Format::Json => Ok(self.into_json().finish()),
            Format::Safetensors => self.write_safetensors().ok_or_else(Problem::internal),
            Format::Npy => self.write_npy().ok_or_else(Problem::internal),
            Format::Ply | Format::Gltf | Format::Obj => self.write_model(format),
        }
    }

    /// Writes the members as one JSON object.
    fn into_json(self) -> ChunkBuilder {
        let mut chunks = ChunkBuilder::default();
        let mut separator = '{';
        for (name, part) in self.members {
            chunks.text(format!("{separator}\"{name}\":").as_bytes());
            separator = ',';
            match part {
                Part::Numbers(array) => chunks.numbers(Arc::new(array)),
                // Integers cannot be refused by the encoder.
                Part::Integers(numbers) => {
                    chunks.text(&json::to_vec(&numbers).unwrap_or_else(|_| b"[]".to_vec()));
                }
                Part::Json(text) => chunks.text(&text),
            }
        }
        chunks.text(if separator == '{' { b"{}" } else { b"}" });
        chunks
    }

    /// Writes each array as a float64 or int64 tensor. All other members become a JSON object in the metadata
    /// entry `response`.
    fn write_safetensors(self) -> Option<Vec<Chunk>> {
        let (arrays, others): (Vec<_>, Vec<_>) =
            self.members.into_iter().partition(|(_, part)| !matches!(part, Part::Json(_)));
        let mut response = Vec::new();
        Parts { members: others, shape: None }
            .into_json()
            .finish()
            .iter()
            .for_each(|chunk| chunk.write(&mut response));
        let metadata = HashMap::from([("response".to_owned(), String::from_utf8(response).ok()?)]);
        let (mut tensors, mut bodies, mut start) = (Vec::new(), Vec::new(), 0);
        for (name, part) in arrays {
            let (shape, dtype, data) = match part {
                Part::Numbers(array) => (array.shape().to_vec(), Dtype::F64, array.into_bytes()),
                Part::Integers(numbers) => (numbers.shape(), Dtype::I64, numbers.into_bytes()),
                Part::Json(_) => continue,
            };
            let data_offsets = (start, start + data.len());
            start = data_offsets.1;
            tensors.push((name.to_owned(), TensorInfo { dtype, shape, data_offsets }));
            bodies.push(data);
        }
        let mut header = serde_json::to_vec(&Metadata::new(Some(metadata), tensors).ok()?).ok()?;
        header.resize(header.len().next_multiple_of(size_of::<f64>()), b' ');
        let mut head = (header.len() as u64).to_le_bytes().to_vec();
        head.append(&mut header);
        Some([Bytes::from(head)].into_iter().chain(bodies).map(Chunk::of).collect())
    }

    /// Writes the file of another program.
    ///
    /// # Errors
    /// 406 `not-acceptable` for points in more than three dimensions, which these files cannot hold. 500
    /// `internal` for an answer without a place in space.
    fn write_model(self, format: Format) -> Result<Vec<Chunk>, Problem> {
        let shape = self.shape.as_ref().ok_or_else(Problem::internal)?;
        if shape.positions.dimension() > 3 {
            let detail = format!("{} holds points in the plane or in space", format.media_type());
            return Err(Problem::new(catalogue::NOT_ACCEPTABLE, detail));
        }
        let arrays = self.members.iter().filter_map(|(name, part)| match part {
            Part::Numbers(array) => Some((*name, array)),
            Part::Integers(_) | Part::Json(_) => None,
        });
        let file = Model::of(shape, arrays).write(format).ok_or_else(Problem::internal)?;
        Ok(vec![Chunk::of(Bytes::from(file))])
    }

    /// Writes the first float64 array of the answer: magic, version 1.0, length of the header, header,
    /// numbers.
    fn write_npy(self) -> Option<Vec<Chunk>> {
        let mut arrays = self.members.into_iter().filter_map(|(_, part)| match part {
            Part::Numbers(array) => Some(array),
            Part::Integers(_) | Part::Json(_) => None,
        });
        let array = arrays.next()?;
        let shape: String = array.shape().iter().map(|length| format!("{length}, ")).collect();
        let mut header =
            format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
        let n_bytes = (NPY_MAGIC.len() + 2 + header.len() + 1).next_multiple_of(NPY_ALIGNMENT);
        let n_header = n_bytes - NPY_MAGIC.len() - 2;
        header = format!("{header:<width$}\n", width = n_header - 1);
        let mut head = NPY_MAGIC.to_vec();
        head.extend(u16::try_from(n_header).ok()?.to_le_bytes());
        head.extend(header.into_bytes());
        Some(vec![Chunk::of(Bytes::from(head)), Chunk::of(array.into_bytes())])
    }
}

const NPY_MAGIC: [u8; 8] = *b"\x93NUMPY\x01\x00";
const NPY_ALIGNMENT: usize = 64;

#[cfg(test)]
mod tests {
    use safetensors::SafeTensors;

    use super::*;

    answer! {
        /// An answer.
        pub struct Sample {
            /// Numbers.
            values: Array as Vec<f64>,
            /// None.
            gradients: Option<Array> as Option<Vec<f64>>,
            /// Words.
            surfaces: Vec<&'static str>,
            /// A number.
            score: f64,
            /// A list.
            scores: Option<Vec<f64>>,
        }
    }

    fn sample(values: Array) -> Sample {
        Sample { values, gradients: None, surfaces: vec!["a"], score: 1.5, scores: None }
    }

    fn written(answer: Sample, format: Format) -> Vec<u8> {
        let mut bytes = Vec::new();
        let chunks = Box::new(answer).into_parts().ok().unwrap().write(format).unwrap();
        chunks.iter().for_each(|chunk| chunk.write(&mut bytes));
        bytes
    }

    fn with_null() -> Array {
        Array::new(vec![1.0, 2.0], &[2]).with_nulls(0, &[false, true])
    }

    #[test]
    fn json_has_the_members_in_order_and_no_absent_ones() {
        let text = String::from_utf8(written(sample(with_null()), Format::Json)).unwrap();
        assert_eq!(text, r#"{"values":[1.0,null],"surfaces":["a"],"score":1.5}"#);
    }

    #[test]
    fn safetensors_has_arrays_as_tensors_and_the_rest_as_json() {
        let bytes = written(sample(with_null()), Format::Safetensors);
        let tensors = SafeTensors::deserialize(&bytes).unwrap();
        assert_eq!(tensors.names(), ["values"]);
        let values = tensors.tensor("values").unwrap();
        assert_eq!((values.dtype(), values.shape()), (Dtype::F64, &[2][..]));
        assert_eq!(values.data()[..8], 1f64.to_le_bytes());
        assert!(f64::from_le_bytes(values.data()[8..].try_into().unwrap()).is_nan());
        let (n_header, metadata) = SafeTensors::read_metadata(&bytes).unwrap();
        let response = &metadata.metadata().as_ref().unwrap()["response"];
        assert_eq!(response, r#"{"surfaces":["a"],"score":1.5}"#);
        assert_eq!((8 + n_header) % 8, 0);
    }

    #[test]
    fn npy_is_an_aligned_header_and_the_numbers() {
        let bytes = written(sample(Array::new((0..6).map(f64::from).collect(), &[2, 3])), Format::Npy);
        let n_header = 10 + usize::from(u16::from_le_bytes(bytes[8..10].try_into().unwrap()));
        assert_eq!((&bytes[..8], n_header % 64, bytes[n_header - 1]), (&b"\x93NUMPY\x01\x00"[..], 0, b'\n'));
        let header = str::from_utf8(&bytes[10..n_header]).unwrap().trim_end();
        assert_eq!(header, "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3,), }");
        assert_eq!(bytes[n_header..].len(), 6 * 8);
        assert_eq!(bytes[bytes.len() - 8..], 5f64.to_le_bytes());
    }

    #[test]
    fn what_json_cannot_say_is_refused_in_every_format() {
        let refusal = Box::new(sample(Array::new(vec![f64::NAN], &[1]))).into_parts().err();
        assert_eq!(refusal.map(|problem| problem.slug()), Some(catalogue::INVALID_REQUEST));
        let infinite = Sample { score: f64::INFINITY, ..sample(with_null()) };
        assert!(Box::new(infinite).into_parts().is_err());
        let in_a_list = Sample { scores: Some(vec![1.0, f64::NEG_INFINITY]), ..sample(with_null()) };
        let refusal = Box::new(in_a_list).into_parts().err();
        assert_eq!(refusal.map(|problem| problem.slug()), Some(catalogue::INVALID_REQUEST));
    }
}
