//! Bodies in: JSON, safetensors, npy and PLY, read by the same types within the same limits.

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
