//! Local kriging of means of near points, whose neighbourhoods reach further at the same cost.

use std::sync::Arc;

use super::near::Near;
use super::{Moving, MovingRequest};
use crate::error::NumericsError;
use crate::function::functionals::{JetFunctional, has_variance};
use crate::kernel::Kernel;
use crate::observer::Observer;
use crate::points::cells::{Cells, mean, second_moments};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::points::thinning::thinned_points;
use crate::solver::System;
use crate::solver::choose::NEIGHBOURS;
use crate::sums::jets::JetOrder;
use crate::sums::regularization::Regularization;

/// Points of a mean, from one size to the next: neighbourhoods of surfaces reach twice as far.
const FACTOR: usize = 4;

/// Queries at which sizes are compared.
const COMPARED: usize = 32;

/// The share of the deviations of derivatives that means of a size have to leave, for larger ones to be tried.
const SURER: f64 = 0.95;

/// Means of near points, kriged around each query.
pub struct Coarse {
    cells: Cells,
    moving: Moving,
}

impl Coarse {
    /// Local kriging of the means.
    pub fn moving(&self) -> &Moving {
        &self.moving
    }

    /// The mean of the values `[n]` of each cell.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let mean =
            |cell: &[u32]| cell.iter().map(|&point| values[point as usize]).sum::<f64>() / cell.len() as f64;
        self.cells.iter().map(mean).collect()
    }
}

impl Moving {
    /// Means of the points in which derivatives up to an order are surer at some queries than in the points themselves, if there are such.
    ///
    /// The nearest points of a dense cloud with noise lie so close together that their differences are noise: deviations of derivatives
    /// fall with the reach of a neighbourhood until the field bends within one mean. Sizes grow fourfold for as long as the
    /// deviations fall.
    ///
    /// # Errors
    /// Those of [`Moving::at`].
    pub fn surest(
        &self,
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Option<Coarse>, NumericsError> {
        if !has_variance(self.system.kernel(), 2) {
            return Ok(None);
        }
        let sample = queries.select(&thinned_points(queries, COMPARED));
        let mut least = self.uncertainty(&sample, order, observer)?;
        let (mut surest, mut size) = (None, FACTOR);
        while self.system.n_points() / size > 2 * NEIGHBOURS {
            let coarse = self.coarse(size, observer)?;
            let uncertainty = coarse.moving.uncertainty(&sample, order, observer)?;
            if uncertainty > SURER * least {
                break;
            }
            (surest, least) = (Some(coarse), uncertainty);
            size *= FACTOR;
        }
        Ok(surest)
    }

    /// Means of cells of at most `size` points.
    ///
    /// The mean of m points has the m-th part of their noise. That the field bends within a cell counts as more noise: with M the second
    /// moments of the points about their mean, the mean of the field is off by `½ M : D²u` from the field at the mean.
    fn coarse(&self, size: usize, observer: &dyn Observer) -> Result<Coarse, NumericsError> {
        let (cloud, kernel) = (self.system.cloud(), self.system.kernel());
        let cells = Cells::of_all(cloud, size);
        observer.checkpoint()?;
        let (mut coordinates, mut noise) = (Vec::new(), Vec::with_capacity(cells.n_cells()));
        for cell in cells.iter() {
            let mean = mean(cloud, cell);
            let moments = second_moments(cloud, cell, &mean);
            coordinates.extend_from_slice(&mean);
            let count = cell.len() as f64;
            let of_points = cell.iter().map(|&point| self.system.regularization().at(point as usize));
            noise.push(of_points.sum::<f64>() / (count * count) + of_bending(&moments, kernel, mean.len()));
        }
        let cloud = Arc::new(Cloud::new(coordinates, cloud.dimension())?);
        let stretched = kernel.stretched_cloud(&cloud);
        let near = Near::Stretched(Neighbours::of(stretched.as_ref().unwrap_or(&cloud), observer)?);
        let system = System::new(cloud, kernel.clone(), Regularization::per_point(noise)?)?;
        Ok(Coarse { cells, moving: Moving { system, near } })
    }

    /// Root mean square deviation of the highest derivatives at some queries; values do not matter to it.
    fn uncertainty(
        &self,
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<f64, NumericsError> {
        let request = MovingRequest { order, has_variances: false, has_deviations: true, trend: None };
        let found = self.at(&vec![0.0; self.system.n_points()], queries, request, observer)?;
        let all = found.deviations.unwrap_or_default();
        let highest = [all.hessians, all.gradients, all.values].into_iter().find(|list| !list.is_empty());
        let highest = highest.unwrap_or_default();
        // In units of the greatest, whose square may have no number.
        let unit = highest.iter().copied().fold(0.0, f64::max);
        if unit == 0.0 {
            return Ok(0.0);
        }
        let squares = highest.iter().map(|deviation| (deviation / unit).powi(2)).sum::<f64>();
        Ok(unit * (squares / highest.len() as f64).sqrt())
    }
}

/// The variance of `½ M : D²u`.
fn of_bending(moments: &[f64], kernel: &Kernel, d: usize) -> f64 {
    let mut functional = JetFunctional::value(0, d);
    functional.of_value = 0.0;
    functional.of_hessian = moments.iter().map(|moment| 0.5 * moment).collect();
    let size = functional.size(kernel);
    size * size * functional.over(size).prior_variance(kernel)
}
