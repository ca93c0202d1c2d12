//! Check of values against the kernel and the noise that they were fitted with.
//!
//! A Gaussian process predicts each value from the others, with a standard deviation. Where values are much
//! farther, its deviations are too short, there or everywhere.

use faer::MatMut;

use super::Solution;
use crate::error::{NumericsError, Result};
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::regression::solver::{Method, Solver};

/// Number of values that are examined. Those with the largest weights are about the ones that the others
/// explain worst.
const N_SUSPECTS: usize = 8;

/// Least standardised residual of an outlier. One normal number in five hundred million is beyond it.
const OUTLYING: f64 = 6.0;

/// Largest mean square of standardised residuals that is no contradiction, before five deviations of such a
/// mean are added.
const MEAN_SQUARE: f64 = 1.5;

/// The value that the others explain worst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    pub point: usize,
    /// Distance from what the others predict, in standard deviations.
    pub deviations: f64,
}

impl Outlier {
    /// Finds the largest standardised residual `|Λ_i|/√W_ii` with `W = (K + N)⁻¹` (Rasmussen and Williams
    /// 2006, eq. 5.12), each value given all others. The variance is that of the solver's kernel. `None` if
    /// there is no Cholesky factor.
    ///
    /// Only the values with the largest weights are examined. If the mean is found from the values as well,
    /// the exact residual is a little larger, since its denominator is then smaller.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn of(solver: &Solver, weights: &[f64], observer: &dyn Observer) -> Result<Option<Self>> {
        if solver.method() != Method::Cholesky {
            return Ok(None);
        }
        let (n, suspects) = (solver.n_points(), suspects(solver, weights));
        let mut columns = vec![0.0; n * suspects.len()];
        columns.chunks_exact_mut(n).zip(&suspects).for_each(|(column, &point)| column[point] = 1.0);
        let whitened = MatMut::from_column_major_slice_mut(&mut columns, n, suspects.len());
        match solver.whiten_in_place(whitened, observer) {
            Ok(()) => {}
            Err(NumericsError::Cancelled) => return Err(NumericsError::Cancelled),
            Err(_) => return Ok(None),
        }
        let found = columns.chunks_exact(n).zip(suspects);
        let found =
            found.map(|(column, point)| Self { point, deviations: weights[point].abs() / norm(column) });
        Ok(found.max_by(|a, b| a.deviations.total_cmp(&b.deviations)))
    }
}

/// Returns the points with the largest weights, measured by the noise where that differs.
fn suspects(solver: &Solver, weights: &[f64]) -> Vec<usize> {
    let (n, noise) = (solver.n_points(), solver.regularization());
    let mean = (0..n).map(|point| noise.at(point)).sum::<f64>() / n as f64;
    let floor = mean.max(f64::EPSILON * solver.kernel().at_zero());
    let size = |point: usize| weights[point].abs() * (noise.at(point) + floor).sqrt();
    let mut points: Vec<usize> = (0..n).collect();
    let count = N_SUSPECTS.min(n);
    let by_size = |a: &usize, b: &usize| size(*b).total_cmp(&size(*a)).then(a.cmp(b));
    points.select_nth_unstable_by(count - 1, by_size);
    points.truncate(count);
    points
}

/// Near values that are together farther off than chance explains, although none of them alone is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The point whose value is farthest off.
    pub point: usize,
    pub n_points: usize,
    /// Root mean square distance from what others predict, in standard deviations. The one or two values that
    /// are farthest off are left out.
    pub deviations: f64,
}

/// Correlation of near values, without what kernel and noise explain of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Autocorrelation {
    /// 0 for independent values, 1 for equal ones, −1 for opposite ones.
    pub coefficient: f64,
    /// Number of pairs of neighbours.
    pub n_pairs: usize,
}

/// Disagreement of values with the kernel and noise of their fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disagreement {
    /// The value that is farthest off, if it is off by more than six deviations.
    pub outlier: Option<Outlier>,
    /// The place that is farthest off, if places were examined and one is off.
    pub place: Option<Place>,
    /// Correlation of near neighbours, if they were examined and are correlated. Detail is then taken for
    /// noise.
    pub autocorrelation: Option<Autocorrelation>,
    /// Mean square of standardised residuals: each value without what those before it predict, in units of
    /// the deviations that these leave. It is 1 where kernel and noise are right.
    pub mean_square: f64,
}

impl Disagreement {
    /// Returns whether values contradict kernel and noise together with those near them: at a place, or by
    /// their correlation.
    pub fn is_of_near_values(&self) -> bool {
        self.place.is_some() || self.autocorrelation.is_some()
    }

