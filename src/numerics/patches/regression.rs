//! Kriging of heights over a tangent plane, several queries at once: one in each lane of a register.
//!
//! Around each query the surface is a height `z(t) = f(t)ᵀβ + g(t) + ε` over d − 1 tangential coordinates: a quadratic trend with
//! flat prior, a Gaussian process `g` with covariance `s² φ(|t − t′|²/ℓ²)`, and noise of variance `s²τ²w_j` at point j (w_j is 1 over
//! the number of points whose mean it is). With `K = φ + τ²W`, all that is asked for comes from one Cholesky factorization of
//! K by forward substitution of the trend F, the heights z and the covariances C of the derivatives at the query: universal
//! kriging (Cressie 1993, sec. 3.4; Rasmussen and Williams 2006, sec. 2.7), with the scale s² integrated out.

use pulp::{Simd, WithSimd};
use smallvec::SmallVec;

use crate::numerics::kernel::{Kernel, Pairs};
use crate::numerics::machine::registers::{BLOCK, Pack};

/// Numbers in the widest register.
pub(crate) const MAX_LANES: usize = 8;

/// Rows that are solved for at once, and columns: 8 chains of products that do not wait for one another.
const ROWS: usize = 4;
const COLUMNS: usize = 2;

/// What every point is given beside its noise, relative to k₀: rounding of the heights.
const NUGGET: f64 = 1e-13;

/// Deviation of the factor by which curvature entails more, beyond second order, than a shape operator that goes along unchanged.
const DOUBT: f64 = 0.3;

/// Rounding of the heights, in units of the radius.
const LEAST_HEIGHT: f64 = 1e-16;

/// 1, d − 1 coordinates, their products: `d(d+1)/2`.
pub(crate) const fn n_terms(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Shape of the covariance: all but its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Model {
    /// φ of length scale 1, variance 1.
    pub kernel: Kernel,
    /// ℓ in units of the radius of a patch.
    pub length_scale: f64,
    /// τ²: variance of the noise of a point over s².
    pub noise: f64,
    /// Terms of the trend: 1 + (d − 1) for a plane, d(d+1)/2 for a quadric.
    pub n_trend: usize,
}

impl Model {
    /// Variance of a third derivative of g along an axis over 15 s², in units of the radius: −8φ‴(0)/ℓ⁶ by the mixed derivatives of
    /// a radial function.
    pub(crate) fn third_derivative_variance(&self) -> f64 {
        THIRD_DERIVATIVE * self.length_scale.powi(-6)
    }
}

/// −8φ‴(0) of Matérn's kernel for ν = 9/2: φ‴ = −ν³ θ₁(0)/θ₄(0).
const THIRD_DERIVATIVE: f64 = 8.0 * 4.5 * 4.5 * 4.5 / 105.0;

/// Neighbourhoods side by side: `count` points each (masked ones make up for neighbourhoods that have less).
pub(crate) struct Batch {
    pub dimension: usize,
    pub count: usize,
    pub lanes: usize,
    /// Tangential coordinates and height in units of the radius, `[d, count, lanes]`.
    coordinates: Vec<f64>,
    /// Terms of second order: means of ½t_a², t_a t_b over the points of a mean, `[k(k+1)/2, count, lanes]`.
    products: Vec<f64>,
    /// What curvature entails beyond second order, which is taken off the heights, `[count, lanes]`.
    entailed: Vec<f64>,
    /// w: 1 over the number of points of a mean, `[count, lanes]`.
    weights: Vec<f64>,
    /// 1 for a point, 0 for a place that is left empty, `[count, lanes]`.
    is_point: Vec<f64>,
}

impl Batch {
    pub(crate) fn new(dimension: usize, count: usize, lanes: usize) -> Self {
        let k = dimension - 1;
        Self {
            dimension,
            count,
            lanes,
            coordinates: vec![0.0; dimension * count * lanes],
            products: vec![0.0; k * (k + 1) / 2 * count * lanes],
            entailed: vec![0.0; count * lanes],
            weights: vec![1.0; count * lanes],
            is_point: vec![0.0; count * lanes],
        }
    }

    pub(crate) fn set_point(&mut self, j: usize, lane: usize, is_point: bool) {
        self.is_point[j * self.lanes + lane] = f64::from(u8::from(is_point));
    }

    pub(crate) fn set_coordinate(&mut self, axis: usize, j: usize, lane: usize, value: f64) {
        self.coordinates[(axis * self.count + j) * self.lanes + lane] = value;
    }

    pub(crate) fn set_product(&mut self, term: usize, j: usize, lane: usize, value: f64) {
        self.products[(term * self.count + j) * self.lanes + lane] = value;
    }

    pub(crate) fn set_entailed(&mut self, j: usize, lane: usize, value: f64) {
        self.entailed[j * self.lanes + lane] = value;
    }

    pub(crate) fn set_weight(&mut self, j: usize, lane: usize, weight: f64) {
        self.weights[j * self.lanes + lane] = weight;
    }

    /// Leaves out the points of a lane from one on: they are the farthest.
    pub(crate) fn keep(&mut self, lane: usize, n_kept: usize) {
        for j in n_kept..self.count {
            self.set_point(j, lane, false);
        }
    }

    /// Fills an unused lane with what another has, so that it takes no exceptions.
    pub(crate) fn copy_lane(&mut self, from: usize, to: usize) {
        let lanes = self.lanes;
        for list in [
            &mut self.coordinates,
            &mut self.products,
            &mut self.entailed,
            &mut self.weights,
            &mut self.is_point,
        ] {
            list.chunks_exact_mut(lanes).for_each(|row| row[to] = row[from]);
        }
    }
}

/// What a model says at the query of one lane, in units of the radius R of its patch.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kriged {
    /// Logarithm of the restricted likelihood with s² integrated out under 1/s², up to a constant of the patch; NaN where K is not
    /// positive definite in float64.
    pub log_likelihood: f64,
    /// s², as `q/(n − p)`.
    pub scale: f64,
    /// n − p.
    pub freedom: f64,
    /// z, z_a, z_aa, z_ab at the query, `[p]`.
    pub means: Terms,
    /// Their covariance, `[p, p]`.
    pub covariance: Squares,
}

