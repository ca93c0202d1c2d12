//! The values that are looked at.

use std::sync::Arc;

use super::{Noise, Observed};
use crate::numerics::error::NumericsError;
use crate::numerics::kernel::Kernel;
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::thinning::thinned_points;
use crate::numerics::solver::trend::{Basis, Mean, Trend};
use crate::numerics::solver::{Solver, System};
use crate::numerics::sums::regularization::Regularization;

/// Points that are looked at, at most: a factorization of them takes half a millisecond.
pub const MAX_SAMPLE: usize = 256;

/// Lists of values that are looked at, at most: with one noise and one kernel for all, more say nothing new.
const MAX_LISTS: usize = 16;

/// Points of a sample that lie together: what is noise shows between near points, what is not between far ones.
const TOGETHER: usize = 16;

/// Noise over variance that a mean is found with at least.
const LEAST_RATIO_OF_MEAN: f64 = 1e-10;

/// Some points with their values, without what all values share.
pub(super) struct Sample {
    pub(super) cloud: Cloud,
    /// `[k, n]`, in units of the greatest of them.
    pub(super) values: Vec<f64>,
    pub(super) unit: f64,
    /// What the values of each list share, `[k]`.
    shared: Vec<f64>,
    /// Mean square of the values: a process of less variance is contradicted by them.
    pub(super) least_variance: f64,
    /// Variances of the noise in units of their mean, where they differ.
    pub(super) noise: Option<Vec<f64>>,
    /// The functions of the mean at the points, `[n, p]` column by column.
    pub(super) functions: Vec<f64>,
    pub(super) n_functions: usize,
}

impl Sample {
    pub(super) fn of(observed: &Observed<'_>) -> Self {
        let points = chosen(observed);
        let cloud = observed.cloud.select(&points);
        let of_points = |all: &[f64]| points.iter().map(|&point| all[point]).collect::<Vec<f64>>();
        let basis = Basis::of(observed.mean, &cloud);
        let n_functions = basis.n_functions();
        let lists = observed.values.chunks_exact(observed.cloud.n_points());
        let every = lists.len().div_ceil(MAX_LISTS);
        let (mut values, mut shared) = (Vec::new(), Vec::new());
        for list in lists.step_by(every) {
            let list = of_points(list);
            let mean = if n_functions > 0 { list.iter().sum::<f64>() / list.len() as f64 } else { 0.0 };
            values.extend(list.iter().map(|value| value - mean));
            shared.push(mean);
        }
        let unit = values.iter().fold(0.0f64, |a, value| a.max(value.abs()));
        if unit > 0.0 {
            values.iter_mut().for_each(|value| *value /= unit);
        }
        let mean_square = values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
        let least_variance = mean_square.max(f64::MIN_POSITIVE);
        let noise = match observed.noise {
            Noise::PerPoint(variances) => {
                let mean = variances.iter().sum::<f64>() / variances.len() as f64;
                Some(of_points(variances).iter().map(|v| if mean > 0.0 { v / mean } else { 1.0 }).collect())
            }
            Noise::Unknown | Noise::Uniform(_) => None,
        };
        Self {
            functions: basis.columns(&cloud),
            cloud,
            values,
            unit,
            shared,
            least_variance,
            noise,
            n_functions,
        }
    }

    /// Whether all of the values are 0.
    pub(super) fn is_zero(&self) -> bool {
        self.unit == 0.0 && self.shared.iter().all(|&shared| shared == 0.0)
    }

    /// Values of each list.
    pub(super) fn n_points(&self) -> usize {
        self.cloud.n_points()
    }

    /// The mean of the values, or of the first of several lists, under a kernel of variance 1 and a noise in its units.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`], [`NumericsError::Cancelled`].
    pub(super) fn trend(
        &self,
        observed: &Observed<'_>,
        kernel: Kernel,
        ratio: f64,
        observer: &dyn Observer,
    ) -> Result<Option<Trend>, NumericsError> {
        if observed.mean == Mean::Zero {
            return Ok(None);
        }
        // Enough for points that coincide: the mean is none the worse for it.
        let ratio = ratio.max(LEAST_RATIO_OF_MEAN);
        let noise = match &self.noise {
            None => Regularization::uniform(ratio)?,
            Some(noise) => Regularization::per_point(
                noise.iter().map(|v| (v * ratio).max(LEAST_RATIO_OF_MEAN)).collect(),
            )?,
        };
        let system = System::new(Arc::new(self.cloud.clone()), kernel.of_variance_one(), noise)?;
        let solver = Solver::dense(system, observer)?;
        let first = &self.values[..self.n_points()];
        let values: Vec<f64> = first.iter().map(|value| value * self.unit + self.shared[0]).collect();
        Trend::fit(&solver, &values, observed.mean)
    }

    /// Whether the values leave nothing to explain.
    pub(super) fn is_constant(&self) -> bool {
        let mut lists = self.values.chunks_exact(self.n_points());
        let is_equal = lists.all(|list| list.iter().all(|&value| value == list[0]));
        self.unit == 0.0 || (is_equal && self.n_functions > 0)
    }
}

/// All points, or groups of near ones spread over the cloud.
fn chosen(observed: &Observed<'_>) -> Vec<usize> {
    let (cloud, n) = (observed.cloud, observed.cloud.n_points());
    if n <= MAX_SAMPLE {
        return (0..n).collect();
    }
    let centres = thinned_points(cloud, MAX_SAMPLE / TOGETHER);
    let around = |&point: &usize| {
        observed.sampling.neighbours().nearest(cloud.point(point), TOGETHER).into_iter().map(|n| n.point)
    };
    let mut points: Vec<usize> = centres.iter().flat_map(around).collect();
    points.sort_unstable();
    points.dedup();
    points
}
