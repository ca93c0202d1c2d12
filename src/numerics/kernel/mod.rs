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
use super::simd::{BLOCK, Block};

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
            _ => Ok(Self { family, length_scale, variance }),
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

    /// φ, φ′ and φ″ (the first `ORDER + 1` of them) for a block of squared scaled distances.
    #[inline(always)]
    pub(crate) fn profile_block<S: Simd, const ORDER: usize>(&self, q: &Block, phi: &mut [Block; 3]) {
        use WendlandSmoothness::{C2, C4, C6};
        match self.family {
            Family::Gauss => fill::<ORDER>(q, phi, gauss::profile::<S>),
            Family::Laplace { epsilon } => fill::<ORDER>(q, phi, |q| laplace::profile::<S>(q, epsilon)),
            Family::Matern { order: 0 } => fill::<ORDER>(q, phi, matern::profile::<S, 0>),
            Family::Matern { order: 1 } => fill::<ORDER>(q, phi, matern::profile::<S, 1>),
            Family::Matern { order: 2 } => fill::<ORDER>(q, phi, matern::profile::<S, 2>),
            Family::Matern { order: 3 } => fill::<ORDER>(q, phi, matern::profile::<S, 3>),
            Family::Matern { order: 4 } => fill::<ORDER>(q, phi, matern::profile::<S, 4>),
            Family::Matern { order: 5 } => fill::<ORDER>(q, phi, matern::profile::<S, 5>),
            Family::Matern { order: 6 } => fill::<ORDER>(q, phi, matern::profile::<S, 6>),
            Family::Matern { order: 7 } => fill::<ORDER>(q, phi, matern::profile::<S, 7>),
            Family::Matern { .. } => fill::<ORDER>(q, phi, matern::profile::<S, 8>),
            Family::Wendland { smoothness: C2 } => fill::<ORDER>(q, phi, wendland::profile_c2),
            Family::Wendland { smoothness: C4 } => fill::<ORDER>(q, phi, wendland::profile_c4),
            Family::Wendland { smoothness: C6 } => fill::<ORDER>(q, phi, wendland::profile_c6),
            Family::InverseMultiquadric => fill::<ORDER>(q, phi, inverse_multiquadric::profile),
        }
    }
}

/// A positive number so small that no scaled distance of distinct points comes near it. Profiles whose derivatives are
/// unbounded at 0 divide by at least this, so that they stay finite and D = 0 annihilates them there.
const TINY: f64 = 1e-100;

/// Writes the profile of every pair; what `ORDER` leaves out is never computed.
#[inline(always)]
fn fill<const ORDER: usize>(q: &Block, phi: &mut [Block; 3], profile: impl Fn(f64) -> [f64; 3]) {
    let [phi0, phi1, phi2] = phi;
    for i in 0..BLOCK {
        let [p0, p1, p2] = profile(q[i]);
        phi0[i] = p0;
        if ORDER >= 1 {
            phi1[i] = p1;
        }
        if ORDER >= 2 {
            phi2[i] = p2;
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
