//! Request bodies in JSON, safetensors, npy and PLY. All formats are read into the same types under the same
//! limits.

pub mod body;
pub mod limits;
pub mod members;
pub mod parse;
pub mod points;
pub mod without;

mod guarded;
mod plain_json;
mod ply;
mod tensors;
