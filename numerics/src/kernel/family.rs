//! The families of kernels, each with its formula and facts.

use pulp::{Simd, WithSimd};

use super::facts::Facts;
use super::gauss::Gauss;
use super::inverse_multiquadric::InverseMultiquadric;
use super::laplace::Laplace;
use super::matern::Matern;
use super::profile::{Distances, Profiles, Terms};
use super::wendland::Wendland;
pub use super::wendland::WendlandSmoothness;
use crate::machine::instruction_set::outlined;
use crate::points::sampling::Scales;

/// Declares the families, one line each. The file named like the family has its formula and facts.
macro_rules! families {
    ($($(#[$meta:meta])* $name:ident $({ $parameter:ident: $type:ty })?,)*) => {
        /// A family of kernels, with the parameters that it alone has.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Family {
            $($(#[$meta])* $name $({ $parameter: $type })?,)*
        }

        impl Family {
            fn facts<T>(self, ask: impl FnOnce(&dyn Facts) -> T) -> T {
                match self {
                    $(Self::$name $({ $parameter })? => ask(&$name $({ $parameter })?),)*
                }
            }

            #[inline(always)]
            fn evaluate<S: Simd, const N: usize>(self, distances: Distances<'_, S, N>) {
                match self {
                    $(Self::$name $({ $parameter })? => $name $({ $parameter })?.evaluate(distances),)*
                }
            }

            /// Calls `terms` with φ of each pack of distances, in one loop that keeps it in registers.
            ///
            /// It is compiled into its caller. Sums of values lose a fifth of their time where φ goes through
            /// memory; nothing else loses as much.
            #[inline(always)]
            pub(super) fn fold<S: Simd>(self, inverse_square_length: f64, terms: &mut impl Terms<S>) {
                match self {
                    $(Self::$name $({ $parameter })? => {
                        $name $({ $parameter })?.fold(inverse_square_length, terms)
                    })*
                }
            }
        }
    };
}

families! {
    /// Gauss: exp(−r²), r = |x − y|/ℓ.
    Gauss,
    /// Regularised Laplace: exp(−√(r² + epsilon)), not normalised: φ(0) = e^{−√epsilon}.
    Laplace { epsilon: f64 },
    /// Half-integer Matérn, ν = order + ½.
    Matern { order: u8 },
    /// Wendland's φ_{3,k} of smoothness 2k.
    Wendland { smoothness: WendlandSmoothness },
    /// Inverse multiquadric: (1 + r²)^{−½}.
    InverseMultiquadric,
}

/// The evaluation of profiles, compiled once for each instruction set and number of derivatives.
struct Evaluation<'a, S: Simd, const N: usize> {
    family: Family,
    distances: Distances<'a, S, N>,
}

impl<S: Simd, const N: usize> WithSimd for Evaluation<'_, S, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<T: Simd>(self, _simd: T) {
        self.family.evaluate(self.distances);
    }
}

impl Family {
    /// Overwrites squared distances by φ, and the other lists by φ′ and φ″, as [`Distances`] describes.
    #[inline(always)]
    pub(crate) fn profiles<S: Simd, const N: usize>(self, distances: Distances<'_, S, N>) {
        outlined(distances.simd, Evaluation { family: self, distances });
    }

    /// Returns the name of a parameter that is out of its range, and the range in words.
    pub(super) fn refused(self) -> Option<(&'static str, &'static str)> {
        self.facts(|facts| facts.refused())
    }

    /// Returns φ(0).
    pub(super) fn at_zero(self) -> f64 {
        self.facts(|facts| facts.at_zero())
    }

    /// Returns whether φ has a kink at 0, hence no gradient at the points of a cloud.
    pub fn has_kink(self) -> bool {
        self.facts(|facts| facts.has_kink())
    }

    /// Returns whether φ″ is finite at 0.
    pub(super) fn has_second_derivatives(self) -> bool {
        self.facts(|facts| facts.has_second_derivatives())
    }

    /// Returns the distance in units of ℓ within which a cusp at 0 is rounded, for families that have one.
    pub(crate) fn cusp_width(self) -> Option<f64> {
        self.facts(|facts| facts.cusp_width())
    }

    /// Returns the greatest dimension in which φ is positive definite, if there is one.
    pub fn max_dimension(self) -> Option<usize> {
        self.facts(|facts| facts.max_dimension())
    }

    /// Default ℓ for a function through values at the points, unit L.
    pub fn length_scale_of_values(self, scales: &Scales) -> f64 {
        self.facts(|facts| facts.length_scale_of_values(scales))
    }

    /// Default ℓ for a surface through a cloud with these scales, unit L.
    pub fn default_length_scale(self, scales: &Scales) -> f64 {
        self.facts(|facts| facts.default_length_scale(scales))
    }

    /// Returns the number of the family and its parameter, which are part of the name of a factorization.
    pub fn canonical(self) -> (u8, f64) {
        self.facts(|facts| facts.canonical())
    }
}