/// Numbers per term, and per pair of terms, on the stack for surfaces in space.
pub(crate) type Terms = SmallVec<[f64; 8]>;
pub(crate) type Squares = SmallVec<[f64; 36]>;

/// Room for one batch.
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
        // On the boundary of a cache line.
        let start = matrix.as_ptr().align_offset(64).min(MAX_LANES);
        Self { matrix, start }
    }
}

fn extra_rows(dimension: usize) -> usize {
    (2 * n_terms(dimension) + 2).next_multiple_of(ROWS)
}

const fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Kriging of each lane.
pub(crate) struct Krige<'a> {
    pub batch: &'a Batch,
    pub model: &'a Model,
    pub workspace: &'a mut Workspace,
    /// Whether derivatives at the query are asked for beside the likelihood.
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

/// A batch on its way through the factorization: rows of the lower triangle one after the other, and below it the rows of Fᵀ
/// `[p]`, zᵀ, Cᵀ `[p]`, all of length n.
struct Factored<'a, S: Simd> {
    simd: S,
    k: usize,
    n: usize,
    p: usize,
    p_trend: usize,
    n_rows: usize,
    batch: &'a Batch,
    model: &'a Model,
    matrix: &'a mut [S::f64s],
}

/// φ over scaled squared distances that are there already.
struct Fill<'a, S: Simd> {
    simd: S,
    entries: &'a mut [S::f64s],
    scale: f64,
}

impl<S: Simd> Pairs<S> for Fill<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (Pack::read(self.simd, self.entries, at) * self.scale, ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        profile[0].write(self.entries, at);
    }
}

/// φ, φ′ and φ″ at one block of scaled squared distances.
struct Derivatives<'a, S: Simd> {
    simd: S,
    entries: &'a mut [S::f64s],
    first: &'a mut [S::f64s],
    second: &'a mut [S::f64s],
    scale: f64,
}

