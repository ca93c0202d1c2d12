//! Landmarks: weights at r points whose kernels span those of all others, for smooth kernels.
//!
//! At a fixed length scale the numerical rank of a smooth kernel's matrix does not grow with the number of
//! points. So pivots Z are chosen among the points, until little remains of the diagonal, and
//!
//! ```text
//! K ≈ K̂ = M K_ZZ Mᵀ,   M = K(X, Z) K_ZZ⁻¹,   K_ZZ = L₁₁L₁₁ᵀ
//! ```
//!
//! With the noise D and `W = s D⁻¹`, s its smallest entry, the weights b of the pivots follow from normal
//! equations, in either of two unknowns:
//!
//! ```text
//! u(q) = k(q, Z) b,   F = M L₁₁ = K(X, Z) L₁₁⁻ᵀ
//! (FᵀWF + s I) β = FᵀW Y,        b = L₁₁⁻ᵀβ    where s is not small
//! (MᵀWM + s K_ZZ⁻¹) g = MᵀW Y,   b = K_ZZ⁻¹g   where it is
//! ```
//!
//! g are the values of u at the pivots. Pivoting bounds the entries of M, so the second equations are well
//! conditioned where s is next to nothing. F and M are solved for block by block and never held: memory is
//! O(r²), and a pass over the points takes n r² or 2 n r² flops. L_B is the Cholesky factor of either matrix.
//! What is known of a functional with covariances c at the pivots, and with w as its row of F or M, is
//!
//! ```text
//! |L₁₁⁻¹c|² − s |L_B⁻¹w|²
//! ```
//!
//! Sources: Rasmussen and Williams 2006, sec. 8.3, for the process with K̂; Harbrecht, Peters and Schneider
//! 2012 for pivoted Cholesky without the matrix.

mod normal;
mod pivots;
pub(crate) mod price;
mod probe;
mod residual;
mod rows;

use std::convert::Infallible;
use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatMut, MatRef};

use super::condition::estimate_norm1;
use super::conjugate_gradients::Preconditioned;
use super::system::System;
use crate::error::Result;
use crate::machine::heap::vec_bytes;
use crate::machine::parallelism::parallelism;
use crate::machine::vector::dot;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::sums::expansion::Expansion;
use normal::NormalEquations;
use pivots::{LandmarkChoice, SAMPLE};
pub use probe::{expected_landmarks, probe_price};
pub(super) use residual::TrueResidual;
use rows::{Coordinates, Rows};

/// Number of points up to which the true system is solved too. A product with its matrix takes n² pairs.
pub(super) const MOST_PRECONDITIONED: usize = 100_000;

/// Rounds in which pivots are completed from what remains of the diagonal over all points.
const ROUNDS: usize = 2;

/// Noise of each point as weights of its row.
pub(super) struct Weighing {
    /// s: the smallest noise variance, V².
    scale: f64,
    /// `W = s / d`, `[n]`.
    weights: Vec<f64>,
    /// True if all weights are 1.
    is_uniform: bool,
}

/// A system solved on its landmarks.
pub struct Landmarks {
    system: System,
    /// The pivots Z.
    rows: Rows,
    /// L_B, lower, `[r, r]`.
    inner: Mat<f64>,
    /// The right-hand side of the constant 1, `[r]`.
    of_one: Vec<f64>,
    weighing: Weighing,
    tolerance: f64,
    remaining: f64,
    log_determinant: f64,
}

/// A step of iterative refinement.
struct Refinement {
    /// The step, `[r]`.
    correction: Vec<f64>,
    /// `Y − Fβ` before it, `[n]`.
    rest: Vec<f64>,
}

/// What the landmarks make of some values.
pub(super) struct LandmarkFit {
    /// Λ, `[n]`: `D⁻¹(Y − u)`.
    pub weights: Vec<f64>,
    /// b, `[r]`.
    pub at_landmarks: Vec<f64>,
    /// u at the points, `[n]`.
    pub at_points: Vec<f64>,
    /// `bᵀK_ZZ b`.
    pub native_norm_squared: f64,
    /// `Yᵀ(K̂ + D)⁻¹Y`.
    pub energy: f64,
}

