//! Cholesky factorization in place: one n×n buffer, one triangle of it used.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef};
use rayon::prelude::*;

use super::parallelism;
use crate::numerics::error::NumericsError;
use crate::numerics::heap::vec_bytes;
use crate::numerics::observer::Observer;

/// Diagonal blocks of this size go to faer's own Cholesky; above it the recursion spends its time in matrix products.
///
/// `cargo bench --bench factor`: 512 reaches 93 % of the matrix-product rate at n = 4,000, 128 reaches 84–91 %, and faer's
/// blocked factorization of the whole 75–78 %.
const LEAF_SIZE: usize = 512;

/// A lower triangle, column by column, of `K + αI` first and of its factor L after [`Cholesky::factorize`].
pub(super) struct Cholesky {
    buffer: Vec<f64>,
    n: usize,
    stride: usize,
}

impl Cholesky {
    /// Distance between columns: full cache lines, and not a multiple of 4 KiB, where all columns would compete for the
    /// same cache sets.
    pub(super) fn stride_for(n: usize) -> usize {
        let stride = n.next_multiple_of(8);
        if stride.is_multiple_of(512) { stride + 8 } else { stride }
    }

    /// A buffer of zeros; its pages are mapped as they are written, so that with small pages the upper triangle costs nothing.
    pub(super) fn allocate(n: usize) -> Self {
        let stride = Self::stride_for(n);
        Self { buffer: vec![0.0; n * stride], n, stride }
    }

    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    pub(super) fn buffer_mut(&mut self) -> &mut [f64] {
        &mut self.buffer
    }

    pub(super) fn n_bytes(&self) -> usize {
        vec_bytes(&self.buffer)
    }

    fn lower(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice_with_stride(&self.buffer, self.n, self.n, self.stride)
    }

    /// `‖A‖₁` of the symmetric matrix whose lower triangle is stored, before it is factorized.
    pub(super) fn norm1(&self) -> f64 {
        let n = self.n;
        let sums = self
            .buffer
            .par_chunks(self.stride)
            .enumerate()
            .fold(
                || vec![0.0; n],
                |mut sums, (j, column)| {
                    let mut below = column[j].abs();
                    for i in j + 1..n {
                        below += column[i].abs();
                        sums[i] += column[i].abs();
                    }
                    sums[j] += below;
                    sums
                },
            )
            .reduce(|| vec![0.0; n], |a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect());
        sums.into_iter().fold(0.0, f64::max)
    }

    /// `A = LLᵀ` in place. The inner error is the index of the first point whose pivot is not above `floor`.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn factorize(
        mut self,
        floor: f64,
        observer: &dyn Observer,
    ) -> Result<Result<Self, usize>, NumericsError> {
        let a =
            MatMut::from_column_major_slice_with_stride_mut(&mut self.buffer, self.n, self.n, self.stride);
        Ok(factorize_in_place(a, floor, observer)?.map(|()| self))
    }

    /// `rhs ← (LLᵀ)⁻¹ rhs`.
    pub(super) fn solve_in_place(&self, mut rhs: MatMut<'_, f64>) {
        let par = parallelism((self.n * self.n * rhs.ncols()) as f64);
        solve_lower_triangular_in_place(self.lower(), rhs.rb_mut(), par);
        solve_upper_triangular_in_place(self.lower().transpose(), rhs, par);
    }

    /// `rhs ← L⁻¹ rhs`.
    pub(super) fn whiten_in_place(&self, rhs: MatMut<'_, f64>) {
        let par = parallelism((self.n * self.n * rhs.ncols()) as f64);
        solve_lower_triangular_in_place(self.lower(), rhs, par);
    }

    /// `ln det A = 2 Σ ln L_ii`.
    pub(super) fn log_determinant(&self) -> f64 {
        (0..self.n).map(|i| 2.0 * self.buffer[i * self.stride + i].ln()).sum()
    }
}

/// Overwrites the lower triangle of A by that of L, `A = LLᵀ`. The inner error is the first index whose pivot `L_ii²` is not
/// above `floor`.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(super) fn factorize_in_place(
    a: MatMut<'_, f64>,
    floor: f64,
    observer: &dyn Observer,
) -> Result<Result<(), usize>, NumericsError> {
    let requirement = llt::factor::cholesky_in_place_scratch::<f64>(
        a.nrows().min(LEAF_SIZE),
        parallelism(f64::INFINITY),
        Default::default(),
    );
    let mut scratch = MemBuffer::new(requirement);
    match recurse(a, 0, floor, MemStack::new(&mut scratch), observer) {
        Ok(()) => Ok(Ok(())),
        Err(Stop::NotPositive(point)) => Ok(Err(point)),
        Err(Stop::Cancelled(error)) => Err(error),
    }
}

enum Stop {
    NotPositive(usize),
    Cancelled(NumericsError),
}

/// Factorizes the leading half, solves for the block below it, updates the trailing half, and goes on there.
///
/// Recursive Cholesky (Gustavson 1997): every level works on matrices as large as they can be, so almost all flops are in
/// matrix products. `first` is the index of the first point of this block.
fn recurse(
    mut a: MatMut<'_, f64>,
    first: usize,
    floor: f64,
    scratch: &mut MemStack,
    observer: &dyn Observer,
) -> Result<(), Stop> {
    observer.checkpoint().map_err(Stop::Cancelled)?;
    let n = a.nrows();
    let flops = (n as f64).powi(3) / 3.0;
    if n <= LEAF_SIZE {
        let outcome = llt::factor::cholesky_in_place(
            a.rb_mut(),
            Default::default(),
            parallelism(flops),
            scratch,
            Default::default(),
        );
        return match outcome {
            Ok(_) => match (0..n).find(|&i| a[(i, i)] * a[(i, i)] <= floor) {
                None => Ok(()),
                Some(index) => Err(Stop::NotPositive(first + index)),
            },
            Err(llt::factor::LltError::NonPositivePivot { index }) => Err(Stop::NotPositive(first + index)),
        };
    }
    let half = (n / 2).next_multiple_of(64).min(n - 1);
    let (mut leading, _, mut below, mut trailing) = a.rb_mut().split_at_mut(half, half);
    recurse(leading.rb_mut(), first, floor, scratch, observer)?;
    let par = parallelism(flops);
    solve_lower_triangular_in_place(leading.rb(), below.rb_mut().transpose_mut(), par);
    observer.checkpoint().map_err(Stop::Cancelled)?;
    triangular::matmul(
        trailing.rb_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        below.rb(),
        BlockStructure::Rectangular,
        below.rb().transpose(),
        BlockStructure::Rectangular,
        -1.0,
        par,
    );
    recurse(trailing, first + half, floor, scratch, observer)
}
