//! Kriging of several queries at once, one in each lane of a register.
//!
//! Let N be the points around a query q, K = LLᵀ the covariances of their values y, noise included, and
//! `c = k(N, q)`. Forward substitution of y and c gives `u(q) = (L⁻¹c)·(L⁻¹y)` and the variance
//! `k₀ − |L⁻¹c|²`. This is simple kriging (Rasmussen and Williams 2006, alg. 2.1).
//!
//! Derivatives also need the weights `Λ = L⁻ᵀL⁻¹y`. The variance of a derivative needs a row of its own, the
//! covariances `c′` of the derivative with the values. It is the prior variance minus `|L⁻¹c′|²`.

use pulp::{Simd, WithSimd};

use super::batch::Batch;
use super::parts::{BENDS, COLUMNS, CROSS, Found, N_ROWS, Parts, SLOPES, VALUES, WEIGHTS, triangle};
use crate::kernel::{Kernel, Pairs};
use crate::machine::registers::{BLOCK, Pack};

/// Numbers in the widest register.
const MAX_LANES: usize = 8;

/// Conditional variances up to this multiple of k₀ are rounding. Such a point follows from those before it
/// and is left out.
///
/// The fallback of the dense solver stops at the same multiple.
const DEPENDENT: f64 = 64.0 * f64::EPSILON;

/// 2⁻⁵⁰⁰. Correlations below this are set to 0, and so are entries of the factor below this times √k₀.
///
/// With k₀ near 1, no product of two remaining entries is subnormal. Some processors take a hundred cycles
/// for each subnormal product. Values that are tiny beside the greatest of their neighbourhood may still lead
/// to some.
const VANISHES: f64 = f64::from_bits((1023 - 500) << 52);

/// Buffers for one batch.
pub(super) struct Workspace {
    matrix: Vec<f64>,
    start: usize,
    /// Results, `[numbers, lanes]`, in the order of [`Found`].
    pub found: Vec<f64>,
}

impl Workspace {
    pub(super) fn new(dimension: usize, count: usize, parts: Parts) -> Self {
        let n = count.next_multiple_of(COLUMNS);
        let n_rows = N_ROWS + parts.n_rows();
        let n_registers = triangle(n).next_multiple_of(BLOCK) + n_rows * n.next_multiple_of(BLOCK);
        let matrix = vec![0.0; (n_registers + 1) * MAX_LANES];
        // Start at the boundary of a cache line.
        let start = matrix.as_ptr().align_offset(64).min(MAX_LANES);
        let found = vec![0.0; parts.n_numbers(dimension) * MAX_LANES];
        Self { matrix, start, found }
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
        let (matrix, _) = S::as_mut_simd_f64s(&mut workspace.matrix[workspace.start..]);
        let (found, _) = S::as_mut_simd_f64s(&mut workspace.found);
        let n = batch.n_places();
        let below = triangle(n).next_multiple_of(BLOCK);
        let mut system = Factored { simd, n, below, batch, kernel, matrix };
        system.fill_triangle();
        system.fill_rows(parts.order);
        system.fill_derivatives(parts);
        system.fill_functionals(parts);
        system.fill_functions(parts);
        system.factorize(parts);
        system.sum_up(parts, found);
    }
}

/// A batch during its factorization.
///
/// `matrix` holds the rows of the lower triangle one after the other. From `below` on it holds the rows of
/// the right-hand sides, each from a multiple of [`BLOCK`].
struct Factored<'a, S: Simd> {
    simd: S,
    n: usize,
    below: usize,
    batch: &'a Batch,
    kernel: &'a Kernel,
    matrix: &'a mut [S::f64s],
}

/// Returns `variance · φ`, or 0 where φ is below [`VANISHES`].
#[inline(always)]
fn covariance<S: Simd>(kernel: &Kernel, correlation: Pack<S>) -> Pack<S> {
    correlation.select_below(VANISHES, 0.0, kernel.variance()) * correlation
}

