//! Clouds that nobody prepared, with no parameters: kernel, length scale, epsilon and alpha are the service's choice.

#[path = "../common/mod.rs"]
mod common;

mod bunny;
mod curvatures;
mod sides;
mod stability;
mod support;
