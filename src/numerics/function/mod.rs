//! What a solved system says as a function on space: its values, and how sure they are.

pub mod interpolant;
pub mod moving;
pub mod posterior;
