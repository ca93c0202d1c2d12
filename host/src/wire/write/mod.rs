//! Bodies of answers: named members, written as JSON, safetensors or npy, at once or while they are sent.

pub mod answer;
pub mod array;
pub mod chunk;
pub mod encode;
pub mod integers;
pub mod json;
pub mod model;
