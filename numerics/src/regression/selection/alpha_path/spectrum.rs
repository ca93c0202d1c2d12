//! Eigenvalues and eigenvectors of a Gram matrix, or of its restriction to the complement of a mean.

use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{MatMut, MatRef};
use rayon::prelude::*;

use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::parallelism::parallelism;
use crate::machine::vector::dot;
use crate::observer::{Observer, Stage};
use crate::regression::selection::subject::Subject;
use crate::regression::solver::trend::remove_mean;
use crate::regression::sums::gram::{fill_lower_gram, mirror};
use crate::regression::sums::regularization::Regularization;

/// Least `D_i + α` that is significant, as a multiple of the greatest eigenvalue. Eigenvalues have about this
/// error.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Eigenvalues and eigenvectors of K, or of K on the orthogonal complement of the mean's functions.
pub(super) struct Spectrum {
    /// D, ascending, `[r]`.
    pub(super) eigenvalues: Vec<f64>,
    /// U, `[n, r]` column by column.
    pub(super) vectors: Vec<f64>,
    /// `UᵀY`, `[r]`.
    pub(super) values: Vec<f64>,
    pub(super) n: usize,
}

impl Spectrum {
    /// Decomposes the Gram matrix of a kernel, without the functions of the mean if `is_restricted`.
    ///
    /// # Errors
    /// [`NumericsError::OutOfMemory`], [`NumericsError::Cancelled`].
    pub(super) fn of(
        subject: &Subject<'_>,
        kernel: &Kernel,
        is_restricted: bool,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (cloud, n) = (subject.cloud, subject.n_points());
        let mut gram = vec![0.0; n * n];
        observer.enter(Stage::Gram);
        fill_lower_gram(cloud, kernel, &Regularization::Uniform(0.0), &mut gram, n, observer)?;
        let n_removed = if is_restricted { subject.n_functions } else { 0 };
        if is_restricted {
            mirror(&mut gram, n);
            set_apart(&mut gram, subject);
        }
        observer.enter(Stage::Factor);
        let (mut eigenvalues, mut vectors) = decompose(&gram, n)?;
        observer.checkpoint()?;
        // The functions that were set apart belong to the least eigenvalues.
        eigenvalues.drain(..n_removed);
        vectors.drain(..n_removed * n);
        let values = vectors.par_chunks_exact(n).map(|u| dot(u, &subject.values)).collect();
        Ok(Self { eigenvalues, vectors, values, n })
    }

    /// U as a matrix.
    pub(super) fn vectors(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.vectors, self.n, self.eigenvalues.len())
    }

    /// Returns `1/(D + α)`, `[r]`, or `None` if the least `D + α` is rounding.
    pub(super) fn inverse(&self, alpha: f64) -> Option<Vec<f64>> {
        let (least, greatest) = (self.eigenvalues.first()?, self.eigenvalues.last()?);
        let is_definite = least + alpha > ROUNDING * greatest;
        is_definite.then(|| self.eigenvalues.iter().map(|d| 1.0 / (d + alpha)).collect())
    }
}

/// Returns the eigenvalues, ascending, and the eigenvectors, as columns, of a symmetric matrix. Only its
/// lower triangle is read.
///
/// # Errors
/// [`NumericsError::OutOfMemory`].
fn decompose(matrix: &[f64], n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    let (mut eigenvalues, mut vectors) = (vec![0.0; n], vec![0.0; n * n]);
    let par = parallelism((n as f64).powi(3));
    let requirement = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, par, Default::default());
    let n_bytes = requirement.unaligned_bytes_required();
    let mut scratch = MemBuffer::try_new(requirement).map_err(|_| NumericsError::OutOfMemory { n_bytes })?;
    let made = self_adjoint_evd(
        MatRef::from_column_major_slice(matrix, n, n),
        DiagMut::from_slice_mut(&mut eigenvalues),
        Some(MatMut::from_column_major_slice_mut(&mut vectors, n, n)),
        par,
        MemStack::new(&mut scratch),
        Default::default(),
    );
    if made.is_err() {
        // The algorithm does not converge if entries are not finite. With NaN, no α makes the matrix
        // definite.
        eigenvalues.fill(f64::NAN);
    }
    Ok((eigenvalues, vectors))
}

/// Sets the functions of the mean apart: `K ← (I − F̂F̂ᵀ)K(I − F̂F̂ᵀ) − sF̂F̂ᵀ`.
///
/// F̂ is an orthonormal basis of the functions and s the trace of K, about its norm. The functions become the
/// eigenvectors of the least eigenvalues, well apart from all others, which are positive.
fn set_apart(gram: &mut [f64], subject: &Subject<'_>) {
    let (n, p) = (subject.n_points(), subject.n_functions);
    let mut basis = subject.functions.clone();
    // There is no column of values to reduce. `Subject::of` has checked that the functions are independent.
    let _ = remove_mean(&mut basis, n, p);
    let trace: f64 = (0..n).map(|i| gram[i * n + i]).sum();
    for f in basis.chunks_exact(n) {
        // K ← K − f(Kf)ᵀ − (Kf)fᵀ + (fᵀKf)ffᵀ for one function after another, since they are orthogonal.
        let image: Vec<f64> = gram.par_chunks_exact(n).map(|column| dot(column, f)).collect();
        let along = dot(f, &image);
        gram.par_chunks_exact_mut(n).enumerate().for_each(|(j, column)| {
            for (i, entry) in column.iter_mut().enumerate() {
                *entry += along * f[i] * f[j] - f[i] * image[j] - image[i] * f[j];
            }
        });
    }
    gram.par_chunks_exact_mut(n).enumerate().for_each(|(j, column)| {
        for f in basis.chunks_exact(n) {
            column.iter_mut().zip(f).for_each(|(entry, fi)| *entry -= trace * fi * f[j]);
        }
    });
}
