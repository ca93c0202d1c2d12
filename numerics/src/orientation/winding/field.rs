//! The oriented points of a cloud as a surface with winding numbers.

use rayon::prelude::*;

use super::areas::areas;
use super::dipoles::Dipoles;
use crate::error::NumericsError;
use crate::observer::Observer;
use crate::orientation::CloudWithNeighbours;
use crate::orientation::edges::Edge;
use crate::points::cloud::Cloud;

/// Points with their areas and normals, in units of the radius of the cloud. So powers of distances stay
/// inside float64.
pub(crate) struct Field<'a> {
    pub cloud: Cloud,
    /// Areas that the points stand for, `[n]`.
    pub areas: Vec<f64>,
    /// Unit vectors or zero, `[n, d]`.
    pub normals: &'a [f64],
    pub observer: &'a dyn Observer,
}

impl<'a> Field<'a> {
    /// Returns the field of some normals, or `None` for a cloud of one position.
    pub(crate) fn of(sampled: &CloudWithNeighbours<'a>, normals: &'a [f64], edges: &[Edge]) -> Option<Self> {
        let (radius, d) = (sampled.cloud.radius(), sampled.cloud.dimension());
        if radius == 0.0 {
            return None;
        }
        let scaled = sampled.cloud.coordinates().iter().map(|x| x / radius).collect();
        let cloud = Cloud::new(scaled, d).ok()?;
        Some(Self {
            cloud,
            areas: areas(sampled, normals, edges, radius),
            normals,
            observer: sampled.observer,
        })
    }

    pub(crate) fn normal(&self, point: usize) -> &[f64] {
        let d = self.cloud.dimension();
        &self.normals[point * d..][..d]
    }

    /// Returns area times normal for normals multiplied with these signs, `[n, d]`.
    pub(crate) fn moments(&self, signs: &[f64]) -> Vec<f64> {
        let factors = signs.iter().zip(&self.areas).map(|(sign, area)| sign * area);
        let rows = factors.zip(self.normals.chunks_exact(self.cloud.dimension()));
        rows.flat_map(|(factor, normal)| normal.iter().map(move |c| factor * c)).collect()
    }

    /// Computes w − ½ at the points, `[n]`, for normals multiplied with these signs.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn misfits(&self, signs: &[f64]) -> Result<Vec<f64>, NumericsError> {
        let all: Vec<usize> = (0..signs.len()).collect();
        let dipoles = Dipoles::of(&self.cloud, &self.moments(signs), &all);
        let misfit = |point: usize| {
            self.observer.checkpoint()?;
            Ok(dipoles.winding(self.cloud.point(point)) - 0.5)
        };
        all.into_par_iter().map(misfit).collect()
    }

    /// Computes how much the side of each point is to blame for misfits at other points, `[n]`.
    ///
    /// Blame is what the sum of squared misfits loses, per area, if the normal is turned. With the misfits
    /// m_x it is `−ν_y·Σ_x a_x m_x (x − y)/(|S^{d−1}| |x − y|^d)`.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn blames(&self, signs: &[f64], misfits: &[f64]) -> Result<Vec<f64>, NumericsError> {
        let d = self.cloud.dimension();
        let sources: Vec<usize> = (0..misfits.len()).filter(|&point| misfits[point] != 0.0).collect();
        if sources.is_empty() {
            return Ok(vec![0.0; misfits.len()]);
        }
        let along_axis = |axis: usize| {
            let mut charges = vec![0.0; misfits.len() * d];
            sources.iter().for_each(|&point| charges[point * d + axis] = misfits[point] * self.areas[point]);
            Dipoles::of(&self.cloud, &charges, &sources)
        };
        let axes: Vec<Dipoles> = (0..d).map(along_axis).collect();
        let blame = |point: usize| {
            self.observer.checkpoint()?;
            let x = self.cloud.point(point);
            let flux: f64 = axes.iter().zip(self.normal(point)).map(|(axis, c)| c * axis.winding(x)).sum();
            Ok(-signs[point] * flux)
        };
        (0..misfits.len()).into_par_iter().map(blame).collect()
    }
}
