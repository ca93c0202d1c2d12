//! Radial positive definite kernels, `k(x, y) = variance · φ(q)` with `q = |x − y|²/ℓ²`.
//!
//! With a length scale for each axis, `q = Σ_c (x_c − y_c)²/ℓ_c²`.
//!
//! A family is its profile φ and the derivatives φ′ and φ″ in q. Nothing else is needed, because with
//! `D = x − y` the derivatives of k are `∇k = 2·variance·φ′·D/ℓ²` and
//! `D²k = variance·(4φ″·DDᵀ/ℓ⁴ + 2φ′·I/ℓ²)`.
//!
//! To add a family, write a file with its formula and facts, and one line in `family.rs`.

mod axes;
pub mod defaults;
mod facts;
mod family;
mod gauss;
pub(crate) mod in_place;
mod inverse_multiquadric;
mod laplace;
mod matern;
mod profile;
mod wendland;
mod zero;

use std::sync::Arc;

use pulp::Simd;

use super::error::{NumericsError, Result};
use super::machine::heap::{arc_payload, block_bytes};
use super::points::cloud::Cloud;
use axes::Axes;
pub use family::Family;
pub use matern::MAX_MATERN_ORDER;
pub(crate) use profile::{Distances, HUGE, Terms, distance_and_inverse};
pub use wendland::WendlandSmoothness;

/// Upper bound of `2|φ′|√q = ℓ|∇k|/variance` in any family. Wendland's of smoothness 6 reaches 2.8.
pub(crate) const MAX_SLOPE: f64 = 4.0;

/// A family with its length scale ℓ (unit L), or one for each axis, and its variance (unit V²), all checked.
///
/// With a length scale ℓ_c for each axis, ℓ is the shortest of them. The kernel is that of ℓ in stretched
/// coordinates, `u_c = s_c x_c` with `s_c = ℓ/ℓ_c ≤ 1`. Sums over pairs use differences of u, and the chain
/// rule turns derivatives back.
///
/// ```
/// use gramian_numerics::kernel::{Family, Kernel};
///
/// let kernel = Kernel::new(Family::Gauss, 0.5, 2.0)?; // ℓ = 0.5, variance 2
/// assert_eq!(kernel.at_zero(), 2.0);
/// assert!(Kernel::new(Family::Gauss, -0.5, 2.0).is_err());
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    family: Family,
    length_scale: f64,
    variance: f64,
    inverse_square_length: f64,
    axes: Option<Arc<Axes>>,
}

