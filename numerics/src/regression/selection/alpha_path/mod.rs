//! Scores of a criterion for many α at once.
//!
//! With `K = QDQᵀ`, `(K + αI)⁻¹ = Q(D + αI)⁻¹Qᵀ` for every α. One eigendecomposition therefore serves all α
//! (Golub, Heath and Wahba 1979, sec. 3). With a mean, likewise, `P = U(D + αI)⁻¹Uᵀ`. U holds the
//! eigenvectors of K restricted to the orthogonal complement of the functions of the mean.
//!
//! An eigendecomposition cannot be cancelled. A large matrix is therefore factorized for each α if there are
//! few of them. For 61 α this takes two to four times as many flops, but all of them are in matrix products.

mod spectrum;

use std::f64::consts::TAU;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef};
use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::parallelism::parallelism;
use crate::machine::vector::dot;
use crate::observer::{Observer, Stage};
use crate::regression::selection::criterion::{Criterion, Parts};
use crate::regression::selection::evaluation::Evaluator;
use crate::regression::selection::parameters::Hyperparameters;
use crate::regression::selection::subject::{Observations, Subject};
use crate::regression::solver::trend::solve_gram;
use crate::regression::sums::regularization::Regularization;
use spectrum::Spectrum;

/// Number of α that are handled together, as columns of a matrix.
pub(super) const ALPHAS_AT_ONCE: usize = 256;

/// Largest number of points for which a matrix is decomposed whatever the number of α. It takes less than a
/// second.
const SMALL: usize = 1000;

/// Largest number of α for which a larger matrix is factorized for each of them.
const FEW: usize = 120;

/// Returns whether one eigendecomposition serves all α.
pub(super) fn is_decomposed(n_points: usize, n_alphas: usize) -> bool {
    n_points <= SMALL || n_alphas > FEW
}

/// Returns the score with each α as the noise of every point, `[len(alphas)]`. Greater is better. Scores are
/// NaN where `K + αI` is not positive definite in float64. The noise of the hyperparameters is ignored.
///
/// # Errors
/// `NumericsError::InvalidRegularization` for an α that is negative or not finite.
/// `NumericsError::LengthMismatch`, `NumericsError::MeanNotDetermined`, `NumericsError::Cancelled`.
/// Also the errors of [`Hyperparameters::kernel_on`].
pub fn alpha_path(
    observations: Observations<'_>,
    at: &Hyperparameters,
    alphas: &[f64],
    criterion: Criterion,
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    for &alpha in alphas {
        Regularization::uniform(alpha)?;
    }
    let path = Path { subject: Subject::of(observations)?, at, alphas, criterion };
    if is_decomposed(observations.cloud.n_points(), alphas.len()) {
        path.by_spectrum(observer)
    } else {
        path.by_factors(observer)
    }
}

/// Values with the α to score.
struct Path<'a> {
    subject: Subject<'a>,
    at: &'a Hyperparameters,
    alphas: &'a [f64],
    criterion: Criterion,
}

impl Path<'_> {
    /// Scores each α by a factorization of its own.
    fn by_factors(&self, observer: &dyn Observer) -> Result<Vec<f64>> {
        let mut evaluator = Evaluator::new(&self.subject, self.criterion, false);
        let score = |&alpha: &f64| {
            let at = Hyperparameters { noise: Regularization::uniform(alpha)?, ..self.at.clone() };
            Ok(evaluator.score(&at, observer)?.map_or(f64::NAN, |state| state.score))
        };
        self.alphas.iter().map(score).collect()
    }

    /// Scores all α by one eigendecomposition.
    fn by_spectrum(&self, observer: &dyn Observer) -> Result<Vec<f64>> {
        let Self { subject, at, alphas, criterion } = self;
        let kernel = at.kernel_on(subject.cloud)?;
        let is_restricted = criterion.needs_diagonal() && subject.n_functions > 0;
        let spectrum = Spectrum::of(subject, &kernel, is_restricted, observer)?;
        observer.enter(Stage::Evaluate);
        match criterion {
            Criterion::MarginalLikelihood => spectrum.likelihoods(subject, alphas, observer),
            Criterion::LeaveOneOut => spectrum.left_out(alphas, observer),
            Criterion::GeneralizedCrossValidation => spectrum.cross_validations(alphas, observer),
        }
    }
}

/// Returns `n_alphas` values of α, ascending in equal ratios, that cover all α that can matter. At the least,
/// the eigenvalues of K below α are rounding. At the greatest, n k₀, everything counts as noise.
pub fn default_alphas(n_points: usize, kernel: &Kernel, n_alphas: usize) -> Vec<f64> {
    let (n, k0) = (n_points as f64, kernel.at_zero());
    let (min, max) = ((16.0 * n * n * f64::EPSILON * k0).max(1e-12 * k0), n * k0);
    let ratio = |step: usize| step as f64 / (n_alphas.max(2) - 1) as f64;
    (0..n_alphas).map(|step| min * (max / min).powf(ratio(step))).collect()
}

