//! What is known of a family of kernels beside its formula.

use crate::points::sampling::Scales;

/// ℓ in multiples of h₄: wide enough for a smooth interpolant, narrow enough for Matérn 5/2 to stay positive definite in
/// float64 with α = 1e-10.
pub(super) const SMOOTH_SPACINGS: f64 = 10.0;

/// What a family says of itself. A length scale ℓ is the unit of every length here.
pub(super) trait Facts {
    /// The name of a parameter that is out of its range, with the range.
    fn refused(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// φ(0).
    fn at_zero(&self) -> f64 {
        1.0
    }

    /// Whether φ has a kink at 0, hence no gradient at the points of a cloud.
    fn has_kink(&self) -> bool {
        false
    }

    /// Whether φ″ is finite at 0.
    fn has_second_derivatives(&self) -> bool {
        !self.has_kink()
    }

    /// Distance within which a cusp at 0 is rounded, for families that have one.
    fn cusp_width(&self) -> Option<f64> {
        None
    }

    /// The greatest dimension in which φ is positive definite, if there is one.
    fn max_dimension(&self) -> Option<usize> {
        None
    }

    /// ℓ for a surface through a cloud of these lengths, where none is given.
    fn default_length_scale(&self, scales: &Scales) -> f64;

    /// The same for values at its points.
    fn length_scale_of_values(&self, scales: &Scales) -> f64 {
        self.default_length_scale(scales)
    }

    /// A number of the family and its parameter, by which factorizations are named. Never changed, nor given twice.
    fn canonical(&self) -> (u8, f64);
}

/// ℓ of analytic kernels, which lose positive definiteness in float64 soonest.
pub(super) fn analytic_length_scale(scales: &Scales) -> f64 {
    (3.0 * scales.nearest).min(scales.radius)
}
