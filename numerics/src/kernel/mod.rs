//! Radial positive definite kernels, `k(x, y) = variance · φ(q)` with `q = |x − y|²/ℓ²`, or `Σ_c (x_c − y_c)²/ℓ_c²` with a length scale
//! for each axis.
//!
//! A family is its profile φ and two derivatives in q, because with D = x − y
//! `∇k = 2·variance·φ′·D/ℓ²` and `D²k = variance·(4φ″·DDᵀ/ℓ⁴ + 2φ′·I/ℓ²)` need nothing else. To add one: a file with its
//! formula and facts, and one line in `family.rs`.

mod axes;
mod facts;
mod family;
mod gauss;
mod inverse_multiquadric;
mod laplace;
mod matern;
mod profile;
mod wendland;
mod zero;

use std::sync::Arc;

use pulp::Simd;

use super::error::NumericsError;
use super::machine::heap::{arc_payload, block_bytes};
use super::points::cloud::Cloud;
use axes::Axes;
pub use family::Family;
pub use matern::MAX_MATERN_ORDER;
pub(crate) use profile::{HUGE, Pairs, distance_and_inverse};
pub use wendland::WendlandSmoothness;

/// What `2|φ′|√q = ℓ|∇k|/variance` never exceeds, in any family: Wendland's of smoothness 6 comes to 2.8.
pub(crate) const MAX_SLOPE: f64 = 4.0;

/// A family with its length scale ℓ (unit L), or one for each axis, and variance (unit V²), all checked.
///
/// With a length scale for each axis, the kernel is that of the shortest one in stretched coordinates, `u_c = s_c x_c` with
/// `s_c = ℓ/ℓ_c ≤ 1`: whatever is summed up over pairs sees differences of these, and derivatives are turned back by the chain rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    family: Family,
    length_scale: f64,
    variance: f64,
    inverse_square_length: f64,
    axes: Option<Arc<Axes>>,
}

impl Kernel {
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`] for a length scale or variance that is not positive, or so small or large
    /// that its square or inverse square leaves float64; a negative epsilon; an order above [`MAX_MATERN_ORDER`].
    pub fn new(family: Family, length_scale: f64, variance: f64) -> Result<Self, NumericsError> {
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

    /// With a length scale for each axis, `[d]`.
    ///
    /// # Errors
    /// [`NumericsError::InvalidLengthScale`] with the axis; those of [`Kernel::new`]; [`NumericsError::InvalidKernelParameter`] for none at all.
    pub fn of_axes(family: Family, length_scales: &[f64], variance: f64) -> Result<Self, NumericsError> {
        if let Some(axis) =
            length_scales.iter().position(|length_scale| !LENGTH_SCALES.contains(length_scale))
        {
            return Err(NumericsError::InvalidLengthScale { axis, requirement: LENGTH_SCALE });
        }
        let shortest = length_scales.iter().copied().reduce(f64::min).ok_or(AXES_MISMATCH)?;
        let kernel = Self::new(family, shortest, variance)?;
        Ok(Self { axes: Some(Arc::new(Axes::new(length_scales, shortest))), ..kernel })
    }

    /// With another variance.
    ///
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`] for one that kernels do not take.
    pub fn with_variance(&self, variance: f64) -> Result<Self, NumericsError> {
        let Self { variance, .. } = Self::new(self.family, self.length_scale, variance)?;
        Ok(Self { variance, ..self.clone() })
    }

    pub fn family(&self) -> Family {
        self.family
    }

    /// ℓ, unit L; the shortest where each axis has its own.
    pub fn length_scale(&self) -> f64 {
        self.length_scale
    }

    /// ℓ_c of each axis, `[d]`, unit L, if each has its own.
    pub fn length_scales(&self) -> Option<&[f64]> {
        self.axes.as_ref().map(|axes| axes.length_scales())
    }

    /// The factor of φ, unit V².
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// The same correlations with variance 1.
    pub fn of_variance_one(self) -> Self {
        Self { variance: 1.0, ..self }
    }

    /// k₀ = k(x, x), unit V².
    pub fn at_zero(&self) -> f64 {
        self.variance * self.family.at_zero()
    }

    /// Whether the kernel has a kink at 0, hence no gradient at the points of the cloud.
    pub fn has_kink(&self) -> bool {
        self.family.has_kink()
    }

    /// Whether the process with this covariance has second derivatives: φ″ is finite at 0.
    pub fn has_second_derivatives(&self) -> bool {
        self.family.has_second_derivatives()
    }

    /// # Errors
    /// [`NumericsError::KernelNotPositiveDefinite`] in a dimension where the family is not; [`NumericsError::InvalidKernelParameter`] where the
    /// axes with a length scale are others.
    pub fn check_dimension(&self, dimension: usize) -> Result<(), NumericsError> {
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

    /// s_c = ℓ/ℓ_c, by which differences along an axis are multiplied; 1 where all axes are alike.
    #[inline]
    pub(crate) fn stretch(&self, axis: usize) -> f64 {
        self.factors().map_or(1.0, |factors| factors[axis])
    }

    /// The same for all axes, `[d]`, where they are not alike.
    #[inline(always)]
    pub(crate) fn factors(&self) -> Option<&[f64]> {
        self.axes.as_ref().map(|axes| axes.factors())
    }

    /// Whether each axis has a length scale of its own.
    pub fn is_stretched(&self) -> bool {
        self.axes.is_some()
    }

    /// Points in coordinates in which all axes are alike; `None` where they are.
    pub fn stretched_cloud(&self, cloud: &Cloud) -> Option<Cloud> {
        self.factors().map(|factors| cloud.stretched(factors))
    }

    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        self.axes.as_ref().map_or(0, |axes| block_bytes(arc_payload::<Axes>()) + axes.n_bytes())
    }

    /// φ, φ′ and φ″ at 0, for families that have them there.
    pub(crate) fn profile_at_zero(&self) -> [f64; 3] {
        self.family.profile_at_zero()
    }

    /// Runs over the pairs of a block with φ, φ′ and φ″. Derivatives that the loop body does not use are never computed.
    #[inline(always)]
    pub(crate) fn profiles<S: Simd>(&self, pairs: impl Pairs<S>) {
        self.family.profiles(pairs);
    }
}

/// Their squares and inverse squares are well inside float64.
const LENGTH_SCALES: std::ops::RangeInclusive<f64> = 1e-140..=1e140;

/// What is asked of them.
const LENGTH_SCALE: &str = "must be positive, between 1e-140 and 1e140";

/// What is wrong with as many length scales as there are.
const AXES_MISMATCH: NumericsError = NumericsError::InvalidKernelParameter {
    parameter: "length_scales",
    requirement: "must be one for each coordinate of the points",
};

/// 1/x², rounded once: all entries of a Gram matrix share this error, and share it where their own average out.
fn inverse_square(x: f64) -> f64 {
    let square = x * x;
    let of_square = x.mul_add(x, -square);
    let inverse = 1.0 / square;
    let remainder = square.mul_add(-inverse, 1.0) - of_square * inverse;
    inverse.mul_add(remainder, inverse)
}

#[cfg(test)]
mod tests;
