//! Local kriging of means of near points. Their neighbourhoods reach further at the same cost.

use std::sync::Arc;

use super::NEIGHBOURS;
use super::near::Near;
use super::{KrigingRequest, LocalKriging};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::observer::Observer;
use crate::points::cells::{Cells, mean, second_moments};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::points::thinning::thinned_points;
use crate::regression::function::functionals::{JetFunctional, has_variance};
use crate::regression::solver::System;
use crate::regression::sums::jets::JetOrder;
use crate::regression::sums::regularization::Regularization;

/// Growth of the number of points per mean from one size to the next.
///
/// On a surface, neighbourhoods then reach twice as far.
const FACTOR: usize = 4;

/// Queries at which sizes are compared, at most.
const COMPARED: usize = 32;

/// Ratio of deviations of derivatives from one size to the next, up to which larger means are kept.
const SURER: f64 = 0.95;

/// Local kriging of means of near points, one mean for each cell.
pub struct Coarse {
    cells: Cells,
    moving: LocalKriging,
}

impl Coarse {
    /// Local kriging of the means.
    pub fn moving(&self) -> &LocalKriging {
        &self.moving
    }

    /// Returns the mean of the values `[n]` in each cell.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let mean =
            |cell: &[u32]| cell.iter().map(|&point| values[point as usize]).sum::<f64>() / cell.len() as f64;
        self.cells.iter().map(mean).collect()
    }
}

impl LocalKriging {
    /// Returns the means of points that give derivatives with smaller deviations than the points themselves.
    ///
    /// The comparison takes derivatives of order `order` at a sample of the queries. Returns `None` if no
    /// size is better, or if the kernel's process has no second derivatives.
    ///
    /// The nearest points of a dense noisy cloud lie so close together that their differences are noise.
    /// Deviations of derivatives therefore fall as a neighbourhood reaches further, until the field bends
    /// within one mean. Sizes grow fourfold as long as the deviations fall.
    ///
    /// # Errors
    /// Returns the errors of [`LocalKriging::at`].
    pub(crate) fn surest(
        &self,
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Option<Coarse>> {
        if !has_variance(self.system.kernel(), 2) {
            return Ok(None);
        }
        let sample = queries.select(&thinned_points(queries, COMPARED, observer)?);
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

    /// Averages cells of at most `size` points.
    ///
    /// The noise of a mean of m points is 1/m of theirs. Bending of the field within a cell counts as
    /// additional noise. With M the second moments of the points about their mean, the mean of the field
    /// differs by `½ M : D²u` from the field at the mean point.
    fn coarse(&self, size: usize, observer: &dyn Observer) -> Result<Coarse> {
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
        Ok(Coarse { cells, moving: LocalKriging { system, near } })
    }

    /// Returns the root mean square deviation of the derivatives of highest order at some queries.
    ///
    /// Deviations do not depend on the values, so zeros take their place.
    fn uncertainty(&self, queries: &Cloud, order: JetOrder, observer: &dyn Observer) -> Result<f64> {
        let request = KrigingRequest { order, has_variances: false, has_deviations: true, trend: None };
        let found = self.at(&vec![0.0; self.system.n_points()], queries, request, observer)?;
        let all = found.deviations.unwrap_or_default();
        let highest = [all.hessians, all.gradients, all.values].into_iter().find(|list| !list.is_empty());
        let highest = highest.unwrap_or_default();
        // In units of the greatest deviation, since its square may overflow.
        let unit = highest.iter().copied().fold(0.0, f64::max);
        if unit == 0.0 {
            return Ok(0.0);
        }
        let squares = highest.iter().map(|deviation| (deviation / unit).powi(2)).sum::<f64>();
        Ok(unit * (squares / highest.len() as f64).sqrt())
    }
}

/// Returns the prior variance of `½ M : D²u`, M the second moments of a cell, `[d, d]`.
fn of_bending(moments: &[f64], kernel: &Kernel, d: usize) -> f64 {
    let mut functional = JetFunctional::value(0, d);
    functional.of_value = 0.0;
    functional.of_hessian = moments.iter().map(|moment| 0.5 * moment).collect();
    let size = functional.size(kernel);
    size * size * functional.over(size).prior_variance(kernel)
}
