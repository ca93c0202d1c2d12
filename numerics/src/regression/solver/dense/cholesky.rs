//! Cholesky factorization in place, in half the memory of the matrix.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par};

use super::packed::PackedMatrix;
use super::substitution::{solve_backward, solve_forward};
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::pages::SpareBuffer;
use crate::machine::parallelism::parallelism;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::regularization::Regularization;

/// Largest diagonal block that goes to faer's own Cholesky. Above this size the recursion spends its time in
/// matrix products.
///
/// Measured by `cargo bench --bench factor` at n = 4,000: the recursion reaches 85 % of the matrix-product
/// rate with 256, and 84 % with 512. faer's blocked factorization of the whole reaches 75–78 %.
const LEAF_SIZE: usize = 256;

/// Flops of a matrix product between two checks for cancellation: half a second on two cores.
const FLOPS_PER_CHECKPOINT: f64 = 3e10;

/// Least number of rows or columns of such a product. With fewer it is slower.
const LEAST_PIECE: usize = 128;

/// The matrix `K + αI`, and after [`Cholesky::factorize`] its factor L.
pub(in crate::regression::solver) struct Cholesky {
    packed: PackedMatrix,
}

impl Cholesky {
    /// Returns how many numbers n points take. `None` if the count overflows.
    pub(in crate::regression::solver) fn n_numbers_needed(n: usize) -> Option<usize> {
        PackedMatrix::n_numbers(n)
    }

    /// Assembles `K + αI` without factorizing it.
    ///
    /// # Errors
    /// [`NumericsError::OutOfMemory`], [`NumericsError::Cancelled`].
    pub(in crate::regression::solver) fn assemble(
        spare: &Arc<SpareBuffer>,
        cloud: &Cloud,
        kernel: &Kernel,
        regularization: &Regularization,
        observer: &dyn Observer,
    ) -> Result<Self> {
        Ok(Self { packed: PackedMatrix::gram(spare, cloud, kernel, regularization, observer)? })
    }

    /// Allocates memory for the factor of n points, to be filled with it.
    ///
    /// # Errors
    /// [`NumericsError::OutOfMemory`].
    pub(in crate::regression::solver) fn blank(spare: &Arc<SpareBuffer>, n: usize) -> Result<Self> {
        Ok(Self { packed: PackedMatrix::blank(spare, n)? })
    }

    /// Returns all numbers in the order of memory.
    pub(in crate::regression::solver) fn numbers(&self) -> &[f64] {
        self.packed.numbers()
    }

    pub(in crate::regression::solver) fn numbers_mut(&mut self) -> &mut [f64] {
        self.packed.numbers_mut()
    }

    pub(in crate::regression::solver) fn n_points(&self) -> usize {
        self.packed.n_points()
    }

    pub(in crate::regression::solver) fn n_bytes(&self) -> usize {
        self.packed.n_bytes()
    }

    /// Returns `‖A‖₁` of A before it is factorized.
    pub(in crate::regression::solver) fn norm1(&self) -> f64 {
        self.packed.norm1()
    }

