//! Kriging of heights over a tangent plane, several queries at once: one in each lane of a register.
//!
//! Around each query the surface is a height `z(t) = f(t)ᵀβ + g(t) + ε` over d − 1 tangential coordinates. It
//! has three parts:
//! - a quadratic trend with a flat prior,
//! - a Gaussian process `g` with covariance `s² φ(|t − t′|²/ℓ²)`,
//! - noise of variance `s²τ²w_j` at point j, where w_j is 1 over the number of points whose mean it is.
//!
//! With `K = φ + τ²W` everything follows from one Cholesky factorization of K. Forward substitution is
//! applied to the trend F, the heights z and the covariances C of the derivatives at the query. This is
//! universal kriging (Cressie 1993, sec. 3.4; Rasmussen and Williams 2006, sec. 2.7) with the scale s²
//! integrated out.

mod batch;
mod covariances;
mod doubt;
mod factor;
mod model;
#[cfg(test)]
mod tests;
mod trend;

use pulp::{Simd, WithSimd};
use smallvec::SmallVec;

use crate::machine::registers::{BLOCK, Pack};

pub(crate) use batch::Batch;
pub(crate) use model::Model;

/// Numbers in the widest register.
pub(crate) const MAX_LANES: usize = 8;

/// Rows of a tile, which are solved for at once.
const ROWS: usize = 4;

/// Rounding of the heights, in units of the radius.
const LEAST_HEIGHT: f64 = 1e-16;

/// Number of terms of a quadric: 1, d − 1 coordinates and their products make `d(d+1)/2`.
pub(crate) const fn n_terms(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Result of one model at the query of one lane, in units of the radius R of its patch.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kriged {
    /// Logarithm of the restricted likelihood, with s² integrated out under the prior 1/s², up to a constant
    /// of the patch. NaN where K is not positive definite in float64.
    pub log_likelihood: f64,
    /// Scale s², estimated as `q/(n − p)`.
    pub scale: f64,
    /// Degrees of freedom, n − p.
    pub freedom: f64,
    /// Posterior means of z, z_a, z_aa, z_ab at the query, `[p]`.
    pub means: Terms,
    /// Covariance of `means`, `[p, p]`.
    pub covariance: Squares,
}

/// Numbers, one per term, on the stack for surfaces in space.
pub(crate) type Terms = SmallVec<[f64; 8]>;
/// Numbers, one per pair of terms, on the stack for surfaces in space.
pub(crate) type Squares = SmallVec<[f64; 36]>;

/// Memory for the factorization of one batch.
pub(crate) struct Workspace {
    matrix: Vec<f64>,
    start: usize,
}

impl Workspace {
    pub(crate) fn new(dimension: usize, count: usize) -> Self {
        let n_rows = extra_rows(dimension);
        let n = (triangle(count) + n_rows * count).next_multiple_of(BLOCK) * MAX_LANES;
        // Inner products of those rows, and a system of p unknowns with as many right-hand sides.
        let n = n + 2 * n_rows * n_rows * MAX_LANES;
        let matrix = vec![0.0; n + MAX_LANES];
        // Aligned to a cache line.
        let start = matrix.as_ptr().align_offset(64).min(MAX_LANES);
        Self { matrix, start }
    }
}

/// Number of rows below K: Fᵀ, zᵀ, eᵀ and Cᵀ, rounded up to whole tiles.
fn extra_rows(dimension: usize) -> usize {
    (2 * n_terms(dimension) + 2).next_multiple_of(ROWS)
}

/// Number of entries of a lower triangle with n rows, and the start of row n in it.
const fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}

/// The computation that kriges every lane of a batch with one model.
pub(crate) struct Krige<'a> {
    pub batch: &'a Batch,
    pub model: &'a Model,
    pub workspace: &'a mut Workspace,
    /// True if derivatives at the query are asked for, besides the likelihood.
    pub predicts: bool,
}

impl WithSimd for Krige<'_> {
    type Output = SmallVec<[Kriged; MAX_LANES]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let start = self.workspace.start;
        let (matrix, _) = S::as_mut_simd_f64s(&mut self.workspace.matrix[start..]);
        let d = self.batch.dimension;
        let system = Factored {
            simd,
            k: d - 1,
            n: self.batch.count,
            p: n_terms(d),
            p_trend: self.model.n_trend,
            n_rows: self.batch.count + extra_rows(d),
            batch: self.batch,
            model: self.model,
            matrix,
        };
        system.run(self.predicts)
    }
}

/// A batch during its factorization.
///
/// The matrix holds the rows of the lower triangle of K one after the other. Below it come the rows of Fᵀ
/// `[p]`, zᵀ, eᵀ (the entailed heights) and Cᵀ `[p]`, all of length n.
struct Factored<'a, S: Simd> {
    simd: S,
    /// Tangential coordinates, d − 1.
    k: usize,
    /// Places in each lane.
    n: usize,
    /// Terms of a quadric.
    p: usize,
    /// Terms of the trend, at most p.
    p_trend: usize,
    /// Rows of the matrix.
    n_rows: usize,
    batch: &'a Batch,
    model: &'a Model,
    matrix: &'a mut [S::f64s],
}

impl<S: Simd> Factored<'_, S> {
    #[inline(always)]
    fn run(mut self, predicts: bool) -> SmallVec<[Kriged; MAX_LANES]> {
        self.fill_triangle();
        self.fill_trend();
        if predicts {
            self.fill_covariances();
        }
        let n_rows = if predicts { self.n_rows } else { self.n + (self.p + 2).next_multiple_of(ROWS) };
        self.factorize(n_rows);
        self.solve(predicts)
    }

    #[inline(always)]
    fn row(&self, i: usize) -> usize {
        if i < self.n { triangle(i) } else { triangle(self.n) + (i - self.n) * self.n }
    }

    #[inline(always)]
    fn of(&self, list: &[f64], at: usize) -> Pack<S, 1> {
        let (registers, _) = S::as_simd_f64s(list);
        Pack::read(self.simd, registers, at)
    }

    #[inline(always)]
    fn at(&self, i: usize) -> Pack<S, 1> {
        Pack::read(self.simd, self.matrix, i)
    }

    #[inline(always)]
    fn coordinate(&self, axis: usize, j: usize) -> Pack<S, 1> {
        self.of(&self.batch.coordinates, axis * self.n + j)
    }

    #[inline(always)]
    fn mask(&self, j: usize) -> Pack<S, 1> {
        self.of(&self.batch.is_point, j)
    }
}
