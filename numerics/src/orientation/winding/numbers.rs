//! Winding numbers anywhere in space, of points whose normals have their signs.

use super::areas::areas;
use super::dipoles::Dipoles;
use crate::error::NumericsError;
use crate::machine::small::Small;
use crate::observer::Observer;
use crate::orientation::edges::sheet_edges;
use crate::orientation::{CloudWithNeighbours, n_around};
use crate::points::cloud::Cloud;
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::sampling::Sampling;

/// The winding number of an oriented cloud as a function on space: 1 inside, 0 outside, ½ on the surface.
pub(crate) struct WindingNumbers {
    /// Dipoles in units of the radius of the cloud, so that powers of distances stay inside float64.
    dipoles: Dipoles,
    radius: f64,
}

impl WindingNumbers {
    /// Estimates the area of each point and sums them in a tree. `normals` are outward, `[n, d]`. `None` for
    /// a cloud of one position.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of(
        cloud: &Cloud,
        sampling: &Sampling,
        normals: &[f64],
        observer: &dyn Observer,
    ) -> Result<Option<Self>, NumericsError> {
        let (radius, d) = (cloud.radius(), cloud.dimension());
        if radius == 0.0 {
            return Ok(None);
        }
        let around = Neighbourhoods::of(sampling.neighbours(), cloud, n_around(cloud), observer)?;
        let sampled = CloudWithNeighbours { cloud, sampling, around: &around, observer };
        let areas = areas(&sampled, normals, &sheet_edges(&sampled, normals)?, radius);
        let rows = areas.iter().zip(normals.chunks_exact(d));
        let moments: Vec<f64> =
            rows.flat_map(|(area, normal)| normal.iter().map(move |c| area * c)).collect();
        let scaled = Cloud::new(cloud.coordinates().iter().map(|x| x / radius).collect(), d)?;
        let all: Vec<usize> = (0..cloud.n_points()).collect();
        Ok(Some(Self { dipoles: Dipoles::of(&scaled, &moments, &all), radius }))
    }

    /// Makes the points softer: their softening length is this part of the width of their area.
    #[must_use]
    pub(crate) fn softened(mut self, softening: f64) -> Self {
        self.dipoles.soften(softening);
        self
    }

    /// Returns w(x).
    pub(crate) fn at(&self, x: &[f64]) -> f64 {
        self.dipoles.winding(&self.scaled(x))
    }

    /// Returns w(x) and its gradient, `[d]`, 1/L.
    pub(crate) fn jet(&self, x: &[f64]) -> (f64, Small) {
        let (winding, mut gradient) = self.dipoles.winding_jet(&self.scaled(x));
        gradient.iter_mut().for_each(|g| *g /= self.radius);
        (winding, gradient)
    }

    fn scaled(&self, x: &[f64]) -> Small {
        x.iter().map(|c| c / self.radius).collect()
    }
}