    /// Factorizes `A = LLᵀ` in place. The inner error is the index of the first point whose pivot is not
    /// above `floor`.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(in crate::regression::solver) fn factorize(
        mut self,
        floor: f64,
        observer: &dyn Observer,
    ) -> Result<Result<Self, usize>> {
        match factorize_packed(&mut self.packed, floor, observer) {
            Ok(()) => Ok(Ok(self)),
            Err(Stop::NotPositive(point)) => {
                // The fallback needs more memory than this buffer has.
                self.packed.discard();
                Ok(Err(point))
            }
            Err(Stop::Cancelled(error)) => Err(error),
        }
    }

    /// `rhs ← (LLᵀ)⁻¹ rhs`.
    pub(in crate::regression::solver) fn solve_in_place(&self, mut rhs: MatMut<'_, f64>) {
        self.whiten_in_place(rhs.rb_mut());
        if let Some(x) = only_column(rhs.rb_mut()) {
            return solve_backward(&self.packed, x);
        }
        let par = self.parallelism(rhs.ncols());
        let (l11, l21, l22) = self.parts();
        let (mut first, mut second) = rhs.split_at_row_mut(l11.nrows());
        solve_upper_triangular_in_place(l22.transpose(), second.rb_mut(), par);
        matmul(first.rb_mut(), Accum::Add, l21.transpose(), second.rb(), -1.0, par);
        solve_upper_triangular_in_place(l11.transpose(), first, par);
    }

    /// `rhs ← L⁻¹ rhs`.
    pub(in crate::regression::solver) fn whiten_in_place(&self, mut rhs: MatMut<'_, f64>) {
        if let Some(x) = only_column(rhs.rb_mut()) {
            return solve_forward(&self.packed, x);
        }
        let par = self.parallelism(rhs.ncols());
        self.whiten_with(rhs, par);
    }

    /// Computes `rhs ← L⁻¹ rhs` with a given parallelism.
    pub(in crate::regression::solver) fn whiten_with(&self, rhs: MatMut<'_, f64>, par: Par) {
        let (l11, l21, l22) = self.parts();
        let (mut first, mut second) = rhs.split_at_row_mut(l11.nrows());
        solve_lower_triangular_in_place(l11, first.rb_mut(), par);
        matmul(second.rb_mut(), Accum::Add, l21, first.rb(), -1.0, par);
        solve_lower_triangular_in_place(l22, second, par);
    }

    /// `ln det A = 2 Σ ln L_ii`.
    pub(in crate::regression::solver) fn log_determinant(&self) -> f64 {
        self.packed.diagonal().map(|pivot| 2.0 * pivot.ln()).sum()
    }

    /// Returns L₁₁, L₂₁ and L₂₂ of `L = [L₁₁ 0; L₂₁ L₂₂]`. Entries above the diagonals are not zero.
    fn parts(&self) -> (MatRef<'_, f64>, MatRef<'_, f64>, MatRef<'_, f64>) {
        let first = self.packed.first();
        let (l11, l21) = first.split_at_row(first.ncols());
        (l11, l21, self.packed.second_transposed().transpose())
    }

    fn parallelism(&self, n_columns: usize) -> Par {
        parallelism((self.packed.n_points() * self.packed.n_points() * n_columns) as f64)
    }
}

/// Returns the column of a matrix that has only one.
fn only_column(rhs: MatMut<'_, f64>) -> Option<&mut [f64]> {
    if rhs.ncols() != 1 {
        return None;
    }
    rhs.col_mut(0).try_as_col_major_mut().map(faer::ColMut::as_slice_mut)
}

enum Stop {
    NotPositive(usize),
    Cancelled(NumericsError),
}

/// Factorizes the first triangle, solves for the square below it, updates the second triangle, and factorizes
/// that.
fn factorize_packed(a: &mut PackedMatrix, floor: f64, observer: &dyn Observer) -> Result<(), Stop> {
    let mut leaf = Leaf::new(a.n_points());
    let mut parts = a.parts_mut();
    let n_first = parts.first().nrows();
    recurse(parts.first(), 0, floor, &mut leaf, observer)?;
    let (first, square) = parts.first_and_square();
    solve_below(first, square, observer)?;
    let (second, square) = parts.second_and_square();
    update(second, square, observer)?;
    recurse(parts.second(), n_first, floor, &mut leaf, observer)
}

/// Overwrites the lower triangle of A with that of L, `A = LLᵀ`. Entries above the diagonal do not matter.
/// The inner error is the first index whose pivot `L_ii²` is not above `floor`.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(crate) fn factorize_in_place(
    a: MatMut<'_, f64>,
    floor: f64,
    observer: &dyn Observer,
) -> Result<Result<(), usize>> {
    let mut leaf = Leaf::new(a.nrows());
    match recurse(a, 0, floor, &mut leaf, observer) {
        Ok(()) => Ok(Ok(())),
        Err(Stop::NotPositive(point)) => Ok(Err(point)),
        Err(Stop::Cancelled(error)) => Err(error),
    }
}

/// Factorizes the leading half, solves for the block below it, updates the trailing half, and continues
/// there.
///
/// This is recursive Cholesky (Gustavson 1997). Every level works on matrices that are as large as possible,
/// so almost all flops are in matrix products. `first` is the index of the first point of this block.
fn recurse(
    mut a: MatMut<'_, f64>,
    first: usize,
    floor: f64,
    leaf: &mut Leaf,
    observer: &dyn Observer,
) -> Result<(), Stop> {
    observer.checkpoint().map_err(|end| Stop::Cancelled(end.into()))?;
    let n = a.nrows();
    if n <= LEAF_SIZE {
        return leaf.factorize(a, floor).map_err(|index| Stop::NotPositive(first + index));
    }
    let half = (n / 2).next_multiple_of(64).min(n - 1);
    let (mut leading, _, mut below, mut trailing) = a.rb_mut().split_at_mut(half, half);
    recurse(leading.rb_mut(), first, floor, leaf, observer)?;
    solve_below(leading.rb(), below.rb_mut(), observer)?;
    update(trailing.rb_mut(), below.rb(), observer)?;
    recurse(trailing, first + half, floor, leaf, observer)
}

