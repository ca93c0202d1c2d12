//! Criteria T3 and T4, by which the cloud confirms the curvatures of a surface.
//!
//! A kernel that is too wide or too narrow for the sampling gives smooth, wrong curvatures. Two estimates do
//! not depend on the kernel (T4). A quadric through some neighbours is cheap and coarse. The offset model on
//! a patch costs as much as a hundred quadrics. Where the quadric agrees, that is enough. Where it does not,
//! the patch decides.
//!
//! Small clouds, of which a patch may see both sides, have a third criterion (T3). It asks whether the
//! signature function would have predicted the points nearby, had each of them been left out. It covers all
//! points at the price of a few patches. So where the quadric nearly agrees, T3 is computed before the patch.

use super::SignatureSurface;
use super::offset::offset_jet_at;
use crate::machine::vector::dot;
use crate::points::local_quadrics::LocalQuadric;
use crate::points::sampling::SPACING_NEIGHBOURS;
use crate::surface::curvature::{FLAT, principal_curvatures};

/// Differences, over the largest curvature, up to which the quadric confirms, and up to which the patch does.
const CONFIRMED_BY_QUADRIC: f64 = 0.07;
const CONFIRMED_BY_PATCH: f64 = 0.10;

/// Difference, over the largest curvature, up to which the quadric confirms an answer of the patch. The
/// quadric is the coarser of the two.
const CONFIRMED_OFFSET: f64 = 0.20;

/// Difference from the quadric up to which points are left out before a patch is computed.
const CONFIRMED_WITH_PREDICTION: f64 = 0.10;

/// Standard error of the curvatures of the quadric, over the largest curvature, beyond which nothing is
/// confirmed. Quadric and patch then follow the same noise, and agree by chance.
const NOISY: f64 = 0.1;

/// Curvature times radius below which the quartic terms that a quadric leaves out are small: `(κr)²/4` of a
/// sphere's curvature.
const QUADRIC_BEND: f64 = 0.6;

/// Angle, radians, by which the normal may turn from one point to the next for neighbours to show the surface
/// at all.
const RESOLVED_TURN: f64 = 0.8;

/// Angle, radians, by which the normal may turn for T3 to count. Curvatures that are large and wrong would
/// meet T3.
const PREDICTED_TURN: f64 = 1.2;

/// T3: fraction of `h_q² κ` by which the level surface may miss a point that was left out.
const LEFT_OUT_MISS: f64 = 0.01;

/// T3: fraction of `h_q² κ` where leaving points out stands in for the patch, which is the surer of the two.
const LEFT_OUT_SURELY: f64 = 0.002;

/// Curvatures at a query, to be confirmed.
pub(crate) struct CurvatureCandidate<'a> {
    pub x: &'a [f64],
    /// Spacing h_q, unit L.
    pub spacing: f64,
    /// Principal curvatures `[d−1]`, ascending, for this unit normal.
    pub curvatures: &'a [f64],
    pub normal: &'a [f64],
    /// Gradient norm |∇u| of the function that gave the curvatures.
    pub gradient_norm: f64,
    pub quadric: Option<LocalQuadric<'a>>,
    pub is_offset: bool,
    /// True if the cost of a patch was admitted.
    pub may_use_patch: bool,
}

impl CurvatureCandidate<'_> {
    /// Returns whether the points around x confirm the curvatures.
    pub(crate) fn is_confirmed_by(&self, surface: &SignatureSurface) -> bool {
        let is_noisy = self.is_noisy(surface);
        let difference = self.difference_from_quadric(surface).unwrap_or(f64::INFINITY);
        if self.is_offset {
            return !is_noisy && difference <= CONFIRMED_OFFSET;
        }
        let turn = self.largest() * self.spacing;
        let may_be_seen = turn <= RESOLVED_TURN && !is_noisy;
        if may_be_seen && self.is_confirmed_by_quadric(difference) {
            return true;
        }
        if may_be_seen
            && difference <= CONFIRMED_WITH_PREDICTION
            && self.is_predicted(surface, LEFT_OUT_SURELY)
        {
            return true;
        }
        if !self.may_use_patch {
            return false;
        }
        // Leaving points out needs no gate against noise: it does not predict noise.
        match self.is_confirmed_by_patch(surface) {
            Some(is_confirmed) => is_confirmed && may_be_seen,
            None => turn <= PREDICTED_TURN && self.is_predicted(surface, LEFT_OUT_MISS),
        }
    }

    /// Returns whether what the quadric leaves, taken for noise, makes up a tenth of the curvatures.
    ///
    /// A flat cloud counts as curved by half of one over its radius.
    fn is_noisy(&self, surface: &SignatureSurface) -> bool {
        let scale = self.largest().max(0.5 / surface.radius);
        self.quadric.is_some_and(|quadric| quadric.uncertainty > NOISY * scale)
    }

    fn largest(&self) -> f64 {
        self.curvatures.iter().fold(0.0, |a: f64, k| a.max(k.abs()))
    }

    fn is_confirmed_by_quadric(&self, difference: f64) -> bool {
        self.quadric.is_some_and(|quadric| quadric.bend() < QUADRIC_BEND)
            && difference <= CONFIRMED_BY_QUADRIC
    }

    fn difference_from_quadric(&self, surface: &SignatureSurface) -> Option<f64> {
        let quadric = self.quadric.filter(|quadric| quadric.is_reliable())?;
        Some(self.difference(surface, &quadric.curvatures_for(self.normal)))
    }

    /// Returns whether the patch agrees, or `None` where there is no patch.
    fn is_confirmed_by_patch(&self, surface: &SignatureSurface) -> Option<bool> {
        let jet = offset_jet_at(surface, self.x)?;
        let side = dot(&jet.gradient, self.normal).signum();
        let (curvatures, _) = principal_curvatures(&jet.gradient, &jet.hessian, side);
        Some(self.difference(surface, &curvatures) <= CONFIRMED_BY_PATCH)
    }

    /// Returns the largest difference from other curvatures, over the largest curvature.
    fn difference(&self, surface: &SignatureSurface, other: &[f64]) -> f64 {
        let floor = FLAT / surface.radius;
        let largest = other.iter().fold(self.largest().max(floor), |a, k| a.max(k.abs()));
        self.curvatures.iter().zip(other).fold(0.0, |a: f64, (k, o)| a.max((k - o).abs())) / largest
    }

    /// Returns whether T3 holds at the nearest points: `|λ_i/((K+αI)⁻¹)_ii| ≤ share · |∇u| h_q² max|κ|`.
    ///
    /// The left side is what u misses at a point that is left out (Rippa 1999).
    fn is_predicted(&self, surface: &SignatureSurface, share: f64) -> bool {
        let Some(misses) = surface.left_out_misses() else { return false };
        let nearest = surface.sampling.neighbours().nearest_positions(self.x, SPACING_NEIGHBOURS);
        // The prediction is meaningless away from the points, and at a rim, where no point shows the other
        // side.
        let is_at_point =
            nearest.first().is_some_and(|found| found.squared_distance <= (0.5 * self.spacing).powi(2));
        if !is_at_point || self.quadric.is_some_and(|quadric| quadric.is_at_rim && quadric.is_reliable()) {
            return false;
        }
        let allowed = share * self.gradient_norm * self.spacing.powi(2) * self.largest();
        nearest.iter().all(|found| misses[found.point] <= allowed)
    }
}
