//! Coverage of the error bars of normals and curvatures: rows of docs/error-bars.md, and harder clouds.

#[path = "../common/mod.rs"]
mod common;

mod carved;
mod edges;
mod exact;
mod jet;
mod machined;
mod rows;
mod sampling;
mod shapes;
mod sweep;
mod trials;