impl Spectrum {
    /// Returns the log likelihoods `−½(Σ w z² + ln det(K + αI) + n ln 2π)`, w = 1/(D + α), in O(np²) flops
    /// for each α. z is the rotated values without their mean.
    fn likelihoods(
        &self,
        subject: &Subject<'_>,
        alphas: &[f64],
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        let (n, p) = (self.n, subject.n_functions);
        let turned = |function: &[f64]| -> Vec<f64> {
            self.vectors.par_chunks_exact(n).map(|u| dot(u, function)).collect()
        };
        let functions: Vec<Vec<f64>> = subject.functions.chunks_exact(n).map(turned).collect();
        let score = |&alpha: &f64| {
            observer.checkpoint()?;
            let Some(inverse) = self.inverse(alpha) else { return Ok(f64::NAN) };
            let product = |a: &[f64], b: &[f64]| -> f64 {
                inverse.iter().zip(a.iter().zip(b)).map(|(w, (a, b))| w * a * b).sum()
            };
            let gram = Mat::from_fn(p, p, |a, b| product(&functions[a], &functions[b]));
            let moments = Mat::from_fn(p, 1, |a, _| product(&functions[a], &self.values));
            let mut rest = self.values.clone();
            if p > 0 {
                let Some(solved) = solve_gram(&gram, moments) else { return Ok(f64::NAN) };
                for (a, function) in functions.iter().enumerate() {
                    rest.iter_mut().zip(function).for_each(|(rest, f)| *rest -= solved[(a, 0)] * f);
                }
            }
            let log_determinant = -inverse.iter().map(|w| w.ln()).sum::<f64>();
            Ok(-0.5 * (product(&rest, &rest) + log_determinant + n as f64 * TAU.ln()))
        };
        alphas.par_iter().map(score).collect()
    }

    /// Returns the leave-one-out scores, from `P_ii = Σ_k U_ik²/(D_k + α)` and `Λ = U(D + α)⁻¹UᵀY`. Many α
    /// take two matrix products.
    fn left_out(&self, alphas: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let (n, r) = (self.n, self.eigenvalues.len());
        let squares: Vec<f64> = self.vectors.par_iter().map(|u| u * u).collect();
        let squares = MatRef::from_column_major_slice(&squares, n, r);
        let mut scores = Vec::with_capacity(alphas.len());
        for alphas in alphas.chunks(ALPHAS_AT_ONCE) {
            observer.checkpoint()?;
            let undefined = || vec![f64::NAN; r];
            let inverses: Vec<f64> =
                alphas.iter().flat_map(|&alpha| self.inverse(alpha).unwrap_or_else(undefined)).collect();
            let diagonals = product(squares, &inverses, alphas.len());
            observer.checkpoint()?;
            let turned: Vec<f64> =
                inverses.iter().zip(self.values.iter().cycle()).map(|(w, y)| w * y).collect();
            let weights = product(self.vectors(), &turned, alphas.len());
            let score = |(weights, diagonal): (&[f64], &[f64])| {
                let parts =
                    Parts { energy: 0.0, log_determinant: 0.0, weights, diagonal, relative_noise: &[] };
                Criterion::LeaveOneOut.score(&parts)
            };
            scores.extend(weights.chunks_exact(n).zip(diagonals.chunks_exact(n)).map(score));
        }
        Ok(scores)
    }

    /// Returns the scores of generalised cross-validation, `−n Σ (w UᵀY)²/(Σ w)²` with w = 1/(D + α).
    fn cross_validations(&self, alphas: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let score = |&alpha: &f64| {
            observer.checkpoint()?;
            let Some(inverse) = self.inverse(alpha) else { return Ok(f64::NAN) };
            let misfit: f64 = inverse.iter().zip(&self.values).map(|(w, y)| (w * y).powi(2)).sum();
            let freedom: f64 = inverse.iter().sum();
            Ok(-(self.n as f64) * misfit / (freedom * freedom))
        };
        alphas.iter().map(score).collect()
    }
}

/// Returns the product of an `[n, r]` and an `[r, m]` matrix, column by column.
fn product(left: MatRef<'_, f64>, right: &[f64], m: usize) -> Vec<f64> {
    let (n, r) = (left.nrows(), left.ncols());
    let mut found = vec![0.0; n * m];
    let out = MatMut::from_column_major_slice_mut(&mut found, n, m);
    let par = parallelism(2.0 * (n * r * m) as f64);
    matmul(out, Accum::Replace, left, MatRef::from_column_major_slice(right, r, m), 1.0, par);
    found
}

#[cfg(test)]
mod tests;