/// A pass that overwrites squared distances by `variance · φ`.
struct Values<'a, S: Simd> {
    simd: S,
    entries: &'a mut [S::f64s],
    kernel: &'a Kernel,
}

impl<S: Simd> Pairs<S> for Values<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (Pack::read(self.simd, self.entries, at) * self.kernel.inverse_square_length(), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        covariance(self.kernel, profile[0]).write(self.entries, at);
    }
}

/// A pass that overwrites squared distances by `variance · φ` and also writes φ′ and φ″.
struct Derivatives<'a, S: Simd> {
    simd: S,
    entries: &'a mut [S::f64s],
    slopes: &'a mut [S::f64s],
    bends: &'a mut [S::f64s],
    kernel: &'a Kernel,
}

impl<S: Simd> Pairs<S> for Derivatives<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (Pack::read(self.simd, self.entries, at) * self.kernel.inverse_square_length(), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        covariance(self.kernel, profile[0]).write(self.entries, at);
        profile[1].write(self.slopes, at);
        profile[2].write(self.bends, at);
    }
}

impl<S: Simd> Factored<'_, S> {
    const PER_BLOCK: usize = BLOCK / S::F64_LANES;

    #[inline(always)]
    fn row(&self, row: usize) -> usize {
        self.below + row * self.n.next_multiple_of(BLOCK)
    }

    #[inline(always)]
    fn splat(&self, x: f64) -> Pack<S, 1> {
        Pack::splat(self.simd, x)
    }

    #[inline(always)]
    fn at(&self, place: usize) -> Pack<S, 1> {
        Pack::read(self.simd, self.matrix, place)
    }

    #[inline(always)]
    fn of(&self, list: &[f64], at: usize) -> Pack<S, 1> {
        let (registers, _) = S::as_simd_f64s(list);
        Pack::read(self.simd, registers, at)
    }

    /// Returns the entry of D = q − x_j along an axis, stretched by the kernel.
    #[inline(always)]
    fn difference(&self, axis: usize, j: usize) -> Pack<S, 1> {
        self.of(&self.batch.query, axis) - self.of(&self.batch.points, axis * self.n + j)
    }

    /// Fills the triangle with `K + noise`. Rows of empty places are those of the identity.
    #[inline(always)]
    fn fill_triangle(&mut self) {
        let (n, count) = (self.n, self.batch.count);
        for i in 0..count {
            let row = triangle(i);
            for axis in 0..self.batch.dimension {
                let x = self.of(&self.batch.points, axis * n + i);
                for j in 0..i {
                    let step = x - self.of(&self.batch.points, axis * n + j);
                    let before = if axis == 0 { self.splat(0.0) } else { self.at(row + j) };
                    step.mul_add(step, before).write(self.matrix, row + j);
                }
            }
        }
        for block in 0..triangle(count).div_ceil(Self::PER_BLOCK) {
            let entries = &mut self.matrix[block * Self::PER_BLOCK..][..Self::PER_BLOCK];
            self.kernel.profiles(Values { simd: self.simd, entries, kernel: self.kernel });
        }
        for i in 0..count {
            let diagonal = self.of(&self.batch.noise, i) + self.kernel.at_zero();
            diagonal.write(self.matrix, triangle(i) + i);
        }
        for i in count..n {
            for j in 0..i {
                self.splat(0.0).write(self.matrix, triangle(i) + j);
            }
            self.splat(1.0).write(self.matrix, triangle(i) + i);
        }
    }

    /// Fills the rows of values, of covariances with the query and, for derivatives, of φ′ and φ″.
    #[inline(always)]
    fn fill_rows(&mut self, order: usize) {
        let (values, cross) = (self.row(VALUES), self.row(CROSS));
        for j in 0..self.n {
            let mut square = self.splat(0.0);
            for axis in 0..self.batch.dimension {
                let difference = self.difference(axis, j);
                square = difference.mul_add(difference, square);
            }
            square.write(self.matrix, cross + j);
            self.of(&self.batch.values, j).write(self.matrix, values + j);
        }
        let length = self.n.next_multiple_of(BLOCK);
        for block in 0..self.n.div_ceil(Self::PER_BLOCK) {
            let first = block * Self::PER_BLOCK;
            let (simd, kernel) = (self.simd, self.kernel);
            let (rows, rest) = self.matrix[cross..].split_at_mut(length);
            let entries = &mut rows[first..][..Self::PER_BLOCK];
            if order == 0 {
                kernel.profiles(Values { simd, entries, kernel });
                continue;
            }
            let (slopes, bends) = rest[length * (SLOPES - CROSS - 1)..].split_at_mut(length);
            let slopes = &mut slopes[first..][..Self::PER_BLOCK];
            let bends = &mut bends[first..][..Self::PER_BLOCK];
            kernel.profiles(Derivatives { simd, entries, slopes, bends, kernel });
        }
        for j in self.batch.count..self.n {
            self.splat(0.0).write(self.matrix, cross + j);
        }
    }

    /// Fills the rows of the derivatives with their covariances with the values, derivatives in units of ℓ.
    ///
    /// With s = D/ℓ they are `2vφ′s_a` and `4vφ″s_as_b + 2vφ′δ_ab`.
    #[inline(always)]
    fn fill_derivatives(&mut self, parts: Parts) {
        let (d, v, inverse) =
            (self.batch.dimension, self.kernel.variance(), 1.0 / self.kernel.length_scale());
        if parts.n_derivatives == 0 {
            return;
        }
        let (slopes, bends) = (self.row(SLOPES), self.row(BENDS));
        for j in 0..self.batch.count {
            let slope = self.at(slopes + j) * (2.0 * v);
            let bend = self.at(bends + j) * (4.0 * v);
            let mut second = N_ROWS + d;
            for a in 0..d {
                let step = self.difference(a, j) * inverse;
                (slope * step).write(self.matrix, self.row(N_ROWS + a) + j);
                if parts.order < 2 {
                    continue;
                }
                // Multiplied in this order for the reason given in `sum_derivatives`.
                let first = bend * step;
                for b in a..d {
                    let along = if a == b { slope } else { self.splat(0.0) };
                    let entry = first.mul_add(self.difference(b, j) * inverse, along);
                    entry.write(self.matrix, self.row(second) + j);
                    second += 1;
                }
            }
        }
        for derivative in 0..parts.n_derivatives {
            for j in self.batch.count..self.n {
                self.splat(0.0).write(self.matrix, self.row(N_ROWS + derivative) + j);
            }
        }
    }

    /// Fills the rows of the functionals with their covariances with the values.
    #[inline(always)]
    fn fill_functionals(&mut self, parts: Parts) {
        for functional in 0..parts.n_functionals {
            let row = self.row(parts.quantities() + functional);
            for j in 0..self.n {
                let mut sum = self.splat(0.0);
                for derivative in 0..parts.n_derivatives {
                    let factor =
                        self.of(&self.batch.functionals, functional * parts.n_derivatives + derivative);
                    sum = factor.mul_add(self.at(self.row(N_ROWS + derivative) + j), sum);
                }
                sum.write(self.matrix, row + j);
            }
        }
    }

    /// Fills the rows of the functions of the mean with their values at the points.
    #[inline(always)]
    fn fill_functions(&mut self, parts: Parts) {
        for function in 0..parts.n_functions {
            let row = self.row(parts.functions() + function);
            for j in 0..self.n {
                self.of(&self.batch.functions, function * self.n + j).write(self.matrix, row + j);
            }
        }
    }

    /// Factorizes K = LLᵀ and multiplies the rows of right-hand sides below by L⁻ᵀ: left-looking, in tiles.
    #[inline(always)]
    fn factorize(&mut self, parts: Parts) {
        for column in (0..self.n).step_by(COLUMNS) {
            // The triangle on the diagonal, row by row.
            for i in column..column + COLUMNS {
                self.tile::<1>([triangle(i)], column, i - column);
            }
            let mut i = column + COLUMNS;
            while i < self.n {
                // As many rows as there are registers for.
                if S::F64_LANES == MAX_LANES {
                    self.tile::<4>(
                        [triangle(i), triangle(i + 1), triangle(i + 2), triangle(i + 3)],
                        column,
                        COLUMNS,
                    );
                    i += 4;
                } else {
                    self.tile::<2>([triangle(i), triangle(i + 1)], column, COLUMNS);
                    i += 2;
                }
            }
            self.tile::<2>([self.row(VALUES), self.row(CROSS)], column, COLUMNS);
            for row in parts.quantities()..N_ROWS + parts.n_rows() {
                self.tile::<1>([self.row(row)], column, COLUMNS);
            }
        }
    }

    /// Computes a tile: R rows by the [`COLUMNS`] columns from `column` on. All columns before must be done.
    ///
    /// The diagonal entry of the row is at column `column + pivot`. If `pivot` is [`COLUMNS`], it is not in
    /// the tile.
    #[inline(always)]
    fn tile<const R: usize>(&mut self, rows: [usize; R], column: usize, pivot: usize) {
        let zero = self.splat(0.0);
        let mut sums = [[zero; COLUMNS]; R];
        {
            let matrix = &*self.matrix;
            let mut above = [&matrix[..column]; COLUMNS];
            let mut left = [&matrix[..column]; R];
            for c in 0..COLUMNS {
                above[c] = &matrix[triangle(column + c)..][..column];
            }
            for r in 0..R {
                left[r] = &matrix[rows[r]..][..column];
            }
            for l in 0..column {
                let mut factors = [zero; COLUMNS];
                for c in 0..COLUMNS {
                    factors[c] = Pack::read(self.simd, above[c], l);
                }
                for r in 0..R {
                    let entry = Pack::<S, 1>::read(self.simd, left[r], l);
                    for c in 0..COLUMNS {
                        sums[r][c] = entry.mul_add(factors[c], sums[r][c]);
                    }
                }
            }
        }
        for r in 0..R {
            self.finish(rows[r] + column, column, pivot, sums[r]);
        }
    }

    /// Computes the entries of one row of a tile, from place `first` on.
    ///
    /// `sums` are the products of the columns before, which are subtracted.
    #[inline(always)]
    fn finish(&mut self, first: usize, column: usize, pivot: usize, sums: [Pack<S, 1>; COLUMNS]) {
        let mut entries = [self.splat(0.0); COLUMNS];
        // Values have a unit of their own and may be small, so none is set to 0.
        let is_values = (self.row(VALUES)..self.row(CROSS)).contains(&first);
        let least = if is_values { 0.0 } else { VANISHES * self.kernel.at_zero().sqrt() };
        for c in 0..COLUMNS {
            let above = triangle(column + c) + column;
            let mut entry = self.at(first + c) - sums[c];
            for (b, known) in entries.iter().enumerate().take(c) {
                entry = entry - *known * self.at(above + b);
            }
            if c == pivot {
                self.inverse_root(entry).write(self.matrix, first + c);
                return;
            }
            entries[c] = entry * self.at(above + c);
            entries[c] = entries[c] * entries[c].abs().select_below(least, 0.0, 1.0);
            entries[c].write(self.matrix, first + c);
        }
    }

    /// Returns the inverse of a diagonal entry of L, from its square, the conditional variance of a point.
    ///
    /// The inverse is stored in place of the entry, since rows below multiply by it. It is 0 for a dependent
    /// point, which is thereby left out.
    #[inline(always)]
    fn inverse_root(&self, variance: Pack<S, 1>) -> Pack<S, 1> {
        let least = DEPENDENT * self.kernel.at_zero();
        variance.select_below(least, 0.0, 1.0) / variance.at_least(least).sqrt()
    }

    /// Writes the results of the batch, in the order of [`Found`].
    #[inline(always)]
    fn sum_up(&mut self, parts: Parts, found: &mut [S::f64s]) {
        let (d, n) = (self.batch.dimension, self.n);
        let places = Found::of(d);
        let (values, cross, weights) = (self.row(VALUES), self.row(CROSS), self.row(WEIGHTS));
        self.product(values, cross).write(found, 0);
        let mut n_dependent = self.splat(0.0);
        for i in 0..n {
            n_dependent = n_dependent + self.at(triangle(i) + i).select_below(f64::MIN_POSITIVE, 1.0, 0.0);
        }
        n_dependent.write(found, places.n_dependent);
        if parts.variances {
            self.product(cross, cross).write(found, places.explained);
            self.back_substitute(cross, weights);
            self.product(weights, weights).write(found, places.norm_squared);
        }
        for quantity in 0..parts.n_quantities() {
            let row = self.row(parts.quantities() + quantity);
            self.product(row, row).write(found, places.of_quantities() + quantity);
        }
        let mut place = places.of_functions(&parts);
        for function in 0..parts.n_functions {
            let row = self.row(parts.functions() + function);
            self.product(row, cross).write(found, place);
            for quantity in 0..parts.n_quantities() {
                let other = self.row(parts.quantities() + quantity);
                self.product(row, other).write(found, place + 1 + quantity);
            }
            place += 1 + parts.n_quantities();
        }
        if parts.order > 0 {
            self.back_substitute(values, weights);
            self.sum_derivatives(parts.order, found);
        }
    }

    /// Returns the inner product of two rows, given by the places where they start.
    #[inline(always)]
    fn product(&self, a: usize, b: usize) -> Pack<S, 1> {
        let mut sums = [self.splat(0.0); 4];
        // n is a multiple of 4.
        for l in (0..self.n).step_by(4) {
            for (s, sum) in sums.iter_mut().enumerate() {
                *sum = self.at(a + l + s).mul_add(self.at(b + l + s), *sum);
            }
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }

    /// Writes L⁻ᵀ times the row at `from` into the row at `to`, row by row of L.
    #[inline(always)]
    fn back_substitute(&mut self, from: usize, to: usize) {
        for i in 0..self.n {
            self.at(from + i).write(self.matrix, to + i);
        }
        for i in (0..self.n).rev() {
            let row = triangle(i);
            let weight = self.at(to + i) * self.at(row + i);
            weight.write(self.matrix, to + i);
            for j in 0..i {
                let rest = self.at(to + j) - self.at(row + j) * weight;
                rest.write(self.matrix, to + j);
            }
        }
    }

    /// Writes `Σλφ′D_a`, `Σλφ″D_aD_b` and `Σλφ′`, and overwrites the rows of φ′ and φ″ by λφ′ and λφ″.
    #[inline(always)]
    fn sum_derivatives(&mut self, order: usize, found: &mut [S::f64s]) {
        let (d, count) = (self.batch.dimension, self.batch.count);
        let (weights, slopes, bends) = (self.row(WEIGHTS), self.row(SLOPES), self.row(BENDS));
        let mut trace = self.splat(0.0);
        for j in 0..count {
            let weight = self.at(weights + j);
            let slope = self.at(slopes + j) * weight;
            trace = trace + slope;
            slope.write(self.matrix, slopes + j);
            (self.at(bends + j) * weight).write(self.matrix, bends + j);
        }
        let mut place = 1 + d;
        for a in 0..d {
            let mut sum = self.splat(0.0);
            for j in 0..count {
                sum = self.at(slopes + j).mul_add(self.difference(a, j), sum);
            }
            sum.write(found, 1 + a);
            if order < 2 {
                continue;
            }
            for b in a..d {
                let mut sum = self.splat(0.0);
                for j in 0..count {
                    // φ″ is 0 at long differences. Multiplied first, it keeps the product of two of them
                    // finite.
                    let first = self.at(bends + j) * self.difference(a, j);
                    sum = first.mul_add(self.difference(b, j), sum);
                }
                sum.write(found, place);
                place += 1;
            }
        }
        trace.write(found, 1 + d + triangle(d));
    }
}
