//! The Gaussian process behind the interpolant: variances, covariance and likelihood.
//!
//! Source: Rasmussen and Williams 2006, ch. 2. If the function has a mean, variances and covariances include
//! the uncertainty of its coefficients given the values.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef};
use rayon::prelude::*;

use super::COLUMNS_AT_ONCE;
use super::mean_variance::MeanVariance;
use crate::error::{NotDefinite, NumericsError, Result};
use crate::machine::parallelism::parallelism;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::Trend;
use crate::regression::solver::{Solution, Solver, WhitenedColumns};
use crate::regression::sums::gram::{fill_cross_gram, fill_lower_gram, mirror};
use crate::regression::sums::nodes::Nodes;
use crate::regression::sums::regularization::Regularization;

/// Posterior variances of the latent function, and the queries whose variance was clamped to 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Variances {
    /// `k₀ − |L⁻¹k(X, q)|² ≥ 0`, `[m]`, unit V². With a mean, its part is added.
    pub latent: Vec<f64>,
    /// Queries where `k₀ − |L⁻¹k(X, q)|²` was negative within rounding and was set to 0.
    pub clamped: Vec<usize>,
}

impl Variances {
    /// Returns the variances under a process whose variance is `factor` times as large.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.latent.iter_mut().for_each(|variance| *variance *= factor);
        self
    }
}

/// Posterior covariance of the latent function, and the queries whose variance was clamped to 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Symmetric `[m, m]`, unit V².
    pub latent: Vec<f64>,
    /// Queries whose variance, on the diagonal, was negative within rounding and was set to 0.
    pub clamped: Vec<usize>,
}

impl Covariance {
    /// Returns the covariance under a process whose variance is `factor` times as large.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.latent.iter_mut().for_each(|entry| *entry *= factor);
        self
    }
}

/// Returns the posterior variance of the latent function (no noise added) at queries `[m, d]`.
///
/// A negative result is set to 0 and reported, but only if it is at least −τ(q), with
/// `τ(q) = 4ε(k₀ + ‖K + αI‖₁|w|²)` and `w = (K + αI)⁻¹k(X, q)`.
///
/// ```
/// # use std::sync::Arc;
/// # use gramian_numerics::kernel::{Family, Kernel};
/// # use gramian_numerics::observer::Unobserved;
/// # use gramian_numerics::points::cloud::Cloud;
/// # use gramian_numerics::regression::solver::{Solver, System};
/// # use gramian_numerics::regression::sums::regularization::Regularization;
/// use gramian_numerics::regression::function::posterior::variances;
///
/// // 20 points of the unit interval.
/// let cloud = Arc::new(Cloud::new((0..20).map(|i| f64::from(i) / 19.0).collect(), 1)?);
/// let kernel = Kernel::new(Family::Matern { order: 2 }, 0.5, 1.0)?;
/// let system = System::new(cloud, kernel, Regularization::uniform(1e-8)?)?;
/// let solver = Solver::dense(system, &Unobserved)?;
/// let far = Cloud::new(vec![0.5, 30.0], 1)?;
/// let found = variances(&solver, &far, &Unobserved)?.latent;
/// assert!(found[0] < 1e-4 && found[1] > 0.999); // known among the points, the prior far away
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
///
/// # Errors
/// - `NumericsError::DimensionMismatch`.
/// - `NumericsError::NotPositiveDefinite` without a Cholesky factor, or if a variance is below −τ.
/// - `NumericsError::Cancelled`.
pub fn variances(solver: &Solver, queries: &Cloud, observer: &dyn Observer) -> Result<Variances> {
    variances_with_mean(solver, None, queries, observer)
}

