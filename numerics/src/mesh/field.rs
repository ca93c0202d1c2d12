//! Functions whose level sets are meshed.

use crate::error::Result;
use crate::observer::Observer;

/// Places evaluated between two looks at whether the work is cancelled: less than a tenth of a second.
const AT_ONCE: usize = 1 << 12;

/// A function f on space, d = 2 or 3. The surface is its zero level, and f is positive inside.
///
/// Callers give as many places at once as they have, since sums over a cloud are fastest so. What a function
/// implements are `values_at_once` and `feet_at_once`, of a few places at a time.
pub trait Field: Sync {
    fn dimension(&self) -> usize;

    /// Evaluates f at places `[m, d]`. The sign of 0 counts as inside.
    ///
    /// # Errors
    /// Those of [`Field::values_at_once`].
    fn values(&self, places: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let mut values = Vec::with_capacity(places.len() / self.dimension());
        for places in places.chunks(AT_ONCE * self.dimension()) {
            observer.checkpoint()?;
            values.append(&mut self.values_at_once(places, observer)?);
        }
        Ok(values)
    }

    /// Finds the feet of places `[m, d]` near the surface, each by one step.
    ///
    /// # Errors
    /// Those of [`Field::feet_at_once`].
    fn feet(&self, places: &[f64], observer: &dyn Observer) -> Result<Feet> {
        let mut feet = Feet::default();
        for places in places.chunks(AT_ONCE * self.dimension()) {
            observer.checkpoint()?;
            let Feet { mut positions, mut normals, mut distances } = self.feet_at_once(places, observer)?;
            feet.positions.append(&mut positions);
            feet.normals.append(&mut normals);
            feet.distances.append(&mut distances);
        }
        Ok(feet)
    }

    /// [`Field::values`] of a few places, at least one.
    ///
    /// # Errors
    /// Those of the function, and `NumericsError::Cancelled`.
    fn values_at_once(&self, places: &[f64], observer: &dyn Observer) -> Result<Vec<f64>>;

    /// [`Field::feet`] of a few places, at least one.
    ///
    /// # Errors
    /// Those of [`Field::values_at_once`].
    fn feet_at_once(&self, places: &[f64], observer: &dyn Observer) -> Result<Feet>;

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
