//! Forward and backward substitution for one right-hand side, at the speed of memory.
//!
//! A substitution reads a triangle of n²/2 numbers once and uses each number for two flops, so memory
//! bandwidth is the limit. Triangular solves made for many right-hand sides reach a fraction of it. Here
//! every thread streams its part of a panel, eight columns at a time. The right-hand side is then loaded once
//! for every eight columns.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::packed::{Columns, PackedMatrix};

/// Columns of a panel. Its diagonal block fits the L2 cache and is solved by one thread while the others
/// wait.
const PANEL: usize = 128;

/// Columns that one sweep takes together: as many streams as the prefetchers of current cores follow.
const GROUP: usize = 8;

/// Least number of numbers that a task streams: about 20 µs of work, against 2 µs to hand it to another
/// thread.
const NUMBERS_PER_TASK: usize = 1 << 16;

/// `x ← L⁻¹x`.
pub(super) fn solve_forward(l: &PackedMatrix, x: &mut [f64]) {
    let n_first = PackedMatrix::n_columns(l.n_points());
    let arch = Arch::new();
    let first = l.columns_of_first();
    for panel in panels(n_first) {
        let (head, below) = x.split_at_mut(panel.end);
        let solved = &mut head[panel.start..];
        arch.dispatch(Diagonal {
            columns: first,
            panel: panel.clone(),
            x: solved,
            order: Order::ScatterBelow,
        });
        subtract_panel(arch, first, panel.start, solved, panel.end, below);
    }
    let (second, x) = (l.columns_of_second(), &mut x[n_first..]);
    for panel in panels(x.len()) {
        let (above, rest) = x.split_at_mut(panel.start);
        let open = &mut rest[..panel.len()];
        subtract_products(arch, second, panel.start, open, 0, above);
        arch.dispatch(Diagonal { columns: second, panel, x: open, order: Order::GatherAbove });
    }
}

/// `x ← L⁻ᵀx`.
pub(super) fn solve_backward(l: &PackedMatrix, x: &mut [f64]) {
    let n_first = PackedMatrix::n_columns(l.n_points());
    let arch = Arch::new();
    let second = l.columns_of_second();
    for panel in panels(x.len() - n_first).rev() {
        let (above, rest) = x[n_first..].split_at_mut(panel.start);
        let solved = &mut rest[..panel.len()];
        arch.dispatch(Diagonal {
            columns: second,
            panel: panel.clone(),
            x: solved,
            order: Order::ScatterAbove,
        });
        subtract_panel(arch, second, panel.start, solved, 0, above);
    }
    let first = l.columns_of_first();
    for panel in panels(n_first).rev() {
        let (head, below) = x.split_at_mut(panel.end);
        let open = &mut head[panel.start..];
        subtract_products(arch, first, panel.start, open, panel.end, below);
        arch.dispatch(Diagonal { columns: first, panel, x: open, order: Order::GatherBelow });
    }
}

fn panels(n: usize) -> impl DoubleEndedIterator<Item = Range<usize>> {
    (0..n.div_ceil(PANEL)).map(move |k| k * PANEL..((k + 1) * PANEL).min(n))
}

/// Subtracts a solved panel from other rows: `rows ← rows − A[top.., first..]·x`.
fn subtract_panel(arch: Arch, columns: Columns<'_>, first: usize, x: &[f64], top: usize, rows: &mut [f64]) {
    let n_rows = NUMBERS_PER_TASK / PANEL;
    rows.par_chunks_mut(n_rows).enumerate().for_each(|(task, rows)| {
        arch.dispatch(SubtractPanel { columns, first, x, top: top + task * n_rows, rows });
    });
}

/// Subtracts solved entries from those of a panel: `open[j] ← open[j] − A[top.., first + j]·x`.
fn subtract_products(
    arch: Arch,
    columns: Columns<'_>,
    first: usize,
    open: &mut [f64],
    top: usize,
    x: &[f64],
) {
    let n_columns = (NUMBERS_PER_TASK / x.len().max(1)).clamp(GROUP, PANEL);
    open.par_chunks_mut(n_columns).enumerate().for_each(|(task, open)| {
        arch.dispatch(SubtractProducts { columns, first: first + task * n_columns, open, top, x });
    });
}

/// Order in which a diagonal block is solved. `Scatter` subtracts a solved entry from the others. `Gather`
/// subtracts the others from an entry before it is solved. In its column, the others are `Below` it in a
/// lower triangle, or `Above` it in an upper one.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    ScatterBelow,
    GatherBelow,
    ScatterAbove,
    GatherAbove,
}

/// Substitution within the diagonal block of a panel.
struct Diagonal<'a> {
    columns: Columns<'a>,
    panel: Range<usize>,
    x: &'a mut [f64],
    order: Order,
}