/// Returns the [`variances`] of a function with a mean.
///
/// # Errors
/// Returns the errors of [`variances`], and `NumericsError::MeanNotDetermined`.
pub fn variances_with_mean(
    solver: &Solver,
    trend: Option<&Trend>,
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<Variances> {
    solver.cloud().check_same_dimension(queries)?;
    let k0 = solver.kernel().at_zero();
    let nodes = Nodes::of(solver.known_points());
    let of_mean = trend.map(|trend| MeanVariance::of(solver, trend, observer)).transpose()?;
    let mut variances = Variances { latent: Vec::with_capacity(queries.n_points()), clamped: Vec::new() };
    for rows in queries.coordinates().chunks(COLUMNS_AT_ONCE * queries.dimension()) {
        let block = Cloud::new(rows.to_vec(), queries.dimension())?;
        let whitened = whitened_cross_gram(solver, &nodes, &block, observer)?;
        let parts = whitened.columns.par_chunks_exact(whitened.n_rows).enumerate().map(|(query, column)| {
            let explained = whitened.explained(column, column);
            let of_mean = of_mean.as_ref().map(|mean| {
                let h = mean.unexplained_at(block.point(query), column);
                mean.product(&h, &h)
            });
            (explained, of_mean.unwrap_or(0.0))
        });
        for (k, (explained, of_mean)) in parts.collect::<Vec<_>>().into_iter().enumerate() {
            let query = variances.latent.len();
            let variance = k0 - explained;
            if variance.is_nan() || variance < 0.0 {
                check_is_rounding(solver, &nodes, query, block.point(k), variance, observer)?;
                variances.clamped.push(query);
            }
            variances.latent.push(variance.max(0.0) + of_mean);
        }
    }
    Ok(variances)
}

/// Returns the posterior covariance of the latent function, `k(Q, Q) − VᵀV` with V = L⁻¹k(X, Q).
///
/// Its diagonal is clamped as [`variances`] are.
///
/// # Errors
/// Returns the errors of [`variances`].
pub fn covariance(solver: &Solver, queries: &Cloud, observer: &dyn Observer) -> Result<Covariance> {
    covariance_with_mean(solver, None, queries, observer)
}

/// Returns the [`covariance`] of a function with a mean.
///
/// # Errors
/// Returns the errors of [`variances`], and `NumericsError::MeanNotDetermined`.
pub fn covariance_with_mean(
    solver: &Solver,
    trend: Option<&Trend>,
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<Covariance> {
    let m = queries.n_points();
    solver.cloud().check_same_dimension(queries)?;
    let nodes = Nodes::of(solver.known_points());
    let whitened = whitened_cross_gram(solver, &nodes, queries, observer)?;
    observer.enter(Stage::Evaluate);
    let mut covariance = vec![0.0; m * m];
    fill_lower_gram(queries, solver.kernel(), &Regularization::Uniform(0.0), &mut covariance, m, observer)?;
    let n = whitened.n_rows;
    let v = MatRef::from_column_major_slice(&whitened.columns, n, m);
    let (explaining, not_explaining) = v.split_at_row(whitened.n_explaining);
    let mut lower = MatMut::from_column_major_slice_mut(&mut covariance, m, m);
    for first in (0..m).step_by(COLUMNS_AT_ONCE) {
        observer.checkpoint()?;
        let width = COLUMNS_AT_ONCE.min(m - first);
        let par = parallelism((2 * n * width * (m - first)) as f64);
        for (v, sign) in [(explaining, -1.0), (not_explaining, 1.0)] {
            let (rows, columns) = (v.subcols(first, m - first), v.subcols(first, width));
            let block = lower.as_mut().submatrix_mut(first, first, m - first, width);
            matmul(block, Accum::Add, rows.transpose(), columns, sign, par);
        }
    }
    let mut clamped = Vec::new();
    for query in 0..m {
        let variance = &mut covariance[query * (m + 1)];
        if variance.is_nan() || *variance < 0.0 {
            check_is_rounding(solver, &nodes, query, queries.point(query), *variance, observer)?;
            clamped.push(query);
            *variance = 0.0;
        }
    }
    if let Some(trend) = trend {
        add_mean(&mut covariance, &MeanVariance::of(solver, trend, observer)?, queries, v);
    }
    mirror(&mut covariance, m);
    Ok(Covariance { latent: covariance, clamped })
}

/// Adds the mean's part to the lower triangle of the covariance. `v` is `L⁻¹k(X, Q)`, `[n, m]`.
fn add_mean(covariance: &mut [f64], mean: &MeanVariance<'_>, queries: &Cloud, v: MatRef<'_, f64>) {
    let m = queries.n_points();
    let at = |query: usize| {
        mean.unexplained_at(queries.point(query), &v.col(query).iter().copied().collect::<Vec<_>>())
    };
    let unexplained: Vec<Vec<f64>> = (0..m).into_par_iter().map(at).collect();
    covariance.par_chunks_exact_mut(m).enumerate().for_each(|(j, column)| {
        let pairs = column.iter_mut().zip(&unexplained).skip(j);
        pairs.for_each(|(entry, g)| *entry += mean.product(g, &unexplained[j]));
    });
}

/// Returns the log marginal likelihood `−½ YᵀΛ/f − ½ ln det(f(K + αI)) − ½ n ln 2π`.
///
/// Kernel and noise are f = `factor` times those of the solver (Rasmussen and Williams 2006, eq. 2.30). If
/// the function has a mean, this is the likelihood of the values given that mean.
///
/// # Errors
/// `NumericsError::NotPositiveDefinite` without a Cholesky factor.
pub fn log_marginal_likelihood(solver: &Solver, solution: &Solution, factor: f64) -> Result<f64> {
    let normalization = solver.n_points() as f64 * (2.0 * std::f64::consts::PI * factor).ln();
    Ok(-0.5 * (solution.energy / factor + solver.log_determinant()? + normalization))
}

/// Computes `L⁻¹ k(X, Q)`, one column per query.
fn whitened_cross_gram(
    solver: &Solver,
    nodes: &Nodes,
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<WhitenedColumns> {
    observer.enter(Stage::Evaluate);
    let mut columns = vec![0.0; nodes.n_points() * queries.n_points()];
    fill_cross_gram(nodes, solver.kernel(), queries, &mut columns, observer)?;
    observer.enter(Stage::Solve);
    solver.whitened(columns, observer)
}

/// Checks that a negative variance is at least −τ(q), the tolerance of [`variances`].
fn check_is_rounding(
    solver: &Solver,
    nodes: &Nodes,
    query: usize,
    x: &[f64],
    variance: f64,
    observer: &dyn Observer,
) -> Result<()> {
    if let Some(rounding) = solver.rounding_of_variances() {
        return if -variance <= rounding { Ok(()) } else { Err(negative(solver, query, variance)) };
    }
    let n = solver.n_points();
    let mut w = vec![0.0; n];
    let at_query = Cloud::new(x.to_vec(), x.len())?;
    fill_cross_gram(nodes, solver.kernel(), &at_query, &mut w, observer)?;
    solver.solve_in_place(MatMut::from_column_major_slice_mut(&mut w, n, 1), observer)?;
    let norm_squared: f64 = w.par_iter().map(|w| w * w).sum();
    let tolerance = 4.0 * f64::EPSILON * (solver.kernel().at_zero() + solver.norm1() * norm_squared);
    if -variance <= tolerance { Ok(()) } else { Err(negative(solver, query, variance)) }
}

fn negative(solver: &Solver, query: usize, variance: f64) -> NumericsError {
    solver.not_positive_definite(NotDefinite::NegativeVariance { query, variance })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::{Family, Kernel};
    use crate::observer::Unobserved;
    use crate::regression::solver::System;
    use crate::testing::{all_families, fibonacci_sphere};

    fn solver(cloud: &Cloud, family: Family, alpha: f64) -> Solver {
        let kernel = Kernel::new(family, 0.9, 2.0).unwrap();
        let alpha = Regularization::uniform(alpha).unwrap();
        System::new(Arc::new(cloud.clone()), kernel, alpha)
            .and_then(|system| Solver::dense(system, &Unobserved))
            .unwrap()
    }

    #[test]
    fn one_observation_has_the_textbook_posterior() {
        let cloud = Cloud::new(vec![0.0], 1).unwrap();
        let solver = solver(&cloud, Family::Gauss, 0.5);
        let queries = Cloud::new(vec![0.0, 0.9], 1).unwrap();
        let k = 2.0 * (-1.0f64).exp();
        let expected = [2.0 - 4.0 / 2.5, 2.0 - k * k / 2.5];
        let found = variances(&solver, &queries, &Unobserved).unwrap();
        assert!(found.latent.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-15));
        let covariance = covariance(&solver, &queries, &Unobserved).unwrap().latent;
        assert!((covariance[1] - (k - 2.0 * k / 2.5)).abs() < 1e-15);
        let solution = Solution::of(&solver, &[3.0], &Unobserved).unwrap();
        let likelihood = log_marginal_likelihood(&solver, &solution, 1.0).unwrap();
        let expected = -0.5 * (9.0 / 2.5 + 2.5f64.ln() + (2.0 * std::f64::consts::PI).ln());
        assert!((likelihood - expected).abs() < 1e-15);
    }

    #[test]
    fn variances_are_the_diagonal_of_the_covariance_and_lie_under_the_prior() {
        let cloud = fibonacci_sphere(80);
        // 300 queries: more than one block, inside, on and outside the sphere.
        let queries: Vec<f64> = (0..900).map(|i| 1.4 * (0.37 * i as f64).sin()).collect();
        let queries = Cloud::new(queries, 3).unwrap();
        for family in all_families() {
            let solver = solver(&cloud, family, 1e-4);
            let variances = variances(&solver, &queries, &Unobserved).unwrap().latent;
            let covariance = covariance(&solver, &queries, &Unobserved).unwrap().latent;
            let k0 = solver.kernel().at_zero();
            for (query, &variance) in variances.iter().enumerate() {
                assert!((variance - covariance[query * 301]).abs() < 1e-13 * k0, "{family:?}");
                assert!(variance >= 0.0 && variance <= k0 * (1.0 + 1e-15), "{family:?}");
            }
        }
    }

    #[test]
    fn far_from_the_cloud_the_variance_is_the_prior() {
        let cloud = fibonacci_sphere(30);
        let queries = Cloud::new(vec![1e40, 0.0, 0.0, 0.0, 1e100, 0.0], 3).unwrap();
        for family in all_families().into_iter().filter(|&f| f != Family::InverseMultiquadric) {
            let solver = solver(&cloud, family, 1e-6);
            let found = variances(&solver, &queries, &Unobserved).unwrap();
            assert_eq!(found.latent, [solver.kernel().at_zero(); 2], "{family:?}");
        }
    }

    #[test]
    fn at_observed_points_without_noise_the_variance_is_zero_and_clamping_is_reported() {
        let cloud = fibonacci_sphere(150);
        let solver = solver(&cloud, Family::Gauss, 0.0);
        let found = variances(&solver, &cloud, &Unobserved).unwrap();
        assert!(found.latent.iter().all(|&v| (0.0..1e-9).contains(&v)));
        assert!(!found.clamped.is_empty());
        assert!(found.clamped.iter().all(|&query| found.latent[query] == 0.0));
        let covariance = covariance(&solver, &cloud, &Unobserved).unwrap();
        assert!(!covariance.clamped.is_empty());
        assert!((0..150).all(|query| covariance.latent[query * 151] >= 0.0));
    }
}