impl<S: Simd> Pairs<S> for Derivatives<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (Pack::read(self.simd, self.entries, at) * self.scale, ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        profile[0].write(self.entries, at);
        profile[1].write(self.first, at);
        profile[2].write(self.second, at);
    }
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

    /// φ below the diagonal, 1 + noise on it; rows and columns of empty places are those of the identity.
    #[inline(always)]
    fn fill_triangle(&mut self) {
        let n = self.n;
        for i in 0..n {
            let row = triangle(i);
            for j in 0..i {
                let mut q = Pack::<S, 1>::splat(self.simd, 0.0);
                for axis in 0..self.k {
                    let step = self.coordinate(axis, i) - self.coordinate(axis, j);
                    q = step.mul_add(step, q);
                }
                q.write(self.matrix, row + j);
            }
            Pack::<S, 1>::splat(self.simd, 0.0).write(self.matrix, row + i);
        }
        let scale = self.model.length_scale.powi(-2);
        let per_block = BLOCK / S::F64_LANES;
        let n_blocks = triangle(n).div_ceil(per_block);
        for block in 0..n_blocks {
            let entries = &mut self.matrix[block * per_block..][..per_block];
            self.model.kernel.profiles(Fill { simd: self.simd, entries, scale });
        }
        for i in 0..n {
            let (row, mask) = (triangle(i), self.mask(i));
            for j in 0..i {
                let both = mask * self.mask(j);
                (self.at(row + j) * both).write(self.matrix, row + j);
            }
            let noise = self.of(&self.batch.weights, i) * self.model.noise * mask + (1.0 + NUGGET);
            noise.write(self.matrix, row + i);
        }
    }

    #[inline(always)]
    fn fill_trend(&mut self) {
        let (n, k) = (self.n, self.k);
        let zero = Pack::<S, 1>::splat(self.simd, 0.0);
        for j in 0..n {
            let mask = self.mask(j);
            mask.write(self.matrix, self.row(n) + j);
            for axis in 0..k {
                (self.coordinate(axis, j) * mask).write(self.matrix, self.row(n + 1 + axis) + j);
            }
            for term in k + 1..self.p {
                let product = self.of(&self.batch.products, (term - k - 1) * n + j);
                let product = if term < self.p_trend { product * mask } else { zero };
                product.write(self.matrix, self.row(n + term) + j);
            }
            (self.coordinate(k, j) * mask).write(self.matrix, self.row(n + self.p) + j);
            (self.of(&self.batch.entailed, j) * mask).write(self.matrix, self.row(n + self.p + 1) + j);
            for row in n + self.p + 2..self.n_rows {
                zero.write(self.matrix, self.row(row) + j);
            }
        }
    }

    /// Covariances of the derivatives at the query, t = 0, with g at the points: by D = 0 − t_j
    /// `∂_a k = 2φ′D_a/ℓ²`, `∂_ab k = 4φ″D_aD_b/ℓ⁴ + 2φ′δ_ab/ℓ²`.
    #[inline(always)]
    fn fill_covariances(&mut self) {
        let (n, k) = (self.n, self.k);
        let scale = self.model.length_scale.powi(-2);
        let per_block = BLOCK / S::F64_LANES;
        let zero = self.simd.splat_f64s(0.0);
        // As many registers as a block has at most.
        let mut q = [zero; BLOCK];
        let mut first = [zero; BLOCK];
        let mut second = [zero; BLOCK];
        let base = n + self.p + 2;
        let mut start = 0;
        while start < n {
            let end = (start + per_block).min(n);
            for j in start..end {
                let mut square = Pack::<S, 1>::splat(self.simd, 0.0);
                for axis in 0..k {
                    let t = self.coordinate(axis, j);
                    square = t.mul_add(t, square);
                }
                square.write(&mut q, j - start);
            }
            self.model.kernel.profiles(Derivatives {
                simd: self.simd,
                entries: &mut q[..per_block],
                first: &mut first[..per_block],
                second: &mut second[..per_block],
                scale,
            });
            for j in start..end {
                let mask = self.mask(j);
                let phi = Pack::<S, 1>::read(self.simd, &q, j - start);
                let slope = Pack::<S, 1>::read(self.simd, &first, j - start) * (2.0 * scale) * mask;
                let bend = Pack::<S, 1>::read(self.simd, &second, j - start) * (4.0 * scale * scale) * mask;
                (phi * mask).write(self.matrix, self.row(base) + j);
                let mut term = base + 1 + k;
                for a in 0..k {
                    let t_a = self.coordinate(a, j);
                    (-(slope * t_a)).write(self.matrix, self.row(base + 1 + a) + j);
                    for b in a..k {
                        let product = bend * t_a * self.coordinate(b, j);
                        let entry = if a == b { product + slope } else { product };
                        entry.write(self.matrix, self.row(term) + j);
                        term += 1;
                    }
                }
            }
            start = end;
        }
    }

    /// Left-looking, in tiles: K = LLᵀ, and below it the rows of the right-hand sides times L⁻ᵀ.
    #[inline(always)]
    fn factorize(&mut self, n_rows: usize) {
        let mut column = 0;
        while column < self.n {
            // The triangle on the diagonal, row by row.
            for i in column..(column + COLUMNS).min(n_rows) {
                self.tile::<1>(i, column);
            }
            let mut i = column + COLUMNS;
            while i < n_rows {
                if i + ROWS <= n_rows {
                    self.tile::<ROWS>(i, column);
                    i += ROWS;
                } else {
                    self.tile::<1>(i, column);
                    i += 1;
                }
            }
            column += COLUMNS;
        }
    }

    /// R rows from i on by the columns from `column` on, once all columns before are done.
    #[inline(always)]
    fn tile<const R: usize>(&mut self, i: usize, column: usize) {
        let zero = Pack::<S, 1>::splat(self.simd, 0.0);
        let mut rows = [0; R];
        for (r, row) in rows.iter_mut().enumerate() {
            *row = self.row(i + r);
        }
        let columns = [self.row(column), self.row(column + 1)];
        let mut sums = [[zero; COLUMNS]; R];
        {
            let matrix = &*self.matrix;
            let left = [&matrix[columns[0]..][..column], &matrix[columns[1]..][..column]];
            let mut slices = [left[0]; R];
            for r in 0..R {
                slices[r] = &matrix[rows[r]..][..column];
            }
            for l in 0..column {
                let a = Pack::<S, 1>::read(self.simd, left[0], l);
                let b = Pack::<S, 1>::read(self.simd, left[1], l);
                for r in 0..R {
                    let x = Pack::<S, 1>::read(self.simd, slices[r], l);
                    sums[r][0] = x.mul_add(a, sums[r][0]);
                    sums[r][1] = x.mul_add(b, sums[r][1]);
                }
            }
        }
        for r in 0..R {
            let row = rows[r];
            let first = self.at(row + column) - sums[r][0];
            if i + r == column {
                // The inverse of the diagonal is kept in its place: rows below multiply by it.
                (1.0 / first.sqrt()).write(self.matrix, row + column);
                continue;
            }
            let first = first * self.at(columns[0] + column);
            first.write(self.matrix, row + column);
            let cross = self.at(columns[1] + column);
            let second = if i + r == column + 1 {
                self.at(row + column + 1) - first.mul_add(first, sums[r][1])
            } else {
                self.at(row + column + 1) - first.mul_add(cross, sums[r][1])
            };
            if i + r == column + 1 {
                (1.0 / second.sqrt()).write(self.matrix, row + column + 1);
            } else {
                (second * self.at(columns[1] + column + 1)).write(self.matrix, row + column + 1);
            }
        }
    }

    #[inline(always)]
    fn product(&self, i: usize, j: usize) -> Pack<S, 1> {
        let (a, b) = (self.row(i), self.row(j));
        let mut sums = [Pack::<S, 1>::splat(self.simd, 0.0); 4];
        let mut l = 0;
        while l + 4 <= self.n {
            for (s, sum) in sums.iter_mut().enumerate() {
                *sum = self.at(a + l + s).mul_add(self.at(b + l + s), *sum);
            }
            l += 4;
        }
        while l < self.n {
            sums[0] = self.at(a + l).mul_add(self.at(b + l), sums[0]);
            l += 1;
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }

    /// Inner products of the rows below give the likelihood, the trend and the derivatives.
    #[inline(always)]
    fn solve(&mut self, predicts: bool) -> SmallVec<[Kriged; MAX_LANES]> {
        let (p, p_trend) = (self.p, self.p_trend);
        let n_kept = if predicts { 2 * p + 2 } else { p + 2 };
        let start = self.matrix.len() - 2 * extra_rows(self.k + 1).pow(2);
        for i in 0..n_kept {
            for j in 0..=i {
                let product = self.product(self.n + i, self.n + j);
                product.write(self.matrix, start + i * n_kept + j);
            }
        }
        // A = FᵀK⁻¹F = RRᵀ, then R⁻¹(b, U) with b = FᵀK⁻¹z and U = I − FᵀK⁻¹C, row by row.
        let entry = |i: usize, j: usize| start + i.max(j) * n_kept + i.min(j);
        let small = start + n_kept * n_kept;
        let width = p_trend + 2 + p;
        let one = Pack::<S, 1>::splat(self.simd, 1.0);
        let zero = Pack::<S, 1>::splat(self.simd, 0.0);
        let n_columns = if predicts { width } else { p_trend + 2 };
        for i in 0..p_trend {
            for j in 0..n_columns {
                let mut value = if j < p_trend {
                    self.at(entry(j, i))
                } else if j < p_trend + 2 {
                    self.at(entry(j - p_trend + p, i))
                } else {
                    let unit = if j - p_trend - 2 == i { one } else { zero };
                    unit - self.at(entry(j - p_trend + p, i))
                };
                if j < i {
                    continue;
                }
                // By columns of R: entry (i, j) of Rᵀ for j < p, of R⁻¹(b, U) beyond.
                for l in 0..i {
                    value = value - self.at(small + l * width + i) * self.at(small + l * width + j);
                }
                let value = if i == j { value.sqrt() } else { value / self.at(small + i * width + i) };
                value.write(self.matrix, small + i * width + j);
            }
        }
        // Forms of heights and of what is entailed in what the trend leaves of K⁻¹.
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            let mut quadratic = self.at(entry(p + i, p + j));
            for l in 0..p_trend {
                let row = small + l * width + p_trend;
                quadratic = quadratic - self.at(row + i) * self.at(row + j);
            }
            quadratic.write(self.matrix, entry(p + i, p + j));
        }
        if predicts {
            self.predict(start, n_kept, small, width);
        }
        self.lanes(start, n_kept, small, width, predicts)
    }

    /// Means and covariances over s² of the derivatives, in place of the products with C.
    #[inline(always)]
    fn predict(&mut self, start: usize, n_kept: usize, small: usize, width: usize) {
        let (p, p_trend) = (self.p, self.p_trend);
        let prior = prior_covariance(self.model, self.k);
        for i in 0..p {
            let row = start + (p + 2 + i) * n_kept;
            let u_i = small + p_trend + 2 + i;
            for data in 0..2 {
                let mut mean = self.at(row + p + data);
                for l in 0..p_trend {
                    let b = self.at(small + l * width + p_trend + data);
                    mean = self.at(u_i + l * width).mul_add(b, mean);
                }
                mean.write(self.matrix, row + p + data);
            }
            for j in 0..=i {
                let u_j = small + p_trend + 2 + j;
                let mut covariance = prior[i * p + j] - self.at(row + p + 2 + j);
                for l in 0..p_trend {
                    covariance = self.at(u_i + l * width).mul_add(self.at(u_j + l * width), covariance);
                }
                covariance.write(self.matrix, row + p + 2 + j);
            }
        }
    }

    /// The numbers of each lane.
    #[inline(always)]
    fn lanes(
        &self,
        start: usize,
        n_kept: usize,
        small: usize,
        width: usize,
        predicts: bool,
    ) -> SmallVec<[Kriged; MAX_LANES]> {
        let (n, p, p_trend) = (self.n, self.p, self.p_trend);
        let numbers: &[f64] = bytemuck::cast_slice(&*self.matrix);
        let lanes = S::F64_LANES;
        let at = |register: usize, lane: usize| numbers[register * lanes + lane];
        let mut found = SmallVec::new();
        for lane in 0..lanes {
            let n_points: f64 = self.batch.is_point[lane..].iter().step_by(lanes).sum();
            let freedom = n_points - p_trend as f64;
            let form = |i: usize, j: usize| at(start + (p + i) * n_kept + p + j, lane);
            let log_k = log_sum((0..n).map(|i| at(triangle(i) + i, lane)));
            let log_r = log_sum((0..p_trend).map(|i| at(small + i * width + i, lane)));
            // An exact plane or sphere leaves nothing at all, and nothing has no logarithm.
            let heights = form(0, 0).max(freedom * LEAST_HEIGHT * LEAST_HEIGHT);
            let doubt = Doubt::of(heights, form(1, 0), form(1, 1).max(0.0), freedom);
            let log_likelihood = log_k - log_r - doubt.log_penalty - 0.5 * freedom * doubt.quadratic.ln();
            let scale = doubt.quadratic / freedom;
            let mut kriged = Kriged { log_likelihood, scale, freedom, ..Kriged::default() };
            if predicts {
                let row = |i: usize| start + (p + 2 + i) * n_kept + p;
                let effect = |i: usize| at(row(i) + 1, lane);
                let covariance = |i: usize, j: usize| at(row(i.max(j)) + 2 + i.min(j), lane);
                kriged.means = (0..p).map(|i| at(row(i), lane) - doubt.mean * effect(i)).collect();
                let entry =
                    |i: usize, j: usize| scale * covariance(i, j) + doubt.variance * effect(i) * effect(j);
                kriged.covariance = (0..p * p).map(|at| entry(at / p, at % p)).collect();
            }
            found.push(kriged);
        }
        found
    }
}

