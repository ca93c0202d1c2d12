//! Bodies of requests and answers: content negotiation, compression, entity tags, reading and writing; and
//! the bytes of numbers in hashes.

pub mod compression;
pub mod digest;
pub mod etag;
pub mod negotiation;
pub mod read;
pub mod schema;
pub mod write;