impl Diagonal<'_> {
    #[inline(always)]
    fn step<S: Simd>(&mut self, simd: S, j: usize) {
        let (first, end) = (self.panel.start, self.panel.end);
        let (above, rest) = self.x.split_at_mut(j - first);
        let Some((entry, below)) = rest.split_first_mut() else { return };
        let (others, rows) = match self.order {
            Order::ScatterBelow | Order::GatherBelow => (below, j + 1..end),
            Order::ScatterAbove | Order::GatherAbove => (above, first..j),
        };
        let column = self.columns.column(j, rows);
        let pivot = self.columns.column(j, j..j + 1)[0];
        match self.order {
            Order::ScatterBelow | Order::ScatterAbove => {
                *entry /= pivot;
                subtract(simd, others, [column], [*entry]);
            }
            Order::GatherBelow | Order::GatherAbove => {
                let [product] = products(simd, [column], others);
                *entry = (*entry - product) / pivot;
            }
        }
    }
}

impl WithSimd for Diagonal<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        match self.order {
            Order::ScatterBelow | Order::GatherAbove => self.panel.clone().for_each(|j| self.step(simd, j)),
            Order::GatherBelow | Order::ScatterAbove => {
                self.panel.clone().rev().for_each(|j| self.step(simd, j));
            }
        }
    }
}

/// A thread's part of [`subtract_panel`].
struct SubtractPanel<'a> {
    columns: Columns<'a>,
    first: usize,
    x: &'a [f64],
    top: usize,
    rows: &'a mut [f64],
}

impl WithSimd for SubtractPanel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { columns, first, x, top, rows } = self;
        let bottom = top + rows.len();
        let column = |j| columns.column(j, top..bottom);
        let (groups, rest) = x.as_chunks::<GROUP>();
        for (group, &factors) in groups.iter().enumerate() {
            subtract(simd, rows, std::array::from_fn(|k| column(first + group * GROUP + k)), factors);
        }
        let done = first + groups.len() * GROUP;
        for (k, &factor) in rest.iter().enumerate() {
            subtract(simd, rows, [column(done + k)], [factor]);
        }
    }
}

/// A thread's part of [`subtract_products`].
struct SubtractProducts<'a> {
    columns: Columns<'a>,
    first: usize,
    open: &'a mut [f64],
    top: usize,
    x: &'a [f64],
}

impl WithSimd for SubtractProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { columns, first, open, top, x } = self;
        let column = |j| columns.column(first + j, top..top + x.len());
        let (groups, rest) = open.as_chunks_mut::<GROUP>();
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

/// Subtracts a combination of columns: `rows ← rows − Σ_k columns[k]·factors[k]`.
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

/// Returns `columns[k]·x` for every k.
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
    use crate::kernel::{Family, Kernel};
    use crate::machine::pages::SpareBuffer;
    use crate::observer::Unobserved;
    use crate::regression::sums::regularization::Regularization;
    use crate::testing::fibonacci_sphere;

    /// A triangle with a dominant diagonal: that of a Gram matrix, not of its factor.
    fn triangle(n: usize) -> PackedMatrix {
        let kernel = Kernel::new(Family::Gauss, 0.3, 1.0).unwrap();
        let alpha = Regularization::uniform(0.2 * n as f64 + 1.0).unwrap();
        PackedMatrix::gram(&SpareBuffer::up_to(0), &fibonacci_sphere(n), &kernel, &alpha, &Unobserved)
            .unwrap()
    }

    #[test]
    fn substitution_undoes_the_product_with_the_triangle() {
        // Sizes around panels, groups, registers and tasks of both halves.
        for n in [1, 2, 7, 16, 17, 255, 256, 257, 273, 600, 1402, 2581] {
            let l = triangle(n);
            let (h, first, second) = (PackedMatrix::n_columns(n), l.first(), l.second_transposed());
            let expected: Vec<f64> = (0..n).map(|i| (0.9 * i as f64).cos()).collect();
            let (mut forward, mut backward) = (vec![0.0; n], vec![0.0; n]);
            for j in 0..n {
                for i in j..n {
                    let entry = if j < h { first[(i, j)] } else { second[(j - h, i - h)] };
                    forward[i] += entry * expected[j];
                    backward[j] += entry * expected[i];
                }
            }
            solve_forward(&l, &mut forward);
            solve_backward(&l, &mut backward);
            // The diagonal outweighs its column: substitution amplifies rounding by a few units only.
            for found in [&forward, &backward] {
                let error = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < 1e-13, "n = {n}: {error:e}");
            }
        }
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let l = triangle(1500);
        let solve = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            let mut x: Vec<f64> = (0..1500).map(|i| (0.9 * i as f64).cos()).collect();
            pool.install(|| {
                solve_forward(&l, &mut x);
                solve_backward(&l, &mut x);
            });
            x
        };
        assert_eq!(solve(1), solve(3));
    }
}