impl Landmarks {
    /// Chooses landmarks and factorizes their normal equations.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::RankTooLarge`] if the kernel needs too many.
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn of(system: &System, observer: &dyn Observer) -> Result<Self> {
        observer.enter(Stage::Gram);
        let weighing = Weighing::of(system);
        let mut chosen = LandmarkChoice::among_sample(system, observer)?;
        // A look at a few points beforehand saves most of the passes over all that would be in vain.
        let beyond =
            if system.n_points() > SAMPLE { chosen.beyond_at_some(system, observer)? } else { Vec::new() };
        if !beyond.is_empty() {
            chosen = chosen.completed(system, &beyond, observer)?;
        }
        observer.enter(Stage::Factor);
        chosen.rows.keep(system, observer)?;
        let mut normal = NormalEquations::of(system, &chosen, &weighing, observer)?;
        for _ in 0..ROUNDS {
            if normal.beyond.is_empty() {
                break;
            }
            chosen = chosen.completed(system, &normal.beyond, observer)?;
            chosen.rows.keep(system, observer)?;
            normal = NormalEquations::of(system, &chosen, &weighing, observer)?;
        }
        let NormalEquations { inner, of_one, remaining, .. } = normal;
        let of_kernel = chosen.rows.coordinates() == Coordinates::AtLandmarks;
        let LandmarkChoice { rows, tolerance } = chosen;
        let noise = |point: usize| (weighing.scale / weighing.weights[point]).ln();
        let log_noise: f64 = (0..system.n_points()).map(noise).sum();
        let of_factor =
            |factor: &Mat<f64>| (0..factor.nrows()).map(|k| 2.0 * factor[(k, k)].ln()).sum::<f64>();
        let rank = rows.n_landmarks() as f64;
        let of_prior = if of_kernel { of_factor(rows.l11()) } else { 0.0 };
        let log_determinant = log_noise + of_prior + of_factor(&inner) - rank * weighing.scale.ln();
        let system = system.clone();
        Ok(Self { system, rows, inner, of_one, weighing, tolerance, remaining, log_determinant })
    }

    pub(super) fn rank(&self) -> usize {
        self.rows.n_landmarks()
    }

    /// The landmarks Z.
    pub(super) fn cloud(&self) -> &Arc<Cloud> {
        self.rows.cloud()
    }

    /// Indices of the landmarks among the points.
    pub(super) fn points(&self) -> &[usize] {
        self.rows.points()
    }

    /// Largest entry that remains of the diagonal `k₀ − |L₁₁⁻¹k(Z, x)|²`, over all points, V².
    pub(super) fn remaining(&self) -> f64 {
        self.remaining
    }

