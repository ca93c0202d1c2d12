//! Conjugate gradients with a preconditioner, for several right-hand sides that share the products.
//!
//! Source: Hestenes and Stiefel 1952; Saad 2003, "Iterative Methods for Sparse Linear Systems", alg. 9.1.

use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;

/// Part of the tolerance to which a recurrence is solved. The true residual differs from it by rounding.
pub(super) const SAFETY: f64 = 0.5;

/// Part of the tolerance by which each product may change the residual, if the solution is judged by a
/// residual that is summed afresh.
pub(super) const SLACK: f64 = 0.05;

/// Largest error of a product Ap, over the part of it along p. The length of a step is found from `pᵀAp`, and
/// with errors of its size the residual grew.
const OF_CURVATURE: f64 = 0.1;

/// Iterations without a new smallest residual after which rounding is all that is left.
const MAX_STALLED: usize = 25;

/// Largest number of iterations. A preconditioner that needs more is none.
const MOST: usize = 500;

/// A symmetric positive definite matrix A with a preconditioner P.
pub(super) trait Preconditioned {
    fn n_points(&self) -> usize;

    /// `AX` for columns `[n, k]`, each with an error of at most `accuracy` of its size.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Overflow`], [`crate::error::NumericsError::Cancelled`].
    fn product(&self, columns: &[f64], accuracy: f64, observer: &dyn Observer) -> Result<Vec<f64>>;

    /// `P⁻¹R` for columns `[n, k]`.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    fn precondition(&self, columns: &[f64], observer: &dyn Observer) -> Result<Vec<f64>>;
}

/// How far columns are solved.
#[derive(Clone, Copy)]
pub(super) struct Goal {
    /// Largest `|b − Ax|/|b|`.
    pub tolerance: f64,
    /// Part of it by which each product may change the residual. As the residual falls, products may be less
    /// exact (Simoncini and Szyld 2003).
    pub slack: f64,
}

/// One column of `AX = B` as it was solved.
pub(super) struct ColumnSolution {
    /// x, `[n]`.
    pub x: Vec<f64>,
    /// `b − Ax` as the recurrence has it, `[n]`.
    pub residual: Vec<f64>,
    /// `|b − Ax|/|b|`, 0 for b = 0.
    pub relative_residual: f64,
    pub n_iterations: usize,
}

/// A column on its way, in units of its right-hand side's norm, so that no square leaves float64.
struct Column {
    x: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    /// `rᵀP⁻¹r`.
    energy: f64,
    /// Cosine of the angle between p and Ap, of the last step.
    cosine: f64,
    /// |b|.
    size: f64,
    /// The smallest residual so far, and the iteration that reached it.
    smallest: f64,
    reached_at: usize,
}

/// Solves for columns `[n, k]` until each residual is at most the tolerance of its right-hand side, or no
/// longer falls: the caller sees to which.
///
/// # Errors
/// Returns the errors of the matrix.
pub(super) fn conjugate_gradients(
    of: &dyn Preconditioned,
    right: &[f64],
    goal: Goal,
    observer: &dyn Observer,
) -> Result<Vec<ColumnSolution>> {
    let n = of.n_points();
    let mut columns: Vec<Column> = right.chunks_exact(n).map(Column::new).collect();
    for iteration in 1..=MOST {
        let is_active = |column: &&mut Column| column.is_active(goal.tolerance, iteration);
        let mut active: Vec<&mut Column> = columns.iter_mut().filter(is_active).collect();
        if active.is_empty() {
            break;
        }
        observer.checkpoint()?;
        let residuals: Vec<f64> = active.iter().flat_map(|column| &column.residual).copied().collect();
        let conditioned = of.precondition(&residuals, observer)?;
        active.iter_mut().zip(conditioned.chunks_exact(n)).for_each(|(column, z)| column.turn(z));
        let directions: Vec<f64> = active.iter().flat_map(|column| &column.direction).copied().collect();
        let accuracy = active.iter().map(|column| column.accuracy(goal)).fold(1.0, f64::min);
        let products = of.product(&directions, accuracy, observer)?;
        for (column, product) in active.iter_mut().zip(products.chunks_exact(n)) {
            column.step(product, iteration);
        }
        observer.solved_to(active.iter().map(|column| column.smallest).fold(0.0, f64::max));
    }
    Ok(columns.into_iter().map(Column::finished).collect())
}

impl Column {
    fn new(right: &[f64]) -> Self {
        let size = norm(right);
        let unit = if size > 0.0 { size } else { 1.0 };
        Self {
            x: vec![0.0; right.len()],
            residual: right.iter().map(|b| b / unit).collect(),
            direction: vec![0.0; right.len()],
            energy: f64::INFINITY,
            cosine: 1.0,
            size,
            smallest: if size == 0.0 { 0.0 } else { 1.0 },
            reached_at: 0,
        }
    }

    fn finished(self) -> ColumnSolution {
        let size = self.size;
        let scaled = |column: Vec<f64>| column.into_iter().map(|entry| size * entry).collect();
        ColumnSolution {
            relative_residual: norm(&self.residual),
            n_iterations: self.reached_at,
            x: scaled(self.x),
            residual: scaled(self.residual),
        }
    }

    fn is_active(&self, tolerance: f64, iteration: usize) -> bool {
        self.smallest > tolerance && iteration <= self.reached_at + MAX_STALLED
    }

    /// How exact the next product must be. The step to the next residual is hardly longer than the residual.
    fn accuracy(&self, goal: Goal) -> f64 {
        (goal.slack * goal.tolerance / norm(&self.residual)).min(OF_CURVATURE * self.cosine)
    }

    /// Chooses the next direction from `z = P⁻¹r`.
    fn turn(&mut self, z: &[f64]) {
        let energy = dot(&self.residual, z);
        let factor = energy / self.energy;
        self.direction.iter_mut().zip(z).for_each(|(p, z)| *p = z + factor * *p);
        self.energy = energy;
    }

    /// Goes along the direction p, given `Ap`.
    fn step(&mut self, product: &[f64], iteration: usize) {
        let curvature = dot(&self.direction, product);
        let sizes = norm(&self.direction) * norm(product);
        self.cosine = if sizes > 0.0 { curvature.abs() / sizes } else { 1.0 };
        let length = if curvature > 0.0 { self.energy / curvature } else { 0.0 };
        self.x.iter_mut().zip(&self.direction).for_each(|(x, p)| *x += length * p);
        self.residual.iter_mut().zip(product).for_each(|(r, q)| *r -= length * q);
        let size = norm(&self.residual);
        if size < self.smallest {
            (self.smallest, self.reached_at) = (size, iteration);
        }
    }
}