/// `below ← below·L⁻ᵀ`.
fn solve_below(l: MatRef<'_, f64>, mut below: MatMut<'_, f64>, observer: &dyn Observer) -> Result<(), Stop> {
    let flops_per_row = (l.nrows() * l.nrows()) as f64;
    for (first, n_rows) in pieces(below.nrows(), flops_per_row) {
        observer.checkpoint().map_err(|end| Stop::Cancelled(end.into()))?;
        let rows = below.rb_mut().subrows_mut(first, n_rows);
        let par = parallelism(flops_per_row * n_rows as f64);
        solve_lower_triangular_in_place(l, rows.transpose_mut(), par);
    }
    Ok(())
}

/// Splits n rows or columns into parts of at most [`FLOPS_PER_CHECKPOINT`], but not below [`LEAST_PIECE`].
/// Yields the first index and the length of each.
pub(in crate::regression::solver) fn pieces(
    n: usize,
    flops_each: f64,
) -> impl Iterator<Item = (usize, usize)> {
    let most = ((FLOPS_PER_CHECKPOINT / flops_each) as usize).max(LEAST_PIECE);
    let length = n.div_ceil(n.div_ceil(most).max(1)).max(1);
    (0..n).step_by(length).map(move |first| (first, length.min(n - first)))
}

/// `trailing ← trailing − below·belowᵀ`, lower triangle.
fn update(
    mut trailing: MatMut<'_, f64>,
    below: MatRef<'_, f64>,
    observer: &dyn Observer,
) -> Result<(), Stop> {
    let (n, k) = (below.nrows(), below.ncols());
    for (first, width) in pieces(n, (n * k) as f64) {
        observer.checkpoint().map_err(|end| Stop::Cancelled(end.into()))?;
        let (diagonal, rest) = (below.subrows(first, width), first + width);
        let par = parallelism((width * (n - first) * k) as f64);
        triangular::matmul(
            trailing.rb_mut().submatrix_mut(first, first, width, width),
            BlockStructure::TriangularLower,
            Accum::Add,
            diagonal,
            BlockStructure::Rectangular,
            diagonal.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            par,
        );
        let under = trailing.rb_mut().submatrix_mut(rest, first, n - rest, width);
        matmul(under, Accum::Add, below.subrows(rest, n - rest), diagonal.transpose(), -1.0, par);
    }
    Ok(())
}

/// A buffer in which small diagonal blocks are factorized. It is column-major, whichever way the block lies.
/// Entries above the diagonal of the block, which may belong to other data, stay as they are.
struct Leaf {
    block: Mat<f64>,
    scratch: MemBuffer,
}

impl Leaf {
    fn new(n: usize) -> Self {
        let size = n.min(LEAF_SIZE);
        let par = parallelism(f64::INFINITY);
        let requirement = llt::factor::cholesky_in_place_scratch::<f64>(size, par, Default::default());
        Self { block: Mat::zeros(size, size), scratch: MemBuffer::new(requirement) }
    }

    /// Factorizes a block. The error is the first index whose pivot is not above `floor`.
    fn factorize(&mut self, mut a: MatMut<'_, f64>, floor: f64) -> Result<(), usize> {
        let n = a.nrows();
        let mut block = self.block.as_mut().submatrix_mut(0, 0, n, n);
        block.copy_from_triangular_lower(a.rb());
        let outcome = llt::factor::cholesky_in_place(
            block.rb_mut(),
            Default::default(),
            parallelism((n as f64).powi(3) / 3.0),
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
        if let Err(llt::factor::LltError::NonPositivePivot { index }) = outcome {
            return Err(index);
        }
        if let Some(index) = (0..n).find(|&i| block[(i, i)] * block[(i, i)] <= floor) {
            return Err(index);
        }
        a.copy_from_triangular_lower(block.rb());
        Ok(())
    }
}