    /// What was to remain at most, V².
    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// `ln det(K̂ + D)`.
    pub(super) fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Estimates ‖(K + D)⁻¹‖₁, 1/V².
    ///
    /// With fewer landmarks than points, K is singular up to what remains of its diagonal, so the noise
    /// decides. Where every point is a landmark, the eigenvalues of K may be larger than the noise.
    pub(super) fn inverse_norm1(&self) -> f64 {
        let of_noise = 1.0 / self.weighing.scale;
        if self.rank() < self.system.n_points() {
            return of_noise;
        }
        let solve = |mut x: MatMut<'_, f64>| {
            self.rows.whiten(x.as_mut());
            self.rows.solve_upper(x);
            Ok::<(), Infallible>(())
        };
        let Ok((of_kernel, _)) = estimate_norm1(self.rank(), solve, solve);
        of_kernel.min(of_noise)
    }

    /// Fits values `[n]`.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn fit(&self, values: &[f64], observer: &dyn Observer) -> Result<LandmarkFit> {
        let mut unknowns = self.unknowns(values, 1, observer)?;
        let at_points = match self.rows.coordinates() {
            Coordinates::Whitened => {
                let Refinement { correction, rest } = self.refinement(values, &unknowns, observer)?;
                unknowns.iter_mut().zip(&correction).for_each(|(x, step)| *x += step);
                // The correction is small, so a sum of kernels is accurate enough for it.
                let steps = self.sums_at_points(correction, observer)?;
                values.iter().zip(&rest).zip(steps).map(|((y, rest), step)| y - rest + step).collect()
            }
            // Their residual is no more accurate than they are.
            Coordinates::AtLandmarks => self.sums_at_points(unknowns.clone(), observer)?,
        };
        let weights = self.weights(values, &at_points);
        let at_landmarks = self.weights_of(unknowns.clone());
        let native_norm_squared = match self.rows.coordinates() {
            Coordinates::Whitened => dot(&unknowns, &unknowns),
            Coordinates::AtLandmarks => dot(&unknowns, &at_landmarks),
        };
        let rest = values.iter().zip(&at_points).zip(&weights);
        let energy = native_norm_squared + rest.map(|((y, u), w)| (y - u) * w).sum::<f64>();
        Ok(LandmarkFit { weights, at_landmarks, at_points, native_norm_squared, energy })
    }

    /// The weights b of an expansion: in the order of the points, if all of them are landmarks.
    pub(super) fn as_expansion(&self, at_landmarks: Vec<f64>) -> Vec<f64> {
        if self.rank() < self.system.n_points() {
            return at_landmarks;
        }
        let mut weights = vec![0.0; self.rank()];
        self.points().iter().zip(at_landmarks).for_each(|(&point, weight)| weights[point] = weight);
        weights
    }

    /// Whether the true system is solved too, with the landmarks as preconditioner, so that the function is
    /// that of the dense solver to its last digits. Without noise to speak of, the landmarks alone are that,
    /// but not where some values have noise and others none: weights of the latter are rounding errors of the
    /// function over next to nothing.
    pub(super) fn preconditions(&self) -> bool {
        let has_noise = self.rows.coordinates() == Coordinates::Whitened || !self.weighing.is_uniform;
        has_noise && self.system.n_points() <= MOST_PRECONDITIONED
    }

    /// The weights b of unknowns `[r]`.
    fn weights_of(&self, mut unknowns: Vec<f64>) -> Vec<f64> {
        self.rows.to_weights(MatMut::from_column_major_slice_mut(&mut unknowns, self.rank(), 1));
        unknowns
    }

    /// u at the points, `[n]`, for unknowns `[r]`, as a sum of kernels. It takes n r pairs, where the rows
    /// take n r² flops, but large weights cost digits.
    fn sums_at_points(&self, unknowns: Vec<f64>, observer: &dyn Observer) -> Result<Vec<f64>> {
        let weights = self.weights_of(unknowns);
        let (centres, kernel) = (self.cloud(), self.system.kernel());
        Expansion { centres, kernel, weights: &weights }.values_at(self.system.cloud(), observer)
    }

    /// Overwrites the columns of `[n, k]` values by `(K̂ + D)⁻¹` times them.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn solve_in_place(&self, mut values: MatMut<'_, f64>, observer: &dyn Observer) -> Result<()> {
        let (n, k) = (values.nrows(), values.ncols());
        let columns: Vec<f64> =
            (0..k).flat_map(|j| (0..n).map(move |i| (i, j))).map(|at| values[at]).collect();
        let at_points = self.at_points(&self.unknowns(&columns, k, observer)?, k, observer)?;
        for (j, (list, at_points)) in columns.chunks_exact(n).zip(at_points.chunks_exact(n)).enumerate() {
            let weights = self.weights(list, at_points);
            weights.iter().enumerate().for_each(|(i, w)| values[(i, j)] = *w);
        }
        Ok(())
    }

    /// Overwrites functionals of the weights b, given at all points `[n, k]` of which only the landmarks
    /// count, by functionals of the values: `W M (MᵀWM + sK_ZZ⁻¹)⁻¹ K_ZZ⁻¹ f_Z`.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn solve_transposed_in_place(
        &self,
        mut functionals: MatMut<'_, f64>,
        observer: &dyn Observer,
    ) -> Result<()> {
        let (n, k) = (functionals.nrows(), functionals.ncols());
        let mut g = Mat::from_fn(self.rank(), k, |i, j| functionals[(self.points()[i], j)]);
        self.rows.to_row(g.as_mut());
        self.solve_inner(g.as_mut());
        let g: Vec<f64> = (0..k).flat_map(|j| g.col(j).iter().copied().collect::<Vec<_>>()).collect();
        let at_points = self.at_points(&g, k, observer)?;
        for j in 0..k {
            for i in 0..n {
                functionals[(i, j)] = self.weighing.weights[i] * at_points[j * n + i];
            }
        }
        Ok(())
    }

    /// Whitens covariances with the landmarks, `[r, k]` column by column, to `[2 r, k]`: `L₁₁⁻¹c` above
    /// `√s L_B⁻¹ K_ZZ⁻¹ c`.
    pub(super) fn whitened(&self, covariances: &[f64]) -> Vec<f64> {
        let rank = self.rank();
        let k = covariances.len() / rank;
        let mut first = covariances.to_vec();
        let par = parallelism((2 * rank * rank * k) as f64);
        self.rows.whiten(MatMut::from_column_major_slice_mut(&mut first, rank, k));
        let mut second = covariances.to_vec();
        let mut columns = MatMut::from_column_major_slice_mut(&mut second, rank, k);
        self.rows.to_row(columns.as_mut());
        solve_lower_triangular_in_place(self.inner.as_ref(), columns.as_mut(), par);
        let root = self.weighing.scale.sqrt();
        let mut found = Vec::with_capacity(2 * rank * k);
        for (first, second) in first.chunks_exact(rank).zip(second.chunks_exact(rank)) {
            found.extend_from_slice(first);
            found.extend(second.iter().map(|x| root * x));
        }
        found
    }

    /// Whitens values `[n, k]` so that the product with [`Landmarks::whitened`] covariances is what the fit
    /// of the values predicts, `[2 r, k]`.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn whitened_values(&self, values: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let (rank, k) = (self.rank(), values.len() / self.system.n_points());
        let g = self.unknowns(values, k, observer)?;
        let lower = Mat::from_fn(rank, rank, |i, j| if i < j { 0.0 } else { self.inner[(i, j)] });
        let product = lower.transpose() * MatRef::from_column_major_slice(&g, rank, k);
        let factor = -1.0 / self.weighing.scale.sqrt();
        let column = |j: usize| {
            let below = (0..rank).map(|i| factor * product[(i, j)]).collect::<Vec<f64>>();
            std::iter::repeat_n(0.0, rank).chain(below).collect::<Vec<f64>>()
        };
        Ok((0..k).flat_map(column).collect())
    }

    /// One step of iterative refinement, in one pass. The residual `FᵀW(Y − Fβ) − sβ` is as accurate as
    /// `Y − Fβ`, while the factor has lost digits by s being small.
    fn refinement(&self, values: &[f64], unknowns: &[f64], observer: &dyn Observer) -> Result<Refinement> {
        let rank = self.rank();
        let mut right = Mat::from_fn(rank, 1, |k, _| -self.weighing.scale * unknowns[k]);
        let beta = MatRef::from_column_major_slice(unknowns, rank, 1);
        let mut rest = values.to_vec();
        self.rows.for_each_block(&self.system, observer, |points, block| {
            let par = parallelism((2 * rank * points.len()) as f64);
            let rest = &mut rest[points.clone()];
            let left = MatMut::from_column_major_slice_mut(rest, points.len(), 1);
            matmul(left, Accum::Add, block.rows.transpose(), beta, -1.0, par);
            let weights = &self.weighing.weights[points];
            let weighed = Mat::from_fn(rest.len(), 1, |i, _| weights[i] * rest[i]);
            matmul(right.as_mut(), Accum::Add, block.rows, weighed.as_ref(), 1.0, par);
        })?;
        self.solve_inner(right.as_mut());
        Ok(Refinement { correction: (0..rank).map(|k| right[(k, 0)]).collect(), rest })
    }

    /// β or g, `[r, k]`, for values `[n, k]`.
    fn unknowns(&self, values: &[f64], k: usize, observer: &dyn Observer) -> Result<Vec<f64>> {
        let is_one = k == 1 && values.iter().all(|&value| value == 1.0);
        let mut right = if is_one {
            Mat::from_fn(self.rank(), 1, |i, _| self.of_one[i])
        } else {
            self.right(values, k, observer)?
        };
        self.solve_inner(right.as_mut());
        Ok((0..k).flat_map(|j| right.col(j).iter().copied().collect::<Vec<_>>()).collect())
    }

    /// `FᵀWY` or `MᵀWY`, `[r, k]`, for values `[n, k]`.
    fn right(&self, values: &[f64], k: usize, observer: &dyn Observer) -> Result<Mat<f64>> {
        let (n, rank) = (self.system.n_points(), self.rank());
        let mut right = Mat::zeros(rank, k);
        self.rows.for_each_block(&self.system, observer, |points, block| {
            let weighed = |i: usize, j: usize| {
                let point = points.start + i;
                self.weighing.weights[point] * values[j * n + point]
            };
            let weighed = Mat::from_fn(points.len(), k, weighed);
            let par = parallelism((2 * rank * k * points.len()) as f64);
            matmul(right.as_mut(), Accum::Add, block.rows, weighed.as_ref(), 1.0, par);
        })?;
        Ok(right)
    }

    /// `Fβ` or `Mg`, u at the points, `[n, k]`, for unknowns `[r, k]`.
    fn at_points(&self, g: &[f64], k: usize, observer: &dyn Observer) -> Result<Vec<f64>> {
        let (n, rank) = (self.system.n_points(), self.rank());
        let g = MatRef::from_column_major_slice(g, rank, k);
        let mut found = vec![0.0; n * k];
        self.rows.for_each_block(&self.system, observer, |points, block| {
            let mut at = MatMut::from_column_major_slice_mut(&mut found, n, k);
            let rows = at.as_mut().subrows_mut(points.start, points.len());
            let par = parallelism((2 * rank * k * points.len()) as f64);
            matmul(rows, Accum::Replace, block.rows.transpose(), g, 1.0, par);
        })?;
        Ok(found)
    }

    /// `D⁻¹(Y − u)`.
    fn weights(&self, values: &[f64], at_points: &[f64]) -> Vec<f64> {
        let Weighing { scale, weights, .. } = &self.weighing;
        let rest = values.iter().zip(at_points).zip(weights);
        rest.map(|((y, u), w)| (y - u) * w / scale).collect()
    }

    /// `x ← (L_B L_Bᵀ)⁻¹x`.
    fn solve_inner(&self, mut x: MatMut<'_, f64>) {
        let par = parallelism((2 * self.rank() * self.rank() * x.ncols()) as f64);
        solve_lower_triangular_in_place(self.inner.as_ref(), x.as_mut(), par);
        solve_upper_triangular_in_place(self.inner.transpose(), x, par);
    }

    /// Bytes held on the heap, without the cloud.
    pub(super) fn n_bytes(&self) -> usize {
        let square = self.rank() * self.rank() * size_of::<f64>();
        2 * square
            + vec_bytes(&self.weighing.weights)
            + self.rows.cloud().n_bytes()
            + self.rows.n_bytes_kept()
    }
}

