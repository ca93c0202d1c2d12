//! A system with its factorization, whichever it is.

use std::borrow::Cow;
use std::sync::Arc;

use faer::MatMut;

use super::condition::estimate_norm1;
use super::dense::{Cholesky, PivotedCholesky};
use super::iterative::Iterative;
use super::landmark::Landmarks;
use super::system::System;
use crate::error::Result;
use crate::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::machine::pages::SpareBuffer;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;

/// Method by which `K + αI` was factorized.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// `K + αI = LLᵀ`, in place.
    Cholesky,
    /// Rank-revealing pivoted Cholesky and least squares on the pivots, for matrices on which Cholesky fails
    /// in float64.
    PivotedCholesky,
    /// Normal equations on landmarks.
    Landmark,
    /// Conjugate gradients with a sparse factor of the inverse.
    ConjugateGradients,
}

/// Source of the memory of a factorization.
pub struct Workspace<'a> {
    /// Memory of an earlier factorization, if one was given back. The new factorization gives its own back
    /// when it is dropped.
    pub spare: &'a Arc<SpareBuffer>,
    /// Permission to take more than half of the matrix. The argument is the number of bytes that the
    /// factorization then takes in all.
    pub may_take: &'a mut dyn FnMut(usize) -> bool,
}

/// Multiple of k₀ up to which a Cholesky pivot counts as rounding. Such a pivot is positive by luck, and the
/// weights behind it are noise that the residual hardly shows.
///
/// The limit is below `minimum_alpha`, which is at least 16 ε k₀ and enters a pivot twice where two points
/// coincide.
pub(crate) const SMALLEST_PIVOT: f64 = 16.0 * f64::EPSILON;

/// A system prepared for solving: a factorization of the whole matrix `K(X, X) + αI`, or landmarks.
///
/// It keeps the system, so that it cannot be used with another one.
pub struct Solver {
    pub(super) system: System,
    pub(super) factorization: Factorization,
    pub(super) norm1: f64,
    pub(super) reciprocal_condition: Option<f64>,
    /// Weights of the constant 1, `[n]`. Empty unless the whole matrix is factorized.
    pub(super) weights_of_one: Vec<f64>,
}

pub(super) enum Factorization {
    Cholesky(Cholesky),
    PivotedCholesky { factor: PivotedCholesky, failed_at: usize, pivots: Arc<Cloud> },
    Landmark(Box<Landmarks>),
    Iterative(Box<Iterative>),
}

impl Solver {
    /// Returns how many numbers Cholesky needs at its peak: half of the matrix. `None` if that overflows.
    pub(super) fn n_numbers_needed(n_points: usize) -> Option<usize> {
        Cholesky::n_numbers_needed(n_points)
    }

    /// Returns how many numbers are needed at most. The fallback needs all of the matrix if its rank is above
    /// n/4. By then Cholesky has failed and given its own back. `None` if the count overflows.
    pub(super) fn n_numbers_needed_at_most(n_points: usize) -> Option<usize> {
        Some(PivotedCholesky::n_numbers_needed(n_points)?.max(Self::n_numbers_needed(n_points)?))
    }

    /// Assembles and factorizes `K(X, X) + αI` exactly as given: no jitter is ever added.
    ///
    /// Cholesky works in place. If a pivot is rounding, the fallback is pivoted Cholesky to 64 ε k₀ and least
    /// squares on the pivots.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::OutOfMemory`], also if it needs more than it may take.
    /// [`crate::error::NumericsError::Cancelled`].
    pub fn dense_in(workspace: Workspace<'_>, system: System, observer: &dyn Observer) -> Result<Self> {
        let (cloud, kernel, regularization) = (system.cloud(), system.kernel(), system.regularization());
        observer.enter(Stage::Gram);
        let gram = Cholesky::assemble(workspace.spare, cloud, kernel, regularization, observer)?;
        let norm1 = gram.norm1();
        observer.enter(Stage::Factor);
        let factorization = match gram.factorize(SMALLEST_PIVOT * kernel.at_zero(), observer)? {
            Ok(factor) => Factorization::Cholesky(factor),
            Err(failed_at) => {
                let n_numbers = Self::n_numbers_needed_at_most(cloud.n_points()).unwrap_or(usize::MAX);
                let may_take_all = || (workspace.may_take)(n_numbers.saturating_mul(size_of::<f64>()));
                let factor =
                    PivotedCholesky::factorize(cloud, kernel, regularization, may_take_all, observer)?;
                let pivots = Arc::new(cloud.select(factor.pivots()));
                Factorization::PivotedCholesky { factor, failed_at, pivots }
            }
        };
        observer.enter(Stage::Condition);
        let (inverse_norm1, weights_of_one) = estimate_norm1(
            cloud.n_points(),
            |x| factorization.solve_in_place(x, observer),
            |x| factorization.solve_transposed_in_place(x, observer),
        )?;
        let product = norm1 * inverse_norm1;
        let reciprocal_condition = Some(if product.is_finite() { 1.0 / product.max(1.0) } else { 0.0 });
        Ok(Self { system, factorization, norm1, reciprocal_condition, weights_of_one })
    }

