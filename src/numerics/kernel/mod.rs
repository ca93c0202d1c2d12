//! Radial positive definite kernels, `k(x, y) = variance · φ(q)` with `q = |x − y|²/ℓ²`.
//!
//! A family is its profile φ and two derivatives in q, because with D = x − y
//! `∇k = 2·variance·φ′·D/ℓ²` and `D²k = variance·(4φ″·DDᵀ/ℓ⁴ + 2φ′·I/ℓ²)` need nothing else. To add one: a file with its
//! formula and facts, and one line in `family.rs`.

mod facts;
mod family;
mod gauss;
mod inverse_multiquadric;
mod laplace;
mod matern;
mod profile;
mod wendland;

use pulp::{Simd, WithSimd};

use super::error::NumericsError;
use super::machine::instruction_set::Portable;
use super::machine::registers::{Block, Pack};
pub use family::Family;
pub use matern::MAX_MATERN_ORDER;
pub(crate) use profile::{HUGE, Pairs, distance_and_inverse};
pub use wendland::WendlandSmoothness;

/// What `2|φ′|√q = ℓ|∇k|/variance` never exceeds, in any family: Wendland's of smoothness 6 comes to 2.8.
pub(crate) const MAX_SLOPE: f64 = 4.0;

/// A family with its length scale ℓ (unit L) and variance (unit V²), all checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    family: Family,
    length_scale: f64,
    variance: f64,
    inverse_square_length: f64,
}

impl Kernel {
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`] for a length scale or variance that is not positive, or so small or large
    /// that its square or inverse square leaves float64; a negative epsilon; an order above [`MAX_MATERN_ORDER`].
    pub fn new(family: Family, length_scale: f64, variance: f64) -> Result<Self, NumericsError> {
        let refuse =
            |parameter, requirement| Err(NumericsError::InvalidKernelParameter { parameter, requirement });
        if !(1e-140..=1e140).contains(&length_scale) {
            return refuse("length_scale", "must be positive, between 1e-140 and 1e140");
        }
        if !(1e-140..=1e140).contains(&variance) {
            return refuse("variance", "must be positive, between 1e-140 and 1e140");
        }
        if let Some((parameter, requirement)) = family.refused() {
            return refuse(parameter, requirement);
        }
        let inverse_square_length = inverse_square(length_scale);
        Ok(Self { family, length_scale, variance, inverse_square_length })
    }

    pub fn family(&self) -> Family {
        self.family
    }

    /// ℓ, unit L.
    pub fn length_scale(&self) -> f64 {
        self.length_scale
    }

    /// The factor of φ, unit V².
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// The same correlations with variance 1.
    pub(crate) fn of_variance_one(self) -> Self {
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
    /// [`NumericsError::KernelNotPositiveDefinite`] in a dimension where the family is not.
    pub fn check_dimension(&self, dimension: usize) -> Result<(), NumericsError> {
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

    /// φ, φ′ and φ″ at 0, for families that have them there.
    pub(crate) fn profile_at_zero(&self) -> [f64; 3] {
        Portable {}.vectorize(AtZero(self))
    }

    /// Runs over the pairs of a block with φ, φ′ and φ″. Derivatives that the loop body does not use are never computed.
    #[inline(always)]
    pub(crate) fn profiles<S: Simd>(&self, pairs: impl Pairs<S>) {
        self.family.profiles(pairs);
    }
}

/// One block of pairs at a distance of 0.
struct AtZero<'a>(&'a Kernel);

impl WithSimd for AtZero<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut found = [Block::ZERO; 3];
        self.0.profiles(Zero { simd, found: &mut found });
        found.map(|block| block.0[0])
    }
}

struct Zero<'a, S: Simd> {
    simd: S,
    found: &'a mut [Block; 3],
}

impl<S: Simd> Pairs<S> for Zero<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, _at: usize) -> (Pack<S>, ()) {
        (Pack::splat(self.simd, 0.0), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        for (block, value) in self.found.iter_mut().zip(profile) {
            value.store(block, at);
        }
    }
}

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
