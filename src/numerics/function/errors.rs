//! How far off linear functionals of a fitted function are, if the values come from another process than its kernel's.
//!
//! What is served is linear in the values, `F̂ = wᵀY` with `w = (K + N)⁻¹Fk(X)`. Had the function the covariance k̂ about the mean m̂ and the
//! values the noise N̂, it would be off by `Fu − wᵀY`, whose mean square is
//! `FF′k̂ − 2wᵀFk̂(X) + wᵀ(K̂ + N̂)w + (Fm̂ − wᵀm̂(X))²`.

use faer::MatMut;
use rayon::prelude::*;

use super::functionals::{Covariant, JetFunctional};
use super::interpolant::Interpolant;
use crate::numerics::error::NumericsError;
use crate::numerics::kernel::Kernel;
use crate::numerics::machine::vector::dot;
use crate::numerics::observer::{Observer, Stage};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::trend::{Basis, Trend};
use crate::numerics::sums::many::values_of_each;
use crate::numerics::sums::regularization::Regularization;

/// What values come from: covariance, variance of the noise, which where each point has its own is the least, and mean.
pub(crate) struct Process<'a> {
    pub(crate) kernel: &'a Kernel,
    pub(crate) noise: f64,
    pub(crate) trend: Option<&'a Trend>,
}

/// Root mean square errors of functionals of a function, `[functionals]`, whose values come from a process that has their derivatives.
///
/// # Errors
/// [`NumericsError::MeanNotDetermined`], [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
pub(crate) fn errors_under(
    process: &Process<'_>,
    interpolant: &Interpolant,
    queries: &Cloud,
    functionals: &[JetFunctional],
    observer: &dyn Observer,
) -> Result<Vec<f64>, NumericsError> {
    let (solver, n) = (&interpolant.solver, interpolant.solver.n_points());
    let cloud = solver.cloud();
    observer.checkpoint()?;
    let weights = weights_on_values(interpolant, queries, functionals)?;
    observer.enter(Stage::Evaluate);
    let mut covariances = vec![0.0; n * functionals.len()];
    Covariant::of(cloud, process.kernel).fill(functionals, queries, &mut covariances);
    let images = values_of_each(cloud, process.kernel, &weights, cloud, observer)?;
    let means: Option<Vec<f64>> = process.trend.map(|trend| cloud.points().map(|x| trend.at(x)).collect());
    let noise: Vec<f64> = match solver.regularization() {
        Regularization::Uniform(_) => vec![process.noise; n],
        Regularization::PerPoint(given) => given.iter().map(|given| given.max(process.noise)).collect(),
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
        (spread.max(0.0) + of_noise + bias * bias).sqrt()
    };
    Ok((0..functionals.len()).into_par_iter().map(error).collect())
}

/// w of each functional, `[functionals, n]`: what it weighs the values with, those that the mean is found from included.
fn weights_on_values(
    interpolant: &Interpolant,
    queries: &Cloud,
    functionals: &[JetFunctional],
) -> Result<Vec<f64>, NumericsError> {
    let (solver, n) = (&interpolant.solver, interpolant.solver.n_points());
    let mut weights = vec![0.0; n * functionals.len()];
    Covariant::of(solver.cloud(), solver.kernel()).fill(functionals, queries, &mut weights);
    solver.solve_transposed_in_place(MatMut::from_column_major_slice_mut(&mut weights, n, functionals.len()));
    let Some(trend) = &interpolant.solution.trend else { return Ok(weights) };
    let basis: &Basis = trend.basis();
    let of_values = basis.functionals(solver).ok_or(NumericsError::MeanNotDetermined)?;
    let columns = basis.columns(solver.cloud());
    weights.par_chunks_exact_mut(n).zip(functionals).for_each(|(row, functional)| {
        let exact = functional.on_mean(basis, queries.point(functional.query));
        let excess: Vec<f64> =
            columns.chunks_exact(n).zip(&exact).map(|(function, exact)| dot(function, row) - exact).collect();
        for (functional, excess) in of_values.chunks_exact(n).zip(&excess) {
            row.iter_mut().zip(functional).for_each(|(weight, f)| *weight -= excess * f);
        }
    });
    Ok(weights)
}
