//! Kriging of several queries at once, one in each lane of a register.
//!
//! Let N be the points around a query q, K = LLᵀ the covariances of their values y, noise included, and
//! `c = k(N, q)`. Forward substitution of y and c gives `u(q) = (L⁻¹c)·(L⁻¹y)` and the variance
//! `k₀ − |L⁻¹c|²`. This is simple kriging (Rasmussen and Williams 2006, alg. 2.1).
//!
//! Derivatives also need the weights `Λ = L⁻ᵀL⁻¹y`. The variance of a derivative needs a row of its own, the
//! covariances `c′` of the derivative with the values. It is the prior variance minus `|L⁻¹c′|²`.

mod covariances;
mod rounding;
mod sums;

use pulp::{Simd, WithSimd};

use super::batch::Batch;
use super::parts::Parts;
use crate::kernel::Kernel;
use crate::machine::lanes::{self, COLUMNS, Layout, Lower, MAX_LANES};
use crate::machine::registers::Pack;
use rounding::GuardedRounding;

/// Buffers for one batch.
pub(super) struct Workspace {
    systems: lanes::Workspace,
    /// Results, `[numbers, lanes]`, in the order of [`RowOffsets`](super::parts::RowOffsets).
    pub found: Vec<f64>,
}

impl Workspace {
    pub(super) fn new(dimension: usize, count: usize, parts: Parts) -> Self {
        let n = count.next_multiple_of(COLUMNS);
        let systems = lanes::Workspace::new(Layout::in_blocks(n).row(n + parts.n_rows()));
        Self { systems, found: vec![0.0; parts.n_numbers(dimension) * MAX_LANES] }
    }
}

/// A pass that kriges one query in each lane.
pub(super) struct Krige<'a> {
    pub batch: &'a Batch,
    pub kernel: &'a Kernel,
    pub parts: Parts,
    pub workspace: &'a mut Workspace,
}

impl WithSimd for Krige<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { batch, kernel, parts, workspace } = self;
        let registers = workspace.systems.registers::<S>();
        let (found, _) = S::as_mut_simd_f64s(&mut workspace.found);
        let n = batch.n_places();
        let lower = Lower { simd, layout: Layout::in_blocks(n), registers };
        let mut system = FactoredBatch { lower, n, batch, kernel, parts };
        system.fill_triangle();
        system.fill_rows();
        system.fill_derivatives();
        system.fill_functionals();
        system.fill_functions();
        system.factorize();
        system.sum_up(found);
    }
}

/// A batch during its factorization, with the rows of [`Parts`] below the triangle.
struct FactoredBatch<'a, S: Simd> {
    lower: Lower<'a, S>,
    n: usize,
    batch: &'a Batch,
    kernel: &'a Kernel,
    parts: Parts,
}

impl<S: Simd> FactoredBatch<'_, S> {
    #[inline(always)]
    fn factorize(&mut self) {
        let solved = self.n..self.n + self.parts.n_solved();
        let rounding = GuardedRounding::new(self.kernel, self.n);
        self.lower.factorize_wide(solved, &rounding);
    }

    /// Returns the place of a row below the triangle.
    #[inline(always)]
    fn row(&self, row: usize) -> usize {
        self.lower.row(self.n + row)
    }

    #[inline(always)]
    fn of(&self, list: &[f64], at: usize) -> Pack<S, 1> {
        Pack::of_numbers(self.lower.simd, list, at)
    }

    /// Returns the entry of D = q − x_j along an axis, stretched by the kernel.
    #[inline(always)]
    fn difference(&self, axis: usize, j: usize) -> Pack<S, 1> {
        self.of(&self.batch.query, axis) - self.of(&self.batch.points, axis * self.n + j)
    }
}
