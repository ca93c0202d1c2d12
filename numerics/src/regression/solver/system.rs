//! The system `K(X, X) + αI` before it is solved.

use std::sync::Arc;

use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::coinciding_points;
use crate::regression::sums::expansion::Expansion;
use crate::regression::sums::many::values_of_each;
use crate::regression::sums::regularization::Regularization;
use crate::regression::sums::symmetric::kernel_times;

/// Columns of which [`System::largest_row_seen`] is the largest.
const ROWS_SEEN: usize = 64;

/// Columns up to which products with each by itself, for which each pair of points is evaluated once, are
/// faster than products with all.
pub(super) const FEW: usize = 2;

/// The linear system of a fit, `(K(X, X) + αI) Λ = Y` for any values Y. Its constructor checks that a
/// solution can exist.
#[derive(Clone)]
pub struct System {
    cloud: Arc<Cloud>,
    kernel: Kernel,
    regularization: Regularization,
}

impl System {
    /// Creates the system of a kernel on a cloud.
    ///
    /// # Errors
    /// [`NumericsError::KernelNotPositiveDefinite`] in this dimension. [`NumericsError::LengthMismatch`] of
    /// noise variances. [`NumericsError::DuplicatePoints`] if two coinciding points have no regularization.
    pub fn new(cloud: Arc<Cloud>, kernel: Kernel, regularization: Regularization) -> Result<Self> {
        kernel.check_dimension(cloud.dimension())?;
        regularization.check_matches(&cloud)?;
        let twins = coinciding_points(&cloud, |point| regularization.at(point) == 0.0);
        if !twins.is_empty() {
            return Err(NumericsError::DuplicatePoints { points: twins });
        }
        Ok(Self { cloud, kernel, regularization })
    }

    /// Returns the points X.
    pub fn cloud(&self) -> &Arc<Cloud> {
        &self.cloud
    }

    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Returns the regularization α.
    pub fn regularization(&self) -> &Regularization {
        &self.regularization
    }

    /// The system of some of the points.
    ///
    /// # Errors
    /// None: what holds of all points holds of some.
    pub(super) fn at(&self, points: &[usize]) -> Result<Self> {
        let regularization = match &self.regularization {
            Regularization::Uniform(alpha) => Regularization::Uniform(*alpha),
            Regularization::PerPoint(noise) => {
                Regularization::PerPoint(points.iter().map(|&point| noise[point]).collect())
            }
        };
        Self::new(Arc::new(self.cloud.select(points)), self.kernel.clone(), regularization)
    }

    /// Returns the largest sum of magnitudes of some columns of `K + αI`, spread over the points.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn largest_row_seen(&self, observer: &dyn Observer) -> Result<f64> {
        let n = self.n_points();
        let some: Vec<usize> = (0..n).step_by(n.div_ceil(ROWS_SEEN)).collect();
        let places = self.cloud.select(&some);
        // Kernels are nowhere negative.
        let ones = vec![1.0; n];
        let sums = Expansion { centres: &self.cloud, kernel: &self.kernel, weights: &ones }
            .values_at(&places, observer)?;
        let with_noise = sums.iter().zip(&some).map(|(sum, &point)| sum + self.regularization.at(point));
        Ok(with_noise.fold(0.0, f64::max))
    }

    /// `(K + αI)X` for columns `[n, k]`.
    ///
    /// # Errors
    /// [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    pub(super) fn times(&self, columns: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let (n, cloud, kernel) = (self.n_points(), &*self.cloud, &self.kernel);
        let mut products = if columns.len() <= FEW * n {
            let each = columns.chunks_exact(n).map(|column| kernel_times(cloud, kernel, column, observer));
            each.collect::<Result<Vec<_>>>()?.concat()
        } else {
            values_of_each(cloud, kernel, columns, cloud, observer)?
        };
        self.add_noise(columns, &mut products);
        Ok(products)
    }

    /// Adds `αX` to products for columns `[n, k]`.
    pub(super) fn add_noise(&self, columns: &[f64], products: &mut [f64]) {
        let (n, entries) = (self.n_points(), products.iter_mut().zip(columns).enumerate());
        entries.for_each(|(at, (product, x))| *product += self.regularization.at(at % n) * x);
    }

    pub fn n_points(&self) -> usize {
        self.cloud.n_points()
    }

    /// Returns the bytes held on the heap, including those of the cloud: the system may outlive its other
    /// owners.
    pub(crate) fn n_bytes(&self) -> usize {
        let noise = match &self.regularization {
            Regularization::Uniform(_) => 0,
            Regularization::PerPoint(variances) => vec_bytes(variances),
        };
        noise + block_bytes(arc_payload::<Cloud>()) + self.cloud.n_bytes() + self.kernel.n_bytes()
    }
}