    /// Returns the disagreement of values with this many degrees of freedom, or `None` if there is no
    /// contradiction. Its outlier is kept only if it is more than six deviations off.
    pub(crate) fn if_any(self, n_degrees: usize) -> Option<Self> {
        let outlier = self.outlier.filter(|outlier| outlier.deviations > OUTLYING);
        let most = MEAN_SQUARE + 5.0 * (2.0 / n_degrees as f64).sqrt();
        let is_any = outlier.is_some() || self.is_of_near_values() || self.mean_square > most;
        is_any.then_some(Self { outlier, ..self })
    }
}

impl Solution {
    /// Returns how the n values contradict a kernel and noise that are `scale` times those of the solver.
    pub fn disagreement(&self, n_points: usize, scale: f64) -> Option<Disagreement> {
        let n_functions = self.trend.as_ref().map_or(0, |trend| trend.basis().n_functions());
        let n_degrees = n_points.checked_sub(n_functions).filter(|&n_degrees| n_degrees > 0)?;
        let scaled = |outlier: Outlier| Outlier { deviations: outlier.deviations / scale.sqrt(), ..outlier };
        let mean_square = self.energy / scale / n_degrees as f64;
        Disagreement { outlier: self.outlier.map(scaled), place: None, autocorrelation: None, mean_square }
            .if_any(n_degrees)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::{Family, Kernel};
    use crate::observer::Unobserved;
    use crate::points::cloud::Cloud;
    use crate::regression::solver::System;
    use crate::regression::solver::trend::Mean;
    use crate::regression::sums::regularization::Regularization;
    use crate::testing::Random;

    /// Returns how a field on a line with noise of deviation 0.1 contradicts a kernel with noise variance
    /// `alpha`.
    fn contradiction(shift: f64, alpha: f64, scale: f64) -> Option<Disagreement> {
        let (n, mut random) = (300, Random(7));
        let cloud = Arc::new(Cloud::new((0..n).map(|i| 0.02 * f64::from(i)).collect(), 1).unwrap());
        let mut values: Vec<f64> =
            (0..n).map(|i| (0.02 * f64::from(i)).sin() + 0.1 * random.normal()).collect();
        values[170] += shift;
        let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
        let system = System::new(cloud, kernel, Regularization::uniform(alpha).unwrap()).unwrap();
        let solver = Solver::dense(system, &Unobserved).unwrap();
        let found = Solution::with_mean(&solver, &values, Mean::Constant, &Unobserved).unwrap();
        found.disagreement(values.len(), scale)
    }

    #[test]
    fn the_right_kernel_is_not_contradicted() {
        assert_eq!(contradiction(0.0, 0.01, 1.0), None);
        // Too much noise makes bars longer, which nothing contradicts.
        assert_eq!(contradiction(0.0, 0.1, 1.0), None);
    }

    #[test]
    fn one_value_that_is_off_is_named_with_its_residual() {
        let found = contradiction(1.0, 0.01, 1.0).unwrap();
        let outlier = found.outlier.unwrap();
        // Ten deviations of the noise, give or take the noise of the value and the error of what the others
        // predict.
        assert!(outlier.point == 170 && (7.0..13.0).contains(&outlier.deviations), "{found:?}");
        assert!(found.mean_square < 1.7, "{found:?}");
    }

    #[test]
    fn noise_that_is_called_too_small_is_seen_by_all_values() {
        let found = contradiction(0.0, 1e-4, 1.0).unwrap();
        assert!((50.0..150.0).contains(&found.mean_square), "{found:?}");
        // A kernel whose variance and noise are smaller in proportion gives the same by its factor.
        let scaled = contradiction(0.0, 0.01, 0.01).unwrap();
        assert!((50.0..150.0).contains(&scaled.mean_square), "{scaled:?}");
        assert!(scaled.outlier.is_some());
    }

    #[test]
    fn exact_values_of_a_kernel_that_is_too_smooth_are_a_contradiction() {
        let n = 60;
        let cloud = Arc::new(Cloud::new((0..n).map(|i| 0.1 * f64::from(i)).collect(), 1).unwrap());
        let step: Vec<f64> = (0..n).map(|i| if i < 25 { 0.0 } else { 1.0 }).collect();
        let kernel = Kernel::new(Family::Matern { order: 2 }, 1.0, 1.0).unwrap();
        let system = System::new(cloud, kernel, Regularization::uniform(1e-8).unwrap()).unwrap();
        let solver = Solver::dense(system, &Unobserved).unwrap();
        let found = Solution::with_mean(&solver, &step, Mean::Constant, &Unobserved).unwrap();
        let outlier = found.disagreement(step.len(), 1.0).unwrap().outlier.unwrap();
        assert!((24..=25).contains(&outlier.point), "{outlier:?}");
    }
}
