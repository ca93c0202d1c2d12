//! The interface through which each family of kernels states its parameters, smoothness and defaults.
//!
//! In default length scales, h, h₄ and R are `nearest`, `spacing` and `radius` of the cloud's `Scales`.

use crate::points::sampling::Scales;

/// Default ℓ of smooth kernels in multiples of h₄.
///
/// It is wide enough for a smooth interpolant, and narrow enough for Matérn 5/2 to stay positive definite in
/// float64 with α = 1e-10.
pub(super) const SMOOTH_SPACINGS: f64 = 10.0;

/// Facts about a family. Lengths are in units of ℓ, except the default length scales themselves.
pub(super) trait Facts {
    /// Returns the name of a parameter that is out of its range, and the range in words.
    fn refused(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// Returns φ(0).
    fn at_zero(&self) -> f64 {
        1.0
    }

    /// Returns whether φ has a kink at 0, hence no gradient at the points of a cloud.
    fn has_kink(&self) -> bool {
        false
    }

    /// Returns whether φ″ is finite at 0.
    fn has_second_derivatives(&self) -> bool {
        !self.has_kink()
    }

    /// Returns the distance within which a cusp at 0 is rounded, for families that have one.
    fn cusp_width(&self) -> Option<f64> {
        None
    }

    /// Returns the greatest dimension in which φ is positive definite, if there is one.
    fn max_dimension(&self) -> Option<usize> {
        None
    }

    /// Default ℓ for a surface through a cloud with these scales, unit L.
    fn default_length_scale(&self, scales: &Scales) -> f64;

    /// Default ℓ for a function through values at the points, unit L.
    fn length_scale_of_values(&self, scales: &Scales) -> f64 {
        self.default_length_scale(scales)
    }

    /// Returns the number of the family and its parameter, which are part of the name of a factorization.
    ///
    /// A number never changes and is never used for two families.
    fn canonical(&self) -> (u8, f64);
}

/// Default ℓ of analytic kernels, min(3h, R), unit L. They are the first to lose positive definiteness in
/// float64.
pub(super) fn analytic_length_scale(scales: &Scales) -> f64 {
    (3.0 * scales.nearest).min(scales.radius)
}
