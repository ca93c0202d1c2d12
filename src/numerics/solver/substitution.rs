//! Forward and backward substitution for one right-hand side, at the speed of memory.
//!
//! A triangle of n²/2 numbers is read once per substitution and used for two flops each: bandwidth is the bound, and triangular
//! solves made for many right-hand sides reach a fraction of it. Here every thread streams its part of a panel of columns,
//! eight columns at a time, so that the right-hand side is loaded once per eight.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Columns of a panel: its diagonal block fits the L2 cache and is solved by one thread while the others wait.
const PANEL: usize = 128;

/// Columns that one sweep takes together: as many streams as the prefetchers of current cores follow.
const GROUP: usize = 8;

/// Numbers that a task streams at least: some 20 µs, against 2 µs to hand it to another thread.
const NUMBERS_PER_TASK: usize = 1 << 16;

/// The lower triangle L of an `[n, n]` matrix, column by column, `stride` numbers apart.
#[derive(Clone, Copy)]
pub(super) struct LowerTriangle<'a> {
    pub columns: &'a [f64],
    pub n: usize,
    pub stride: usize,
}

impl<'a> LowerTriangle<'a> {
    /// Some rows of a column.
    #[inline(always)]
    fn column(self, j: usize, rows: Range<usize>) -> &'a [f64] {
        &self.columns[j * self.stride..][rows]
    }

    /// `x ← L⁻¹x`.
    pub(super) fn solve_forward(self, x: &mut [f64]) {
        let arch = Arch::new();
        for first in (0..self.n).step_by(PANEL) {
            let end = (first + PANEL).min(self.n);
            let (head, below) = x.split_at_mut(end);
            let panel = &mut head[first..];
            arch.dispatch(ForwardDiagonal { l: self, first, x: panel });
            let n_rows = NUMBERS_PER_TASK / PANEL;
            below.par_chunks_mut(n_rows).enumerate().for_each(|(task, rows)| {
                arch.dispatch(SubtractPanel { l: self, first, x: panel, top: end + task * n_rows, rows });
            });
        }
    }

    /// `x ← L⁻ᵀx`.
    pub(super) fn solve_backward(self, x: &mut [f64]) {
        let arch = Arch::new();
        for first in (0..self.n).step_by(PANEL).rev() {
            let end = (first + PANEL).min(self.n);
            let (head, below) = x.split_at_mut(end);
            let panel = &mut head[first..];
            let n_columns = (NUMBERS_PER_TASK / below.len().max(1)).clamp(GROUP, PANEL);
            panel.par_chunks_mut(n_columns).enumerate().for_each(|(task, columns)| {
                let first = first + task * n_columns;
                arch.dispatch(SubtractProducts { l: self, first, columns, top: end, x: below });
            });
            arch.dispatch(BackwardDiagonal { l: self, first, x: panel });
        }
    }
}

/// Forward substitution within the diagonal block that begins at `first`.
struct ForwardDiagonal<'a> {
    l: LowerTriangle<'a>,
    first: usize,
    x: &'a mut [f64],
}

impl WithSimd for ForwardDiagonal<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { l, first, x } = self;
        let end = first + x.len();
        for j in first..end {
            let (solved, below) = x.split_at_mut(j - first + 1);
            solved[j - first] /= l.column(j, j..j + 1)[0];
            subtract(simd, below, [l.column(j, j + 1..end)], [solved[j - first]]);
        }
    }
}

/// Backward substitution within the diagonal block that begins at `first`.
struct BackwardDiagonal<'a> {
    l: LowerTriangle<'a>,
    first: usize,
    x: &'a mut [f64],
}

impl WithSimd for BackwardDiagonal<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { l, first, x } = self;
        let end = first + x.len();
        for j in (first..end).rev() {
            let (head, solved) = x.split_at_mut(j - first + 1);
            let [product] = products(simd, [l.column(j, j + 1..end)], solved);
            head[j - first] = (head[j - first] - product) / l.column(j, j..j + 1)[0];
        }
    }
}

/// `rows ← rows − L[top.., first..]·x`: a solved panel leaves the rows below it.
struct SubtractPanel<'a> {
    l: LowerTriangle<'a>,
    first: usize,
    x: &'a [f64],
    top: usize,
    rows: &'a mut [f64],
}

impl WithSimd for SubtractPanel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { l, first, x, top, rows } = self;
        let bottom = top + rows.len();
        let column = |j| l.column(j, top..bottom);
        let (groups, rest) = x.as_chunks::<GROUP>();
        for (group, &factors) in groups.iter().enumerate() {
            let columns = std::array::from_fn(|k| column(first + group * GROUP + k));
            subtract(simd, rows, columns, factors);
        }
        let done = first + groups.len() * GROUP;
        for (k, &factor) in rest.iter().enumerate() {
            subtract(simd, rows, [column(done + k)], [factor]);
        }
    }
}

