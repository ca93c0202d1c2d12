//! Covariance of the heights, up to its scale.

use smallvec::SmallVec;

use super::{Squares, n_terms};
use crate::kernel::Family;
use crate::kernel::in_place::Scaling;
use crate::machine::lanes::triangle;

/// Hyperparameters of the covariance, except its scale s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Model {
    /// Family of φ.
    pub family: Family,
    /// Length scale ℓ in units of the radius of a patch.
    pub length_scale: f64,
    /// τ²: variance of the noise of a point divided by s².
    pub noise: f64,
    pub trend: Trend,
}

/// Polynomials over the tangent plane whose coefficients have a flat prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trend {
    /// Up to second order.
    Quadric,
    /// Up to fourth order.
    Quartic,
}

impl Trend {
    /// Number of monomials, the [`n_terms`] of a quadric first.
    pub(crate) const fn n_terms(self, dimension: usize) -> usize {
        match self {
            Self::Quadric => n_terms(dimension),
            Self::Quartic => n_terms(dimension) * (dimension + 2) * (dimension + 3) / 12,
        }
    }

    /// Returns whether a neighbourhood determines the model: it leaves degrees of freedom, and none of its
    /// terms is nearly a sum of those before it.
    ///
    /// `independence` is the least share of the square of a term, `|f|² = fᵀK⁻¹f`, that those before it do
    /// not explain. It is 0.06 and more where 40 to 50 points in space and 20 to 30 on a surface are random,
    /// and below 0.001 where they lie on a few lines. A quadric says more there. Deviations would not know:
    /// they take what the surface is along the lines for what it is across.
    pub(super) fn is_determined(self, freedom: f64, independence: f64) -> bool {
        match self {
            Self::Quadric => freedom >= 1.0,
            Self::Quartic => freedom >= 5.0 && independence >= 0.05,
        }
    }
}

impl Model {
    /// Constants of φ as it is.
    #[inline(always)]
    pub(super) fn scaling(&self) -> Scaling {
        Scaling { inverse_square_length: self.length_scale.powi(-2), variance: 1.0, least: f64::NEG_INFINITY }
    }

    /// Variance of a third derivative of g along an axis divided by 15 s², in units of the radius:
    /// −8φ‴(0)/ℓ⁶.
    ///
    /// It follows from the mixed derivatives of a radial function.
    pub(crate) fn third_derivative_variance(&self) -> f64 {
        THIRD_DERIVATIVE * self.length_scale.powi(-6)
    }
}

/// −8φ‴(0) of Matérn's kernel for ν = 9/2: φ‴ = −ν³ θ₁(0)/θ₄(0).
///
/// The third derivatives of the rougher process, ν = 5/2, have no variance. It counts with this one.
const THIRD_DERIVATIVE: f64 = 8.0 * 4.5 * 4.5 * 4.5 / 105.0;

/// Covariance of value, gradient and Hessian of g at one place, divided by s², `[p, p]`.
pub(super) fn prior_covariance(model: &Model, k: usize) -> Squares {
    let p = triangle(k) + k + 1;
    let scale = model.length_scale.powi(-2);
    let [phi, first, second] = model.family.profile_at_zero();
    let (slope, bend) = (2.0 * first * scale, 4.0 * second * scale * scale);
    let mut prior = Squares::from_elem(0.0, p * p);
    prior[0] = phi;
    let mut pairs = SmallVec::<[(usize, usize); 16]>::new();
    for a in 0..k {
        prior[(1 + a) * p + 1 + a] = -slope;
        pairs.extend((a..k).map(|b| (a, b)));
    }
    for (i, &(a, b)) in pairs.iter().enumerate() {
        let row = k + 1 + i;
        if a == b {
            prior[row] = slope;
            prior[row * p] = slope;
        }
        for (j, &(c, e)) in pairs.iter().enumerate() {
            let is = |x: usize, y: usize| f64::from(u8::from(x == y));
            prior[row * p + k + 1 + j] =
                bend * (is(a, b) * is(c, e) + is(a, c) * is(b, e) + is(a, e) * is(b, c));
        }
    }
    prior
}
