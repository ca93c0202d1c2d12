//! Bodies: how they are written, what becomes of them, and what answers become.

pub mod compression;
pub mod negotiation;
pub mod read;
pub mod write;
