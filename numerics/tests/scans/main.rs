//! Scans and random clouds with no parameters: the service chooses kernel, length scale, epsilon and alpha.

#[path = "../common/mod.rs"]
mod common;

mod bunny;
mod curvatures;
mod sides;
mod stability;
mod support;
