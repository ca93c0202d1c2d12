//! Request bodies in JSON, safetensors, npy and PLY. All formats are read by the same deserializer into the
//! same types, under the same limits.

pub mod body;
pub mod limits;
pub mod members;
pub mod parse;
pub mod ply;
pub mod points;
pub mod renamed;
pub mod tensors;

mod reader;