    /// Solves on landmarks: few points, whose kernels span those of all others up to a millionth of the
    /// noise.
    ///
    /// It takes 3 n r² flops and O(r² + n) memory for r landmarks, and passes of 2 n r² flops for values.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::RankTooLarge`] if the kernel needs too many.
    /// [`crate::error::NumericsError::WeightsOverflow`],
    /// [`crate::error::NumericsError::Cancelled`].
    pub fn landmark(system: System, observer: &dyn Observer) -> Result<Self> {
        let landmarks = Landmarks::of(&system, observer)?;
        observer.enter(Stage::Condition);
        let norm1 = system.largest_row_seen(observer)?;
        let condition = norm1 * landmarks.inverse_norm1();
        let reciprocal_condition = Some(if condition.is_finite() { 1.0 / condition.max(1.0) } else { 0.0 });
        let factorization = Factorization::Landmark(Box::new(landmarks));
        Ok(Self { system, factorization, norm1, reciprocal_condition, weights_of_one: Vec::new() })
    }

    /// Prepares conjugate gradients, which solve for values until the relative residual is at most
    /// `tolerance`.
    ///
    /// It takes 512 n bytes. Values take about ten passes over all pairs of points.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub fn iterative_to(tolerance: f64, system: System, observer: &dyn Observer) -> Result<Self> {
        let iterative = Iterative::of(&system, tolerance, observer)?;
        let norm1 = system.largest_row_seen(observer)?;
        let factorization = Factorization::Iterative(Box::new(iterative));
        Ok(Self { system, factorization, norm1, reciprocal_condition: None, weights_of_one: Vec::new() })
    }

    /// Returns the solver with another tolerance, which takes no work. `None` unless it iterates.
    pub fn with_tolerance(&self, tolerance: f64) -> Option<Self> {
        let iterative = self.iterative()?.with_tolerance(tolerance);
        let factorization = Factorization::Iterative(Box::new(iterative));
        let (system, norm1) = (self.system.clone(), self.norm1);
        Some(Self { system, factorization, norm1, reciprocal_condition: None, weights_of_one: Vec::new() })
    }

    pub fn system(&self) -> &System {
        &self.system
    }

    /// Method by which the matrix was factorized.
    pub fn method(&self) -> Method {
        match self.factorization {
            Factorization::Cholesky(_) => Method::Cholesky,
            Factorization::PivotedCholesky { .. } => Method::PivotedCholesky,
            Factorization::Landmark(_) => Method::Landmark,
            Factorization::Iterative(_) => Method::ConjugateGradients,
        }
    }

    /// Numerical rank: n, or the number of pivots of the fallback, or of landmarks.
    pub fn rank(&self) -> usize {
        match &self.factorization {
            Factorization::Cholesky(_) | Factorization::Iterative(_) => self.system.n_points(),
            Factorization::PivotedCholesky { factor, .. } => factor.pivots().len(),
            Factorization::Landmark(landmarks) => landmarks.rank(),
        }
    }

    /// `1/(‖K + αI‖₁ ‖W‖₁)` where W maps values to weights, estimated (Higham 2002, alg. 15.1). For
    /// landmarks, that of their normal equations. `None` for conjugate gradients, which have no W.
    pub fn reciprocal_condition(&self) -> Option<f64> {
        self.reciprocal_condition
    }

    /// `W·1`, `[n]`: the weights of the signature function. Only factorizations of the whole matrix keep
    /// them.
    ///
    /// # Errors
    /// Returns the errors of [`Solver::solve_in_place`].
    pub(super) fn weights_of_one(&self, observer: &dyn Observer) -> Result<Cow<'_, [f64]>> {
        if !self.weights_of_one.is_empty() {
            return Ok(Cow::Borrowed(&self.weights_of_one));
        }
        let n = self.system.n_points();
        let mut weights = vec![1.0; n];
        self.solve_in_place(MatMut::from_column_major_slice_mut(&mut weights, n, 1), observer)?;
        Ok(Cow::Owned(weights))
    }

    /// `‖K + αI‖₁`; without its factor, the largest of some columns.
    pub(crate) fn norm1(&self) -> f64 {
        self.norm1
    }

    /// Returns the points with weights, and their indices in X if these are not all points.
    pub(super) fn centres(&self) -> (&Cloud, Option<&[usize]>) {
        match &self.factorization {
            Factorization::Cholesky(_) | Factorization::Iterative(_) => (self.system.cloud(), None),
            Factorization::PivotedCholesky { factor, pivots, .. } => (pivots, Some(factor.pivots())),
            Factorization::Landmark(landmarks) => (landmarks.cloud(), Some(landmarks.points())),
        }
    }

    /// Bytes held on the heap, including those of the cloud.
    pub fn n_bytes(&self) -> usize {
        let factor = match &self.factorization {
            Factorization::Cholesky(factor) => factor.n_bytes(),
            Factorization::PivotedCholesky { factor, pivots, .. } => {
                factor.n_bytes() + block_bytes(arc_payload::<Cloud>()) + pivots.n_bytes()
            }
            Factorization::Landmark(landmarks) => landmarks.n_bytes(),
            Factorization::Iterative(iterative) => iterative.n_bytes(),
        };
        factor + vec_bytes(&self.weights_of_one) + self.system.n_bytes()
    }

    /// Overwrites the columns of `[n, k]` values by weights at all points, `Λ = W Y`.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(crate) fn solve_in_place(&self, values: MatMut<'_, f64>, observer: &dyn Observer) -> Result<()> {
        self.factorization.solve_in_place(values, observer)
    }

    /// Overwrites the columns of `[n, k]` by `Wᵀ` times them.
    ///
    /// This turns functionals of the weights into functionals of the values, so that operators become
    /// matrices.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(crate) fn solve_transposed_in_place(
        &self,
        functionals: MatMut<'_, f64>,
        observer: &dyn Observer,
    ) -> Result<()> {
        self.factorization.solve_transposed_in_place(functionals, observer)
    }

    /// The landmarks, if the system is solved on them.
    pub(super) fn landmarks(&self) -> Option<&Landmarks> {
        match &self.factorization {
            Factorization::Landmark(landmarks) => Some(landmarks),
            Factorization::Cholesky(_)
            | Factorization::PivotedCholesky { .. }
            | Factorization::Iterative(_) => None,
        }
    }

    /// The conjugate gradients, if the system is solved by them.
    pub(super) fn iterative(&self) -> Option<&Iterative> {
        match &self.factorization {
            Factorization::Iterative(iterative) => Some(iterative),
            Factorization::Cholesky(_)
            | Factorization::PivotedCholesky { .. }
            | Factorization::Landmark(_) => None,
        }
    }

    /// Largest relative residual of an answer by conjugate gradients.
    pub fn tolerance(&self) -> Option<f64> {
        self.iterative().map(Iterative::tolerance)
    }

    /// What remains of the diagonal beside landmarks, and what was to remain at most, V².
    pub fn remaining_diagonal(&self) -> Option<Remaining> {
        let of = |landmarks: &Landmarks| Remaining {
            largest: landmarks.remaining(),
            tolerance: landmarks.tolerance(),
        };
        self.landmarks().map(of)
    }
}

/// What landmarks leave of the diagonal of the kernel's matrix, V².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remaining {
    /// Largest entry over all points.
    pub largest: f64,
    /// What was to remain at most.
    pub tolerance: f64,
}

impl Factorization {
    fn solve_in_place(&self, values: MatMut<'_, f64>, observer: &dyn Observer) -> Result<()> {
        match self {
            Self::Cholesky(factor) => factor.solve_in_place(values),
            Self::PivotedCholesky { factor, .. } => factor.solve_in_place(values),
            Self::Landmark(landmarks) => landmarks.solve_in_place(values, observer)?,
            Self::Iterative(iterative) => iterative.solve_in_place(values, observer)?,
        }
        Ok(())
    }

    fn solve_transposed_in_place(&self, functionals: MatMut<'_, f64>, observer: &dyn Observer) -> Result<()> {
        match self {
            Self::Cholesky(factor) => factor.solve_in_place(functionals),
            Self::PivotedCholesky { factor, .. } => factor.solve_transposed_in_place(functionals),
            Self::Landmark(landmarks) => landmarks.solve_transposed_in_place(functionals, observer)?,
            Self::Iterative(iterative) => iterative.solve_in_place(functionals, observer)?,
        }
        Ok(())
    }
}