impl Preconditioned for Landmarks {
    fn n_points(&self) -> usize {
        self.system.n_points()
    }

    fn product(&self, columns: &[f64], _accuracy: f64, observer: &dyn Observer) -> Result<Vec<f64>> {
        self.system.times(columns, observer)
    }

    fn precondition(&self, columns: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let n = self.n_points();
        let precondition = |column: &[f64]| -> Result<Vec<f64>> {
            let unknowns = self.unknowns(column, 1, observer)?;
            // Sums of kernels are accurate enough for a preconditioner.
            Ok(self.weights(column, &self.sums_at_points(unknowns, observer)?))
        };
        Ok(columns.chunks_exact(n).map(precondition).collect::<Result<Vec<_>>>()?.concat())
    }
}

/// Multiple of the smallest noise that exact values count as having. Without any, their rows would outweigh
/// all others.
const LEAST_NOISE: f64 = 1e-6;

/// Rounding of the whitened normal equations, over their smallest eigenvalue, up to which refinement makes
/// up for it.
const LEAST_DIGITS: f64 = 1e-3;

impl Weighing {
    /// Points without noise get a millionth of the smallest noise, or rounding where no point has any.
    fn of(system: &System) -> Self {
        let (n, noise) = (system.n_points(), system.regularization());
        let rounding = super::dense::PIVOT_TOLERANCE * system.kernel().at_zero();
        let positive = (0..n).map(|point| noise.at(point)).filter(|alpha| *alpha > 0.0);
        let smallest = positive.fold(f64::INFINITY, f64::min);
        let floor = if smallest.is_finite() { LEAST_NOISE * smallest } else { rounding }.max(rounding);
        let of_point = |point: usize| noise.at(point).max(floor);
        let scale = (0..n).map(of_point).fold(f64::INFINITY, f64::min);
        let weights: Vec<f64> = (0..n).map(|point| scale / of_point(point)).collect();
        let is_uniform = weights.iter().all(|weight| *weight == 1.0);
        Self { scale, weights, is_uniform }
    }

    /// Whitened unknowns have normal equations with the condition `n k₀ / s`, and are taken while that leaves
    /// digits. Values at the landmarks have the condition s/τ.
    fn coordinates(&self, system: &System) -> Coordinates {
        let rounding = f64::EPSILON * system.n_points() as f64 * system.kernel().at_zero();
        if rounding <= LEAST_DIGITS * self.scale { Coordinates::Whitened } else { Coordinates::AtLandmarks }
    }
}

#[cfg(test)]
mod tests;
