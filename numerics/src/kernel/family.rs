//! The families of kernels, and what is known of each beside its formula.

use pulp::Simd;

use super::facts::Facts;
use super::gauss::Gauss;
use super::inverse_multiquadric::InverseMultiquadric;
use super::laplace::Laplace;
use super::matern::Matern;
use super::profile::{Pairs, Profiles};
use super::wendland::Wendland;
pub use super::wendland::WendlandSmoothness;
use crate::points::sampling::Scales;

/// Declares the families: one line each, with the file that has the formula and the facts.
macro_rules! families {
    ($($(#[$meta:meta])* $name:ident $({ $parameter:ident: $type:ty })?,)*) => {
        /// The families, with the parameters that are theirs alone.
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

            /// Runs over the pairs of a block with φ, φ′ and φ″. Derivatives that the loop body does not use are never computed.
            #[inline(always)]
            pub(crate) fn profiles<S: Simd>(self, pairs: impl Pairs<S>) {
                match self {
                    $(Self::$name $({ $parameter })? => $name $({ $parameter })?.run(pairs),)*
                }
            }
        }
    };
}

families! {
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

impl Family {
    /// The name of a parameter that is out of its range, with the range.
    pub(super) fn refused(self) -> Option<(&'static str, &'static str)> {
        self.facts(|facts| facts.refused())
    }

    /// φ(0).
    pub(super) fn at_zero(self) -> f64 {
        self.facts(|facts| facts.at_zero())
    }

    /// Whether φ has a kink at 0, hence no gradient at the points of a cloud.
    pub fn has_kink(self) -> bool {
        self.facts(|facts| facts.has_kink())
    }

    /// Whether φ″ is finite at 0.
    pub(super) fn has_second_derivatives(self) -> bool {
        self.facts(|facts| facts.has_second_derivatives())
    }

    /// Distance in units of ℓ within which a cusp at 0 is rounded, for families that have one.
    pub(crate) fn cusp_width(self) -> Option<f64> {
        self.facts(|facts| facts.cusp_width())
    }

    /// The greatest dimension in which φ is positive definite, if there is one.
    pub fn max_dimension(self) -> Option<usize> {
        self.facts(|facts| facts.max_dimension())
    }

    /// The same for values at its points.
    pub fn length_scale_of_values(self, scales: &Scales) -> f64 {
        self.facts(|facts| facts.length_scale_of_values(scales))
    }

    /// ℓ for a surface through a cloud of these lengths, where none is given, unit L.
    pub fn default_length_scale(self, scales: &Scales) -> f64 {
        self.facts(|facts| facts.default_length_scale(scales))
    }

    /// A number of the family and its parameter, by which factorizations are named.
    pub fn canonical(self) -> (u8, f64) {
        self.facts(|facts| facts.canonical())
    }
}
