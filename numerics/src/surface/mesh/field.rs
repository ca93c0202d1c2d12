//! Functions whose level sets are meshed.

use crate::error::Result;
use crate::observer::Observer;

/// A function f on space, d = 2 or 3. The surface is its zero level, and f is positive inside.
///
/// Places are given as many at once as possible, since sums over a cloud are fastest so.
pub trait Field: Sync {
    fn dimension(&self) -> usize;

    /// Evaluates f at places `[m, d]`. The sign of 0 counts as inside.
    ///
    /// # Errors
    /// Those of the function, and `NumericsError::Cancelled`.
    fn values(&self, places: &[f64], observer: &dyn Observer) -> Result<Vec<f64>>;

    /// Finds the feet of places `[m, d]` near the surface, each by one step.
    ///
    /// # Errors
    /// Those of [`Field::values`].
    fn feet(&self, places: &[f64], observer: &dyn Observer) -> Result<Feet>;

    /// The magnitude of f up to which a place counts as on the surface.
    fn tolerance(&self) -> f64;
}

/// Points of the surface near given places.
#[derive(Debug, Clone, Default)]
pub struct Feet {
    /// One Newton step from each place, `[m, d]`.
    pub positions: Vec<f64>,
    /// Outward unit normals, `[m, d]`. Zero where f has no gradient.
    pub normals: Vec<f64>,
    /// Distances of the places from the surface, to first order: `|f|/|∇f|`, `[m]`, unit L.
    pub distances: Vec<f64>,
}