impl Kernel {
    /// Returns the kernel with one length scale for all axes.
    ///
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`] for a length scale or variance outside 1e-140 to 1e140,
    /// since its square and inverse square must stay inside float64; an epsilon outside 0 to 1e5; an order
    /// above [`MAX_MATERN_ORDER`].
    pub fn new(family: Family, length_scale: f64, variance: f64) -> Result<Self> {
        let refuse =
            |parameter, requirement| Err(NumericsError::InvalidKernelParameter { parameter, requirement });
        if !LENGTH_SCALES.contains(&length_scale) {
            return refuse("length_scale", LENGTH_SCALE);
        }
        if !(1e-140..=1e140).contains(&variance) {
            return refuse("variance", "must be positive, between 1e-140 and 1e140");
        }
        if let Some((parameter, requirement)) = family.refused() {
            return refuse(parameter, requirement);
        }
        let inverse_square_length = inverse_square(length_scale);
        Ok(Self { family, length_scale, variance, inverse_square_length, axes: None })
    }

    /// Returns the kernel with a length scale for each axis, `[d]`.
    ///
    /// # Errors
    /// [`NumericsError::InvalidLengthScale`] with the axis; [`NumericsError::InvalidKernelParameter`] for an
    /// empty slice; those of [`Kernel::new`].
    pub fn of_axes(family: Family, length_scales: &[f64], variance: f64) -> Result<Self> {
        if let Some(axis) =
            length_scales.iter().position(|length_scale| !LENGTH_SCALES.contains(length_scale))
        {
            return Err(NumericsError::InvalidLengthScale { axis, requirement: LENGTH_SCALE });
        }
        let shortest = length_scales.iter().copied().reduce(f64::min).ok_or(AXES_MISMATCH)?;
        let kernel = Self::new(family, shortest, variance)?;
        Ok(Self { axes: Some(Arc::new(Axes::new(length_scales, shortest))), ..kernel })
    }

    /// Returns this kernel with another variance.
    ///
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`] for a variance outside 1e-140 to 1e140.
    pub fn with_variance(&self, variance: f64) -> Result<Self> {
        let Self { variance, .. } = Self::new(self.family, self.length_scale, variance)?;
        Ok(Self { variance, ..self.clone() })
    }

    pub fn family(&self) -> Family {
        self.family
    }

    /// ℓ, unit L. The shortest one, if each axis has its own.
    pub fn length_scale(&self) -> f64 {
        self.length_scale
    }

    /// ℓ_c of each axis, `[d]`, unit L, or `None` if all axes share one.
    pub fn length_scales(&self) -> Option<&[f64]> {
        self.axes.as_ref().map(|axes| axes.length_scales())
    }

    /// The factor of φ, unit V².
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// Returns this kernel with variance 1, i.e. with the same correlations.
    pub(crate) fn of_variance_one(self) -> Self {
        Self { variance: 1.0, ..self }
    }

    /// k₀ = k(x, x), unit V².
    pub fn at_zero(&self) -> f64 {
        self.variance * self.family.at_zero()
    }

    /// Returns whether the kernel has a kink at 0, hence no gradient at the points of the cloud.
    pub fn has_kink(&self) -> bool {
        self.family.has_kink()
    }

    /// Returns whether the process with this covariance has second derivatives: φ″ is finite at 0.
    pub fn has_second_derivatives(&self) -> bool {
        self.family.has_second_derivatives()
    }

    /// Checks that the kernel can be used in a dimension.
    ///
    /// # Errors
    /// [`NumericsError::KernelNotPositiveDefinite`] if the family is not positive definite there;
    /// [`NumericsError::InvalidKernelParameter`] if the number of length scales is not the dimension.
    pub fn check_dimension(&self, dimension: usize) -> Result<()> {
        if self.length_scales().is_some_and(|axes| axes.len() != dimension) {
            return Err(AXES_MISMATCH);
        }
        match self.family.max_dimension() {
            Some(max_dimension) if dimension > max_dimension => {
                Err(NumericsError::KernelNotPositiveDefinite { dimension, max_dimension })
            }
            _ => Ok(()),
        }
    }

    /// 1/ℓ², between 1e-280 and 1e280.
    pub(crate) fn inverse_square_length(&self) -> f64 {
        self.inverse_square_length
    }

    /// s_c = ℓ/ℓ_c, the factor of differences along an axis. It is 1 if all axes share one length scale.
    #[inline]
    pub(crate) fn stretch(&self, axis: usize) -> f64 {
        self.factors().map_or(1.0, |factors| factors[axis])
    }

    /// The factors s_c of all axes, `[d]`, or `None` if all axes share one length scale.
    #[inline(always)]
    pub(crate) fn factors(&self) -> Option<&[f64]> {
        self.axes.as_ref().map(|axes| axes.factors())
    }

    /// Returns whether each axis has a length scale of its own.
    pub fn is_stretched(&self) -> bool {
        self.axes.is_some()
    }

    /// Returns the cloud in the coordinates `u_c = s_c x_c`, in which all axes are alike, or `None` if they
    /// already are.
    pub fn stretched_cloud(&self, cloud: &Cloud) -> Option<Cloud> {
        self.factors().map(|factors| cloud.stretched(factors))
    }

    /// Returns this kernel for a cloud in the stretched coordinates.
    pub(crate) fn unstretched(&self) -> Self {
        Self { axes: None, ..self.clone() }
    }

    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        self.axes.as_ref().map_or(0, |axes| block_bytes(arc_payload::<Axes>()) + axes.n_bytes())
    }

    /// Returns φ, φ′ and φ″ at 0, for families that have them there.
    pub(crate) fn profile_at_zero(&self) -> [f64; 3] {
        self.family.profile_at_zero()
    }

    /// Calls `terms` with φ of each pack of distances, in one loop that keeps it in registers.
    #[inline(always)]
    pub(crate) fn fold<S: Simd>(&self, terms: &mut impl Terms<S>) {
        self.family.fold(self.inverse_square_length, terms);
    }

    /// Overwrites squared distances, the first of these lists, by φ, and the others by φ′ and φ″.
    #[inline(always)]
    pub(crate) fn profiles<S: Simd, const N: usize>(&self, simd: S, lists: [&mut [S::f64s]; N]) {
        self.family.profiles(Distances { simd, inverse_square_length: self.inverse_square_length, lists });
    }
}

/// The range of length scales, unit L. Their squares and inverse squares are well inside float64.
const LENGTH_SCALES: std::ops::RangeInclusive<f64> = 1e-140..=1e140;

/// The requirement on length scales, for error messages.
const LENGTH_SCALE: &str = "must be positive, between 1e-140 and 1e140";

/// The error for length scales that do not match the coordinates of the points in number.
const AXES_MISMATCH: NumericsError = NumericsError::InvalidKernelParameter {
    parameter: "length_scales",
    requirement: "must be one for each coordinate of the points",
};

/// Returns 1/x², rounded once.
///
/// All entries of a Gram matrix share the error of this number, so it does not average out like their own
/// errors.
fn inverse_square(x: f64) -> f64 {
    let square = x * x;
    let of_square = x.mul_add(x, -square);
    let inverse = 1.0 / square;
    let remainder = square.mul_add(-inverse, 1.0) - of_square * inverse;
    inverse.mul_add(remainder, inverse)
}

#[cfg(test)]
mod tests;
