//! Radial positive definite kernels, `k(x, y) = variance · φ(q)` with `q = |x − y|²/ℓ²`.
//!
//! A family is its profile φ and two derivatives in q, because with D = x − y
//! `∇k = 2·variance·φ′·D/ℓ²` and `D²k = variance·(4φ″·DDᵀ/ℓ⁴ + 2φ′·I/ℓ²)` need nothing else. To add one: a file with its
//! `profile`, a variant of [`Family`] and one line in each `match` below.

mod gauss;
mod inverse_multiquadric;
mod laplace;
mod matern;
mod wendland;

use pulp::Simd;

use super::error::NumericsError;
use crate::numerics::machine::registers::Pack;

/// The families, with the parameters that are theirs alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Family {
    /// exp(−r²), r = |x − y|/ℓ.
    Gauss,
    /// exp(−√(r² + epsilon)), not normalised: φ(0) = e^{−√epsilon}.
    Laplace { epsilon: f64 },
    /// Half-integer Matérn, ν = order + ½.
    Matern { order: u8 },
    /// Wendland's φ_{3,k} of smoothness 2k.
    Wendland { smoothness: WendlandSmoothness },
    /// (1 + r²)^{−½}.
    InverseMultiquadric,
}

/// How often a Wendland function is differentiable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WendlandSmoothness {
    C2,
    C4,
    C6,
}

/// The greatest Matérn order p, ν = p + ½.
pub const MAX_MATERN_ORDER: u8 = 8;

/// The greatest dimension in which φ_{3,k} is positive definite (Wendland 1995).
pub const MAX_WENDLAND_DIMENSION: usize = 3;

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
        match family {
            Family::Laplace { epsilon } if !(0.0..=1e5).contains(&epsilon) => {
                refuse("epsilon", "must be between 0 and 1e5")
            }
            Family::Matern { order } if order > MAX_MATERN_ORDER => {
                refuse("nu", "must be one of 0.5, 1.5, ..., 8.5")
            }
            _ => {
                let inverse_square_length = inverse_square(length_scale);
                Ok(Self { family, length_scale, variance, inverse_square_length })
            }
        }
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

    /// k₀ = k(x, x), unit V².
    pub fn at_zero(&self) -> f64 {
        let phi = match self.family {
            Family::Laplace { epsilon } => (-epsilon.sqrt()).exp(),
            _ => 1.0,
        };
        self.variance * phi
    }

    /// Whether the kernel has a kink at 0, hence no gradient at the points of the cloud.
    pub fn has_kink(&self) -> bool {
        match self.family {
            Family::Laplace { epsilon } => epsilon == 0.0,
            Family::Matern { order } => order == 0,
            Family::Gauss | Family::Wendland { .. } | Family::InverseMultiquadric => false,
        }
    }

    /// # Errors
    /// [`NumericsError::KernelNotPositiveDefinite`] in a dimension where the family is not.
    pub fn check_dimension(&self, dimension: usize) -> Result<(), NumericsError> {
        match self.family {
            Family::Wendland { .. } if dimension > MAX_WENDLAND_DIMENSION => {
                Err(NumericsError::KernelNotPositiveDefinite {
                    dimension,
                    max_dimension: MAX_WENDLAND_DIMENSION,
                })
            }
            _ => Ok(()),
        }
    }

    /// 1/ℓ², between 1e-280 and 1e280.
    pub(crate) fn inverse_square_length(&self) -> f64 {
        self.inverse_square_length
    }

    /// Runs over the pairs of a block with φ, φ′ and φ″. Derivatives that the loop body does not use are never computed.
    #[inline(always)]
    pub(crate) fn profiles<S: Simd>(&self, pairs: impl Pairs<S>) {
        use WendlandSmoothness::{C2, C4, C6};
        match self.family {
            Family::Gauss => each(pairs, gauss::Gauss),
            Family::Laplace { epsilon } => each(pairs, laplace::Laplace { epsilon }),
            // s = r: the same formula, and one loop less to compile.
            Family::Matern { order: 0 } => each(pairs, laplace::Laplace { epsilon: 0.0 }),
            Family::Matern { order: 1 } => each(pairs, matern::Matern::<1>),
            Family::Matern { order: 2 } => each(pairs, matern::Matern::<2>),
            Family::Matern { order } => each(pairs, matern::SmoothMatern { order }),
            Family::Wendland { smoothness: C2 } => each(pairs, wendland::C2),
            Family::Wendland { smoothness: C4 } => each(pairs, wendland::C4),
            Family::Wendland { smoothness: C6 } => each(pairs, wendland::C6),
            Family::InverseMultiquadric => each(pairs, inverse_multiquadric::InverseMultiquadric),
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

/// A positive number so small that no scaled distance of distinct points comes near it. Profiles whose derivatives are
/// unbounded at 0 divide by at least this, so that they stay finite and D = 0 annihilates them there.
const TINY: f64 = 1e-100;

/// A family's formula.
trait Profile {
    /// φ, φ′, φ″ at q, branch-free.
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3];
}

/// The body of a loop over the pairs of one query and a block of points.
///
/// Two methods of a trait and not two closures, because only a method can be made to inline: what is not compiled into
/// the function that has the instruction set falls back to a call per instruction.
pub(crate) trait Pairs<S: Simd> {
    /// What [`Pairs::take`] wants to know of the pairs beside their profile.
    type Others;

    /// q of pack `at`.
    fn pack(&mut self, at: usize) -> (Pack<S>, Self::Others);

    /// Takes φ, φ′, φ″ at that q.
    fn take(&mut self, at: usize, others: Self::Others, profile: [Pack<S>; 3]);
}

/// The loop of [`Kernel::profiles`], compiled with one profile.
#[inline(always)]
fn each<S: Simd>(mut pairs: impl Pairs<S>, profile: impl Profile) {
    for at in 0..Pack::<S>::PER_BLOCK {
        let (q, others) = pairs.pack(at);
        pairs.take(at, others, profile.at(q));
    }
}

#[cfg(test)]
pub(crate) mod tests;
