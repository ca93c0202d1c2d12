//! Clouds and factors as objects that outlive the process.
//!
//! NAMES. `<owner>/clouds/<cloud id>` is a cloud. The names and times of these objects are the list of clouds
//! (clouds.rs). FACTORS are under `<owner>/factors/` and are deleted with their clouds (factors.rs).
//!
//! A cloud is written once: a second writer finds it.
//!
//! READS return exactly what was written, or nothing (cloud_object.rs). A damaged cloud is reported and moved
//! to `damaged/`. It then no longer exists under its name and can be posted again.
//!
//! RETENTION. A sweep deletes clouds beyond an age or a number of bytes, and left-overs of deleted clouds
//! (retention.rs).

pub mod cloud_object;
mod clouds;
pub mod factors;
mod retention;
#[cfg(test)]
mod tests;

use std::ops::Deref;
use std::sync::Arc;

pub use clouds::{CloudPlace, ListWindow, Written};
use gramian_host::store::Objects;
pub use retention::{Retention, Swept};

/// The clouds and factors among the objects of a store.
#[derive(Clone)]
pub struct CloudObjects(pub Arc<Objects>);

impl Deref for CloudObjects {
    type Target = Objects;

    fn deref(&self) -> &Objects {
        &self.0
    }
}
