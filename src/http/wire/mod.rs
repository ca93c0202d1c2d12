//! Bodies of requests and answers: content negotiation, compression, reading and writing.

pub mod compression;
pub mod negotiation;
pub mod read;
pub mod write;