/// `columns[j] ← columns[j] − L[top.., first + j]·x`: what is solved below leaves the columns of a panel.
struct SubtractProducts<'a> {
    l: LowerTriangle<'a>,
    first: usize,
    columns: &'a mut [f64],
    top: usize,
    x: &'a [f64],
}

impl WithSimd for SubtractProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { l, first, columns, top, x } = self;
        let column = |j| l.column(first + j, top..top + x.len());
        let (groups, rest) = columns.as_chunks_mut::<GROUP>();
        let done = groups.len() * GROUP;
        for (group, entries) in groups.iter_mut().enumerate() {
            let found = products(simd, std::array::from_fn::<_, GROUP, _>(|k| column(group * GROUP + k)), x);
            entries.iter_mut().zip(found).for_each(|(entry, product)| *entry -= product);
        }
        for (k, entry) in rest.iter_mut().enumerate() {
            let [product] = products(simd, [column(done + k)], x);
            *entry -= product;
        }
    }
}

/// `rows ← rows − Σ_k columns[k]·factors[k]`.
#[inline(always)]
fn subtract<S: Simd, const K: usize>(simd: S, rows: &mut [f64], columns: [&[f64]; K], factors: [f64; K]) {
    let (rows, tail) = S::as_mut_simd_f64s(rows);
    let columns = columns.map(S::as_simd_f64s);
    let negated = factors.map(|factor| simd.splat_f64s(-factor));
    let bodies = columns.map(|(body, _)| &body[..rows.len()]);
    for (i, row) in rows.iter_mut().enumerate() {
        let mut sum = *row;
        for k in 0..K {
            sum = simd.mul_add_e_f64s(bodies[k][i], negated[k], sum);
        }
        *row = sum;
    }
    for (i, row) in tail.iter_mut().enumerate() {
        for k in 0..K {
            *row -= columns[k].1[i] * factors[k];
        }
    }
}

/// `columns[k]·x` for every k.
#[inline(always)]
fn products<S: Simd, const K: usize>(simd: S, columns: [&[f64]; K], x: &[f64]) -> [f64; K] {
    let (x, tail) = S::as_simd_f64s(x);
    let columns = columns.map(S::as_simd_f64s);
    let bodies = columns.map(|(body, _)| &body[..x.len()]);
    let mut sums = [simd.splat_f64s(0.0); K];
    for (i, &x) in x.iter().enumerate() {
        for k in 0..K {
            sums[k] = simd.mul_add_e_f64s(bodies[k][i], x, sums[k]);
        }
    }
    std::array::from_fn(|k| {
        let of_tail: f64 = columns[k].1.iter().zip(tail).map(|(a, b)| a * b).sum();
        simd.reduce_sum_f64s(sums[k]) + of_tail
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A well-conditioned triangle with NaN above its diagonal and between its columns: nothing there may be read.
    fn triangle(n: usize, stride: usize) -> Vec<f64> {
        let entry = |i: usize, j: usize| match i {
            _ if i == j => 2.0 + (0.3 * j as f64).sin(),
            _ if i > j && i < n => (1.7 * (i * 31 + j * 7) as f64).sin() / (1.0 + (i - j) as f64),
            _ => f64::NAN,
        };
        (0..n * stride).map(|k| entry(k % stride, k / stride)).collect()
    }

    #[test]
    fn substitution_undoes_the_product_with_the_triangle() {
        // Sizes around panels, groups, registers and tasks.
        for n in [1usize, 2, 7, 8, 9, 127, 128, 129, 136, 300, 701, 1291] {
            let stride = n.next_multiple_of(8) + 8;
            let columns = triangle(n, stride);
            let l = LowerTriangle { columns: &columns, n, stride };
            let expected: Vec<f64> = (0..n).map(|i| (0.9 * i as f64).cos()).collect();
            let (mut forward, mut backward) = (vec![0.0; n], vec![0.0; n]);
            for j in 0..n {
                for i in j..n {
                    forward[i] += l.column(j, i..i + 1)[0] * expected[j];
                    backward[j] += l.column(j, i..i + 1)[0] * expected[i];
                }
            }
            l.solve_forward(&mut forward);
            l.solve_backward(&mut backward);
            // The triangle's condition is below 1e3; rounding in sums of n terms stays far under the tolerance.
            for found in [&forward, &backward] {
                let error = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < 1e-11, "n = {n}: {error:e}");
            }
        }
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let (n, stride) = (1500, 1504);
        let columns = triangle(n, stride);
        let solve = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            let mut x: Vec<f64> = (0..n).map(|i| (0.9 * i as f64).cos()).collect();
            pool.install(|| {
                let l = LowerTriangle { columns: &columns, n, stride };
                l.solve_forward(&mut x);
                l.solve_backward(&mut x);
            });
            x
        };
        assert_eq!(solve(1), solve(3));
    }
}
