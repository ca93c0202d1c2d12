//! The level of a function through values, or of a signature function.

use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::mesh::field::{Feet, Field};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::sums::jets::JetOrder;

/// Part of the spread of the values up to which a place counts as on the level.
const TOLERANCE: f64 = 1e-9;

/// f = u − level: inside is where u is greater. Outward is where u falls.
pub struct LevelOf<'a> {
    function: &'a Interpolant,
    level: f64,
    tolerance: f64,
}

impl<'a> LevelOf<'a> {
    /// `spread` is a magnitude of the differences between values, unit V.
    pub fn new(function: &'a Interpolant, level: f64, spread: f64) -> Self {
        // Values far from 0 are known to their rounding only.
        let rounding = 64.0 * f64::EPSILON * level.abs();
        Self { function, level, tolerance: (TOLERANCE * spread).max(rounding) }
    }

    /// The points of the function.
    pub fn cloud(&self) -> &'a Cloud {
        self.function.solver.cloud()
    }
}

impl Field for LevelOf<'_> {
    fn dimension(&self) -> usize {
        self.function.solver.cloud().dimension()
    }

    fn values_at_once(&self, places: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let queries = Cloud::new(places.to_vec(), self.dimension())?;
        let jets = self.function.at(&queries, JetOrder::Value, observer)?;
        Ok(jets.values().iter().map(|u| u - self.level).collect())
    }

    fn feet_at_once(&self, places: &[f64], observer: &dyn Observer) -> Result<Feet> {
        let d = self.dimension();
        let queries = Cloud::new(places.to_vec(), d)?;
        let jets = self.function.at(&queries, JetOrder::Gradient, observer)?;
        let mut feet = Feet::default();
        for (query, x) in queries.points().enumerate() {
            let (f, gradient) = (jets.value(query) - self.level, jets.gradient(query));
            let squared = dot(gradient, gradient);
            // Where u is flat, the place stays.
            let step = if squared > 0.0 { f / squared } else { 0.0 };
            let length = norm(gradient);
            let towards = |g: &f64| if length > 0.0 { -g / length } else { 0.0 };
            feet.positions.extend(x.iter().zip(gradient).map(|(x, g)| x - step * g));
            feet.normals.extend(gradient.iter().map(towards));
            feet.distances.push(if length > 0.0 { f.abs() / length } else { f64::INFINITY });
        }
        Ok(feet)
    }

    fn tolerance(&self) -> f64 {
        self.tolerance
    }
}
