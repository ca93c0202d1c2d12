//! Errors of functionals of a fitted function, if the values come from another process than its kernel's.
//!
//! The estimate is linear in the values: `F̂ = wᵀY` with `w = (K + N)⁻¹Fk(X)`. Suppose that the true function
//! has covariance k̂ about the mean m̂, and that the values have the noise N̂. Then the error is `Fu − wᵀY`,
//! with the mean square
//! `FF′k̂ − 2wᵀFk̂(X) + wᵀ(K̂ + N̂)w + (Fm̂ − wᵀm̂(X))²`.

use faer::MatMut;
use rayon::prelude::*;

use super::functionals::{Covariant, JetFunctional};
use super::interpolant::Interpolant;
use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::vector::dot;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::Trend;
use crate::regression::sums::many::values_of_each;
use crate::regression::sums::regularization::Regularization;

/// Functionals whose weights, covariances and images are held at once: a pass over all pairs for each block.
pub(super) const JUDGED_AT_ONCE: usize = 64;

/// The process that values come from: covariance, noise and mean.
///
/// The actual covariance and noise are `factor` times `kernel` and `noise`. This keeps the latter within
/// float64 for values of any size.
pub(crate) struct Process<'a> {
    pub(crate) kernel: &'a Kernel,
    /// Variance of the noise. Where each point has its own, the least one.
    pub(crate) noise: f64,
    pub(crate) factor: f64,
    pub(crate) trend: Option<&'a Trend>,
}

/// A fitted function at queries, judged under a process.
pub(crate) struct Judgement<'a> {
    pub(crate) process: Process<'a>,
    pub(crate) interpolant: &'a Interpolant,
    pub(crate) queries: &'a Cloud,
}

