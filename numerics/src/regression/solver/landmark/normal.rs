//! The normal equations of the values at the landmarks.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, MatRef};

use super::Weighing;
use super::pivots::LandmarkChoice;
use super::rows::Coordinates;
use crate::error::{NumericsError, Result};
use crate::machine::parallelism::parallelism;
use crate::observer::Observer;
use crate::regression::solver::dense::factorize_in_place;
use crate::regression::solver::system::System;

/// The normal equations, factorized, and what a pass over all points found beside them.
pub(super) struct NormalEquations {
    /// L_B, lower: the factor of `FᵀWF + sI` or `MᵀWM + sK_ZZ⁻¹`.
    pub inner: Mat<f64>,
    /// The right-hand side of the constant 1, `FᵀW·1` or `MᵀW·1`, `[r]`.
    pub of_one: Vec<f64>,
    /// Largest entry that remains of the diagonal.
    pub remaining: f64,
    /// Points where too much remains, those of the largest entries first.
    pub beyond: Vec<usize>,
}

impl NormalEquations {
    /// Sums over all points and factorizes.
    ///
    /// # Errors
    /// [`NumericsError::WeightsOverflow`] if the matrix has no factor in float64.
    /// [`NumericsError::Cancelled`].
    pub(super) fn of(
        system: &System,
        chosen: &LandmarkChoice,
        weighing: &Weighing,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (rows, rank) = (&chosen.rows, chosen.rows.n_landmarks());
        let mut inner = Mat::<f64>::zeros(rank, rank);
        let mut of_one = Mat::<f64>::zeros(rank, 1);
        let mut remaining = 0.0_f64;
        let mut beyond: Vec<(f64, usize)> = Vec::new();
        rows.for_each_block(system, observer, |points, block| {
            if weighing.is_uniform {
                add_products(&mut inner, block.rows);
            } else {
                let roots: Vec<f64> = weighing.weights[points.clone()].iter().map(|w| w.sqrt()).collect();
                let rooted = Mat::from_fn(rank, points.len(), |i, j| roots[j] * block.rows[(i, j)]);
                add_products(&mut inner, rooted.as_ref());
            }
            let weights = Mat::from_fn(points.len(), 1, |i, _| weighing.weights[points.start + i]);
            let par = parallelism((2 * rank * points.len()) as f64);
            matmul(of_one.as_mut(), Accum::Add, block.rows, weights.as_ref(), 1.0, par);
            for (j, point) in points.enumerate() {
                remaining = remaining.max(block.remaining[j]);
                if block.remaining[j] > chosen.tolerance {
                    beyond.push((block.remaining[j], point));
                }
            }
        })?;
        beyond.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        match rows.coordinates() {
            Coordinates::Whitened => (0..rank).for_each(|k| inner[(k, k)] += weighing.scale),
            Coordinates::AtLandmarks => {
                let mut inverse = Mat::<f64>::identity(rank, rank);
                rows.whiten(inverse.as_mut());
                // K_ZZ⁻¹ = L₁₁⁻ᵀL₁₁⁻¹
                let scaled = Mat::from_fn(rank, rank, |i, j| weighing.scale.sqrt() * inverse[(j, i)]);
                add_products(&mut inner, scaled.as_ref());
            }
        }
        factorize_in_place(inner.as_mut(), 0.0, observer)?.map_err(|_| NumericsError::WeightsOverflow)?;
        let of_one = (0..rank).map(|k| of_one[(k, 0)]).collect();
        Ok(Self { inner, of_one, remaining, beyond: beyond.into_iter().map(|(_, point)| point).collect() })
    }
}

/// Adds `AAᵀ` to the lower triangle.
fn add_products(lower: &mut Mat<f64>, a: MatRef<'_, f64>) {
    let par = parallelism((lower.nrows() * lower.nrows() * a.ncols()) as f64);
    triangular::matmul(
        lower.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        1.0,
        par,
    );
}
