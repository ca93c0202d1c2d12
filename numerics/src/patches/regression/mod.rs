//! Kriging of heights over a tangent plane, several queries at once: one in each lane of a register.
//!
//! Around each query the surface is a height `z(t) = f(t)ᵀβ + g(t) + ε` over d − 1 tangential coordinates. It
//! has three parts:
//! - a polynomial trend with a flat prior,
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
mod model;
#[cfg(test)]
mod tests;
mod trend;

use pulp::{Simd, WithSimd};
use smallvec::SmallVec;

use crate::machine::lanes::{Layout, Lower, MAX_LANES, Rounding, Workspace};
use crate::machine::registers::{BLOCK, Pack};

pub(crate) use batch::Batch;
pub(crate) use model::{Model, Trend};

/// Rows and columns of a tile, which are solved for at once.
const ROWS: usize = 4;
const COLUMNS: usize = 2;

/// Rounding of the heights, in units of the radius.
const LEAST_HEIGHT: f64 = 1e-16;

/// Number of terms of a quadric: 1, d − 1 coordinates and their products make `d(d+1)/2`.
pub(crate) const fn n_terms(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Result of one model at the query of one lane, in units of the radius R of its patch.
#[derive(Debug, Clone, Default)]
pub(crate) struct ModelResult {
    /// Logarithm of the restricted likelihood, with s² integrated out under the prior 1/s², up to a constant
    /// of the patch. NaN where K is not positive definite in float64, or points do not determine the trend.
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

/// Makes memory for the factorization of one batch.
pub(crate) fn workspace(dimension: usize, count: usize) -> Workspace {
    // The largest trend takes most.
    let n_rows = extra_rows(dimension, Trend::Quartic);
    let n_registers = Layout::dense(count).row(count + n_rows).next_multiple_of(BLOCK);
    // Inner products of those rows, and a system with an unknown for each term of the trend.
    Workspace::new(n_registers + 2 * n_rows * n_rows)
}

/// Number of rows below K: Fᵀ, zᵀ, eᵀ and Cᵀ, rounded up to whole tiles.
fn extra_rows(dimension: usize, trend: Trend) -> usize {
    (trend.n_terms(dimension) + 2 + n_terms(dimension)).next_multiple_of(ROWS)
}

/// The computation that kriges every lane of a batch with one model.
pub(crate) struct Krige<'a> {
    pub batch: &'a Batch,
    pub model: &'a Model,
    pub workspace: &'a mut Workspace,
    /// True if derivatives at the query are requested, besides the likelihood.
    pub predicts: bool,
}

impl WithSimd for Krige<'_> {
    type Output = SmallVec<[ModelResult; MAX_LANES]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let (d, layout) = (self.batch.dimension, Layout::dense(self.batch.count));
        let n_extra = extra_rows(d, self.model.trend);
        let system = FactoredBatch {
            lower: Lower { simd, layout, registers: self.workspace.registers::<S>() },
            k: d - 1,
            n: self.batch.count,
            p: n_terms(d),
            p_trend: self.model.trend.n_terms(d),
            n_extra,
            scratch: layout.row(self.batch.count + n_extra),
            batch: self.batch,
            model: self.model,
        };
        system.run(self.predicts)
    }
}

/// A batch during its factorization.
///
/// Below the triangle of K come the rows of Fᵀ `[p_trend]`, zᵀ, eᵀ (the entailed heights) and Cᵀ `[p]`.
struct FactoredBatch<'a, S: Simd> {
    lower: Lower<'a, S>,
    /// Tangential coordinates, d − 1.
    k: usize,
    /// Places in each lane.
    n: usize,
    /// Terms of a quadric.
    p: usize,
    /// Terms of the trend, those of a quadric first.
    p_trend: usize,
    /// Rows below K.
    n_extra: usize,
    /// The place of the registers after the rows.
    scratch: usize,
    batch: &'a Batch,
    model: &'a Model,
}

impl<S: Simd> FactoredBatch<'_, S> {
    #[inline(always)]
    fn run(mut self, predicts: bool) -> SmallVec<[ModelResult; MAX_LANES]> {
        self.fill_triangle();
        self.fill_trend();
        if predicts {
            self.fill_covariances();
        }
        let n_rows = if predicts { self.n_extra } else { (self.p_trend + 2).next_multiple_of(ROWS) };
        self.lower.factorize::<ROWS, COLUMNS>(self.n..self.n + n_rows, &PlainRounding);
        self.solve(predicts)
    }

    #[inline(always)]
    fn of(&self, list: &[f64], at: usize) -> Pack<S, 1> {
        Pack::of_numbers(self.lower.simd, list, at)
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

/// Rounding of a factor that is NaN where K is not positive definite in float64.
struct PlainRounding;

impl<S: Simd> Rounding<S> for PlainRounding {
    const JOINS_PRODUCTS: bool = true;

    #[inline(always)]
    fn entry(&self, _i: usize, entry: Pack<S, 1>) -> Pack<S, 1> {
        entry
    }

    #[inline(always)]
    fn inverse_root(&self, square: Pack<S, 1>) -> Pack<S, 1> {
        1.0 / square.sqrt()
    }
}