/// What the data say of the factor by which curvature entails more than was taken off the heights: a normal prior about 0 makes one
/// more term of the trend, with deviation.
struct Doubt {
    mean: f64,
    variance: f64,
    /// q with the factor at its mean.
    quadratic: f64,
    /// What the likelihood loses for the choice.
    log_penalty: f64,
}

impl Doubt {
    /// From forms of heights z and of what is entailed e: zᵀPz, eᵀPz, eᵀPe. The scale is that without the factor.
    fn of(heights: f64, mixed: f64, entailed: f64, freedom: f64) -> Self {
        let scale = heights / freedom;
        let prior = DOUBT * DOUBT;
        let share = scale + prior * entailed;
        // Not a number is not positive either.
        let is_informed = share > 0.0;
        if !is_informed {
            return Self { mean: 0.0, variance: prior, quadratic: heights, log_penalty: 0.0 };
        }
        let mean = prior * mixed / share;
        Self {
            mean,
            variance: prior * scale / share,
            quadratic: (heights - mean * mixed).max(freedom * LEAST_HEIGHT * LEAST_HEIGHT),
            log_penalty: if scale > 0.0 { 0.5 * (share / scale).ln() } else { 0.0 },
        }
    }
}

/// Σ ln of factors, which may be many: products of a few at a time stay within float64.
fn log_sum(factors: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut product) = (0.0, 1.0);
    for (i, factor) in factors.enumerate() {
        product *= factor;
        if i % 8 == 7 {
            sum += f64::ln(product);
            product = 1.0;
        }
    }
    sum + product.ln()
}

/// Covariance of value, gradient and Hessian of g at one place over s².
fn prior_covariance(model: &Model, k: usize) -> Squares {
    let p = triangle(k) + k + 1;
    let scale = model.length_scale.powi(-2);
    let [phi, first, second] = model.kernel.profile_at_zero();
    let (slope, bend) = (2.0 * first * scale, 4.0 * second * scale * scale);
    let mut prior = Squares::from_elem(0.0, p * p);
    prior[0] = phi;
    let mut pairs = SmallVec::<[(usize, usize); 16]>::new();
    for a in 0..k {
        prior[(1 + a) * p + 1 + a] = -slope;
        pairs.extend((a..k).map(|b| (a, b)));
    }
    for (i, &(a, b)) in pairs.iter().enumerate() {
        let row = k + 1 + i;
        if a == b {
            prior[row] = slope;
            prior[row * p] = slope;
        }
        for (j, &(c, e)) in pairs.iter().enumerate() {
            let is = |x: usize, y: usize| f64::from(u8::from(x == y));
            prior[row * p + k + 1 + j] =
                bend * (is(a, b) * is(c, e) + is(a, c) * is(b, e) + is(a, e) * is(b, c));
        }
    }
    prior
}
