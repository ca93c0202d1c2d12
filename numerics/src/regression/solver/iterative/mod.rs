//! Conjugate gradients on the true system, for rough kernels.
//!
//! The spectrum of a rough kernel's matrix does not collapse, so that few landmarks do not span it. But a
//! value depends on its near ones alone where these are known (the screening effect). So a sparse factor of
//! the inverse preconditions well: each point in a random order is given its nearest of those before it, and
//!
//! ```text
//! (K + D)⁻¹ ≈ UUᵀ,   U[S, i] = A_S⁻¹e_i / √(e_iᵀA_S⁻¹e_i),   A = K + D,   S: i with those it is given
//! ```
//!
//! Of all factors with this pattern it is the nearest in the sense of Kullback and Leibler (Schäfer, Katzfuss
//! and Owhadi 2021, "Sparse Cholesky factorization by Kullback–Leibler minimization", th. 2.1); as a
//! distribution it is that of Vecchia 1988. Memory is O(n), an iteration takes n²/2 pairs, and the number of
//! iterations hardly grows with n.

mod columns;
mod inverse_factor;
mod order;
pub(crate) mod price;
mod product;

use std::sync::Arc;

use faer::MatMut;
use rayon::prelude::*;

use super::conjugate_gradients::{ColumnSolution, Goal, Preconditioned, SAFETY, conjugate_gradients};
use super::system::System;
use crate::error::{NumericsError, Result};
use crate::observer::{Observer, Stage};
use inverse_factor::InverseFactor;
use product::Product;

/// Columns that are solved together. Kernel values are computed once for all of them.
pub(super) const SOLVED_AT_ONCE: usize = 64;

/// Part of the tolerance by which each product may change a residual that is not summed afresh.
const LITTLE_SLACK: f64 = 1e-3;

/// A system with a preconditioner.
#[derive(Clone)]
pub(super) struct Iterative {
    system: System,
    inverse: Arc<InverseFactor>,
    product: Arc<Product>,
    /// Largest relative residual of an answer.
    tolerance: f64,
}

impl Iterative {
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn of(system: &System, tolerance: f64, observer: &dyn Observer) -> Result<Self> {
        observer.enter(Stage::Factor);
        let inverse = Arc::new(InverseFactor::of(system, observer)?);
        let product = Arc::new(Product::of(system, observer)?);
        Ok(Self { inverse, product, system: system.clone(), tolerance })
    }

    /// The same with another tolerance.
    pub(super) fn with_tolerance(&self, tolerance: f64) -> Self {
        Self { tolerance, ..self.clone() }
    }

    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Solves for columns `[n, k]`.
    ///
    /// # Errors
    /// [`NumericsError::NotConverged`], [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    fn solve(&self, right: &[f64], observer: &dyn Observer) -> Result<Vec<ColumnSolution>> {
        let blocks = right.chunks(SOLVED_AT_ONCE * self.n_points());
        let goal = Goal { tolerance: SAFETY * self.tolerance, slack: LITTLE_SLACK };
        let solve = |block| conjugate_gradients(self, block, goal, observer);
        let found = blocks.map(solve).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect::<Vec<_>>();
        // NaN is no convergence.
        let is_met = |column: &ColumnSolution| column.relative_residual <= self.tolerance;
        match found.iter().find(|column| !is_met(column)) {
            Some(column) => Err(self.not_converged(column.relative_residual)),
            None => Ok(found),
        }
    }

    /// Overwrites columns `[n, k]` by `(K + D)⁻¹` times them.
    ///
    /// # Errors
    /// Returns the errors of [`Iterative::solve`].
    pub(super) fn solve_in_place(&self, columns: MatMut<'_, f64>, observer: &dyn Observer) -> Result<()> {
        let right: Vec<f64> = columns.as_ref().col_iter().flat_map(|column| column.iter().copied()).collect();
        for (column, found) in columns.col_iter_mut().zip(self.solve(&right, observer)?) {
            column.iter_mut().zip(&found.x).for_each(|(slot, x)| *slot = *x);
        }
        Ok(())
    }

    /// The refusal of an answer whose residual is too large.
    pub(super) fn not_converged(&self, relative_residual: f64) -> NumericsError {
        NumericsError::NotConverged { relative_residual, tolerance: self.tolerance }
    }

    /// Whitens covariances `[n, k]` to `[2 n, k]`, such that products of the first halves less those of the
    /// second are the covariances that the values explain.
    ///
    /// There is no factor of the inverse here, but `4 ab = (a + b)² − (a − b)²`. With `A x = c − r`,
    /// `cᵀA⁻¹c` is `(c + r)ᵀx` up to the square of r.
    ///
    /// # Errors
    /// Returns the errors of [`Iterative::solve`].
    pub(super) fn whitened(&self, covariances: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let n = self.system.n_points();
        // Of about equal size and of one unit, so that their sum and difference lose few digits.
        let balance = (self.system.kernel().at_zero() * (n as f64).sqrt()).sqrt();
        let mut whitened = Vec::with_capacity(2 * covariances.len());
        for (c, found) in covariances.chunks_exact(n).zip(self.solve(covariances, observer)?) {
            let pairs: Vec<(f64, f64)> = c
                .iter()
                .zip(&found.residual)
                .zip(&found.x)
                .map(|((c, r), x)| (0.5 * (c + r) / balance, 0.5 * x * balance))
                .collect();
            whitened.extend(pairs.iter().map(|(c, x)| c + x));
            whitened.extend(pairs.iter().map(|(c, x)| c - x));
        }
        Ok(whitened)
    }

    pub(super) fn n_bytes(&self) -> usize {
        self.inverse.n_bytes() + self.product.n_bytes()
    }
}

impl Preconditioned for Iterative {
    fn n_points(&self) -> usize {
        self.system.n_points()
    }

    fn product(&self, columns: &[f64], accuracy: f64, observer: &dyn Observer) -> Result<Vec<f64>> {
        self.product.times(&self.system, columns, accuracy, observer)
    }

    fn precondition(&self, columns: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let apply = |column: &[f64]| {
            observer.checkpoint()?;
            Ok(self.inverse.apply(column))
        };
        let columns = columns.par_chunks_exact(self.n_points());
        Ok(columns.map(apply).collect::<Result<Vec<_>>>()?.concat())
    }
}

#[cfg(test)]
mod tests;