impl Judgement<'_> {
    /// Returns the root mean square errors of functionals of the function, `[functionals]`.
    ///
    /// The process must have the derivatives that the functionals use.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::MeanNotDetermined`], [`crate::error::NumericsError::Overflow`],
    /// [`crate::error::NumericsError::Cancelled`].
    pub(crate) fn errors(&self, functionals: &[JetFunctional], observer: &dyn Observer) -> Result<Vec<f64>> {
        let mut found = Vec::with_capacity(functionals.len());
        for block in functionals.chunks(JUDGED_AT_ONCE) {
            // Normalised so that squares do not overflow.
            let sizes: Vec<f64> =
                block.iter().map(|functional| functional.size(self.process.kernel)).collect();
            let block: Vec<JetFunctional> =
                block.iter().zip(&sizes).map(|(of, &size)| of.over(size)).collect();
            let errors = self.errors_of_block(&block, observer)?;
            found.extend(errors.iter().zip(sizes).map(|(error, size)| error * size));
        }
        Ok(found)
    }

    /// Returns the root mean square errors of one block of functionals.
    fn errors_of_block(&self, functionals: &[JetFunctional], observer: &dyn Observer) -> Result<Vec<f64>> {
        let Self { process, interpolant, queries } = self;
        let (solver, n) = (&interpolant.solver, interpolant.solver.n_points());
        let cloud = solver.cloud();
        observer.checkpoint()?;
        let weights = self.weights_on_values(functionals, observer)?;
        observer.enter(Stage::Evaluate);
        let mut covariances = vec![0.0; n * functionals.len()];
        Covariant::of(cloud, process.kernel).fill(functionals, queries, &mut covariances);
        let images = values_of_each(cloud, process.kernel, &weights, cloud, observer)?;
        let means: Option<Vec<f64>> =
            process.trend.map(|trend| cloud.points().map(|x| trend.at(x)).collect());
        let noise: Vec<f64> = match solver.regularization() {
            Regularization::Uniform(_) => vec![process.noise; n],
            Regularization::PerPoint(given) => {
                given.iter().map(|given| (given / process.factor).max(process.noise)).collect()
            }
        };
        let error = |at: usize| {
            let functional = &functionals[at];
            let of = |all: &[f64]| -> f64 { dot(&all[at * n..][..n], &weights[at * n..][..n]) };
            let spread = functional.prior_variance(process.kernel) - 2.0 * of(&covariances) + of(&images);
            let own = &weights[at * n..][..n];
            let of_noise: f64 = own.iter().zip(&noise).map(|(weight, noise)| noise * weight * weight).sum();
            let bias = match (process.trend, &means) {
                (Some(trend), Some(means)) => functional.of_mean(trend, queries) - dot(means, own),
                _ => 0.0,
            };
            // Rounding may make the spread negative. NaN propagates.
            let spread = if spread < 0.0 { 0.0 } else { spread };
            (process.factor * (spread + of_noise) + bias * bias).sqrt()
        };
        Ok((0..functionals.len()).into_par_iter().map(error).collect())
    }

    /// Returns w of each functional, its weights on the values: `[functionals, n]`.
    ///
    /// If the function has a mean, w includes the estimate of its coefficients from the values.
    fn weights_on_values(&self, functionals: &[JetFunctional], observer: &dyn Observer) -> Result<Vec<f64>> {
        let Self { interpolant, queries, .. } = self;
        let (solver, n) = (&interpolant.solver, interpolant.solver.n_points());
        let mut weights = vec![0.0; n * functionals.len()];
        Covariant::of(solver.cloud(), solver.kernel()).fill(functionals, queries, &mut weights);
        let columns = MatMut::from_column_major_slice_mut(&mut weights, n, functionals.len());
        solver.solve_transposed_in_place(columns, observer)?;
        let Some(trend) = &interpolant.solution.trend else { return Ok(weights) };
        let basis = trend.basis();
        let exact = |at: usize| {
            let functional: &JetFunctional = &functionals[at];
            Some(functional.on_mean(basis, queries.point(functional.query)))
        };
        basis.make_exact(solver, &mut weights, exact, observer)?;
        Ok(weights)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::observer::Unobserved;
    use crate::regression::function::functionals::{ScaledFit, deviations, has_variance};
    use crate::regression::solver::trend::Mean;
    use crate::regression::solver::{Solver, System};
    use crate::testing::{all_families, fibonacci_sphere};

    const ALPHA: f64 = 1e-2;

    fn fit(kernel: &Kernel, mean: Mean) -> Interpolant {
        let cloud = Arc::new(fibonacci_sphere(60));
        let values: Vec<f64> = cloud.points().map(|x| 3.0 + (2.0 * x[0]).sin() - x[2]).collect();
        let system = System::new(cloud, kernel.clone(), Regularization::Uniform(ALPHA)).unwrap();
        let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
        Interpolant::fit_with_mean(solver, &values, mean, &Unobserved).unwrap()
    }

    fn functionals() -> (Cloud, Vec<JetFunctional>) {
        let queries = Cloud::new(vec![0.3, 0.8, 0.5, 0.0, 0.0, 1.1], 3).unwrap();
        let of = |query| {
            let bend = JetFunctional::second_derivative(query, 3, 0, 1);
            [JetFunctional::value(query, 3), JetFunctional::derivative(query, &[0.6, 0.0, -0.8]), bend]
        };
        (queries, [of(0), of(1)].concat())
    }

    /// Kriging is unbiased whatever the coefficients of the mean are, so its errors are its deviations.
    #[test]
    fn under_its_own_process_errors_are_the_deviations() {
        let (queries, functionals) = functionals();
        for family in all_families() {
            let kernel = Kernel::new(family, 1.3, 2.0).unwrap();
            if !has_variance(&kernel, 2) {
                continue;
            }
            for mean in [Mean::Zero, Mean::Constant, Mean::Linear] {
                let u = fit(&kernel, mean);
                let process =
                    Process { kernel: &kernel, noise: ALPHA, factor: 1.0, trend: u.solution.trend.as_ref() };
                let judgement = Judgement { process, interpolant: &u, queries: &queries };
                let found = judgement.errors(&functionals, &Unobserved).unwrap();
                let fit = ScaledFit { solver: &u.solver, solution: &u.solution, factor: 1.0 };
                let expected = deviations(fit, &queries, &functionals, &Unobserved).unwrap().found;
                for ((a, b), functional) in found.iter().zip(&expected).zip(&functionals) {
                    // Terms as large as the prior variance cancel, up to rounding.
                    let prior = functional.prior_variance(&kernel);
                    assert!((a * a - b * b).abs() <= 1e-11 * prior, "{family:?}, {mean:?}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn noise_that_nobody_told_and_means_that_are_left_out_show() {
        let (queries, functionals) = functionals();
        let kernel = Kernel::new(crate::kernel::Family::Gauss, 0.8, 1.0).unwrap();
        let (u, with_mean) = (fit(&kernel, Mean::Zero), fit(&kernel, Mean::Constant));
        let errors = |noise, trend| {
            let process = Process { kernel: &kernel, noise, factor: 1.0, trend };
            let judgement = Judgement { process, interpolant: &u, queries: &queries };
            judgement.errors(&functionals, &Unobserved).unwrap()
        };
        let told = errors(ALPHA, None);
        let untold = errors(100.0 * ALPHA, None);
        let about = errors(ALPHA, with_mean.solution.trend.as_ref());
        assert!(told.iter().zip(&untold).all(|(a, b)| b > a));
        // Far from all points u tends to 0 instead of the mean, which is about 3.
        assert!(about[0] > told[0], "{about:?} {told:?}");
    }
}
