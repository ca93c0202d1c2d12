//! An answer that came as members: arrays by their names, and everything else as JSON.

use std::sync::Arc;

use axum::body::Bytes;
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::model::{Model, Positions, Shape};
use safetensors::{Dtype, SafeTensors};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::files::read::FileCloud;
use crate::http::VertexSupport;

/// The entry of the metadata with the members that are no arrays.
const OTHERS: &str = "response";

/// An answer of the service, and what the command says about it.
pub struct Answer {
    /// The body as it came.
    pub bytes: Bytes,
    /// Members that are no arrays.
    pub others: Value,
    arrays: Vec<(String, Array)>,
    /// Vertices of each segment or triangle of a mesh.
    cells: Vec<u32>,
}

/// An answer whose place in space is known.
pub(super) struct Placed<'a> {
    answer: &'a Answer,
    pub shape: Shape,
}

struct Vertices {
    coordinates: Vec<f64>,
    dimension: usize,
}

impl Positions for Vertices {
    fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    fn dimension(&self) -> usize {
        self.dimension
    }
}

impl Answer {
    /// Reads the body of an answer as safetensors or JSON. Of JSON only the members are read that a report
    /// has.
    ///
    /// # Errors
    /// Says what is wrong with the body.
    pub fn of(bytes: Bytes) -> Result<Self, String> {
        if bytes.starts_with(b"{") {
            let others: Reported = serde_json::from_slice(&bytes).map_err(|error| error.to_string())?;
            return Ok(Self { bytes, others: others.into_value(), arrays: Vec::new(), cells: Vec::new() });
        }
        let (_, head) = SafeTensors::read_metadata(&bytes).map_err(|error| error.to_string())?;
        let others = head.metadata().as_ref().and_then(|entries| entries.get(OTHERS));
        let others = others.map_or(Ok(Value::Null), |text| serde_json::from_str(text));
        let others = others.map_err(|error| error.to_string())?;
        let (mut arrays, mut cells) = (Vec::new(), Vec::new());
        let tensors = SafeTensors::deserialize(&bytes).map_err(|error| error.to_string())?;
        for (name, tensor) in tensors.iter() {
            match tensor.dtype() {
                Dtype::F64 => {
                    let numbers = words(tensor.data()).map(f64::from_le_bytes).collect();
                    arrays.push((name.to_owned(), Array::new(numbers, tensor.shape())));
                }
                Dtype::I64 if name == "cells" => {
                    cells = words(tensor.data()).map(|word| i64::from_le_bytes(word) as u32).collect();
                }
                _ => {}
            }
        }
        // As the service lists them: by their place in the file.
        arrays.sort_by_key(|(name, _)| head.info(name).map(|info| info.data_offsets.0));
        Ok(Self { bytes, others, arrays, cells })
    }

    /// Whether this is a mesh.
    pub fn is_mesh(&self) -> bool {
        self.others.get("parts").is_some()
    }

    /// Places the answer: a mesh at its vertices, anything else at the points of the cloud.
    ///
    /// # Errors
    /// Refuses an answer with other rows than the cloud has points.
    pub(super) fn placed(&self, cloud: &FileCloud) -> Result<Placed<'_>, String> {
        let vertices = self.arrays.iter().find(|(name, _)| name == "vertices").map(|(_, array)| array);
        let positions = match vertices {
            Some(array) => {
                let (n, dimension) = (array.shape()[0], array.shape()[1]);
                let entry = |row: usize| (0..dimension).map(move |axis| array.row_entry(row, axis));
                Vertices { coordinates: (0..n).flat_map(entry).collect(), dimension }
            }
            None => Vertices { coordinates: cloud.points.clone(), dimension: cloud.dimension },
        };
        let n = positions.coordinates.len() / positions.dimension.max(1);
        if self.arrays.iter().any(|(_, array)| array.shape().first() != Some(&n)) {
            return Err(format!("the answer does not have a row for each of the {n} points"));
        }
        let labels = self.labels(vertices.is_some());
        let shape = Shape { positions: Arc::new(positions), cells: self.cells.clone(), labels };
        Ok(Placed { answer: self, shape })
    }

    /// Small numbers at the vertices of a mesh, as the service labels them.
    fn labels(&self, is_mesh: bool) -> Vec<(&'static str, Vec<u8>)> {
        let support = Vec::<VertexSupport>::deserialize(&self.others["support"]).ok().filter(|_| is_mesh);
        let codes = support.map(|all| all.into_iter().map(VertexSupport::code).collect());
        codes.map(|codes| ("support", codes)).into_iter().collect()
    }

    /// The answer for the formats of models.
    ///
    /// # Errors
    /// As [`Answer::placed`]. Refuses other dimensions than 2 and 3.
    pub(super) fn model(&self, cloud: &FileCloud) -> Result<Placed<'_>, String> {
        let placed = self.placed(cloud)?;
        match placed.shape.positions.dimension() {
            2 | 3 => Ok(placed),
            d => Err(format!(
                "the points have {d} coordinates, and this format holds 2 or 3: take .csv or .json"
            )),
        }
    }
}

impl Placed<'_> {
    pub(super) fn as_model(&self) -> Model<'_> {
        let arrays = self.answer.arrays.iter();
        Model::of(&self.shape, arrays.map(|(name, array)| (name.as_str(), array)))
    }

    /// The bytes of a file of a model.
    ///
    /// # Errors
    /// If the file would be larger than its format allows.
    pub(super) fn write(&self, format: Format) -> Result<Vec<u8>, String> {
        self.as_model().write(format).ok_or_else(|| "the answer is too large for this format".to_owned())
    }
}

/// Members of JSON that a report has.
#[derive(Deserialize)]
struct Reported {
    flags: Option<Value>,
    diagnostics: Option<Value>,
    parts: Option<Value>,
}

impl Reported {
    fn into_value(self) -> Value {
        let mut members = serde_json::Map::new();
        let all = [("flags", self.flags), ("diagnostics", self.diagnostics), ("parts", self.parts)];
        members.extend(all.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))));
        json!(members)
    }
}

fn words(data: &[u8]) -> impl Iterator<Item = [u8; 8]> {
    data.as_chunks::<8>().0.iter().copied()
}
