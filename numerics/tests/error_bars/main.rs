//! Whether error bars of normals and curvatures hold: rows of docs/error-bars.md, and clouds that are hard in other ways.

#[path = "../common/mod.rs"]
mod common;

mod jet;
mod rows;
mod sampling;
mod shapes;
mod sweep;
mod trials;
