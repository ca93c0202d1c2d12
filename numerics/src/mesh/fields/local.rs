//! The surface of local regressions as the zero level of a function on space.
//!
//! Near the surface, the function is the height over the quadrics of the nearest points, blended. Off it,
//! blended heights have spurious zeros, so there the function is the distance d to the cloud with the sign of
//! the winding number w:
//!
//! ```text
//! f(x) = −[ρ Σ wᵢ hᵢ(x) / Σ wᵢ + (1 − ρ) d(x) (1 − 2 w(x))],   hᵢ(x) = hᵢ + νᵢ·δ + ½ δᵀSᵢδ,   δ = x − xᵢ
//! ```
//!
//! ρ is 1 where the normals of the nearest points agree, and x and its foot are near to the points. It falls
//! to 0 where they are not. At the surface of a cloud without gaps ρ is near 1, so w decides off it, and
//! where sheets are so near each other that some of their points have wrong sides. For these, w is softened
//! more than for orientation. Neighbours change from place to place, so f has small jumps.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::Result;
use crate::machine::small::{Small, zeros};
use crate::machine::vector::norm;
use crate::mesh::closedness::Closedness;
use crate::mesh::field::{Feet, Field};
use crate::mesh::fields::quadrics::{Blend, Quadrics, Vector, padded};
use crate::observer::Observer;
use crate::orientation::WindingNumbers;
use crate::points::neighbours::Walk;
use crate::surface::local::LocalSurface;
use crate::surface::local::smoothed::SmoothedCloud;

/// Number of points whose heights are blended. Their weights fall to 0 at the last one.
const N_BLENDED: usize = 13;

/// Length of the mean of unit normals from which they agree, and down to which they do not. With 0.95 and
/// 0.7, 31 of 64 cones of 1,500 and 4,500 points have handles at the edge of their base, where the blend of
/// both sides has tunnels, and a scan of 48,485 points has ten. With these, four cones have some, and the
/// scan none.
const AGREEING: Ramp = Ramp { zero: 0.95, one: 0.995 };

/// Distance of the foot from the mean of the points, in spacings.
const FOOT: Ramp = Ramp { zero: 1.2, one: 0.8 };

/// Distance from the cloud, in spacings. Down to 1.3 and 0.6, scans have bubbles where jumps of the winding
/// numbers decide.
const NEAR: Ramp = Ramp { zero: 1.5, one: 0.7 };

/// Softening length of winding numbers over the width of a point's area. With 0.8, a few more cones have
/// handles. With 0.5, surfaces of unevenly spread points lie a little deeper.
const SOFTENING: f64 = 0.65;

/// Step of differences for gradients off the surface, in spacings.
const DIFFERENCE: f64 = 0.05;

/// Part of a spacing up to which a place counts as on the surface. f has jumps larger than this, where
/// neighbours change.
const TOLERANCE: f64 = 1e-7;

/// Rises linearly from 0 at `zero` to 1 at `one`, in either order.
struct Ramp {
    zero: f64,
    one: f64,
}

impl Ramp {
    fn at(&self, x: f64) -> f64 {
        ((x - self.zero) / (self.one - self.zero)).clamp(0.0, 1.0)
    }
}

/// The function of a local surface.
pub struct LocalField<'a> {
    surface: &'a LocalSurface,
    quadrics: Quadrics,
    winding: Option<WindingNumbers>,
    /// Difference of the winding numbers across the surface, which the areas of the points make 1 or not.
    jump: f64,
    /// +1, or −1 if the normals of the points point inward.
    side: f64,
    /// True if the heights alone are the field, since winding numbers of open sheets are meaningless.
    is_open: bool,
}

impl<'a> LocalField<'a> {
    /// Prepares the field, and measures how far the points enclose something. With `is_open` they need not.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn of(
        surface: &'a LocalSurface,
        is_open: bool,
        observer: &dyn Observer,
    ) -> Result<(Self, Closedness)> {
        let smoothed = surface.smoothed(observer)?;
        let on = smoothed.as_ref().map_or(surface.ordered(), SmoothedCloud::placed);
        let normals = &surface.at_points().normals;
        let winding = WindingNumbers::of(on.cloud, on.sampling, normals, observer)?;
        let closedness_by = |winding: &Option<WindingNumbers>| {
            Closedness::of(on.cloud, on.sampling, normals, winding.as_ref(), observer)
        };
        let closedness = closedness_by(&winding)?;
        let side = if closedness.is_turned { -1.0 } else { 1.0 };
        // Softened numbers jump by less, but say less of which points have two sides.
        let winding = winding.map(|winding| winding.softened(SOFTENING));
        let jump = closedness_by(&winding)?.jump;
        let quadrics = Quadrics::of(surface, side);
        Ok((Self { surface, quadrics, winding, jump, side, is_open }, closedness))
    }

    /// The feet of some points on their own quadrics, `[m, d]`: near the surface, and known without any work.
    pub fn feet_of_points(&self, points: Range<usize>) -> Vec<f64> {
        self.surface.at_points().feet(self.surface.ordered().cloud, points)
    }

    /// Winding number at a place, with outward normals. 0 for a cloud of one position.
    fn winding(&self, x: &[f64]) -> f64 {
        self.winding.as_ref().map_or(0.0, |winding| self.side * winding.at(x) / self.jump)
    }

    /// Winding number at a place, and its gradient, `[d]`, 1/L.
    fn winding_jet(&self, x: &[f64]) -> (f64, Small) {
        let Some(winding) = &self.winding else { return (0.0, zeros(x.len())) };
        let factor = self.side / self.jump;
        let (value, mut gradient) = winding.jet(x);
        gradient.iter_mut().for_each(|g| *g *= factor);
        (factor * value, gradient)
    }

    fn walk(&self) -> Walk<'_> {
        Walk::over(self.surface.ordered().sampling.neighbours())
    }

    /// ρ: how far the blend is to be trusted.
    fn trust(blend: &Blend) -> f64 {
        let Blend { agreement, off, distance, spacing, .. } = blend;
        AGREEING.at(*agreement) * FOOT.at(off / spacing) * NEAR.at(distance / spacing)
    }

    /// Whether the blend alone is the field.
    fn is_trusted(&self, blend: &Blend) -> bool {
        self.is_open || Self::trust(blend) == 1.0
    }

    /// The signed distance, positive inside, of a blend that is not trusted alone.
    fn mixed(blend: &Blend, winding: f64) -> f64 {
        let trust = Self::trust(blend);
        let by_winding = blend.distance * (1.0 - 2.0 * winding);
        -(trust * blend.height + (1.0 - trust) * by_winding)
    }

    /// The value of f at a place.
    fn value(&self, x: &[f64], walk: &mut Walk<'_>) -> f64 {
        let blend = self.quadrics.blend(&padded(x), walk.positions(x, N_BLENDED));
        if self.is_trusted(&blend) { -blend.height } else { Self::mixed(&blend, self.winding(x)) }
    }

    /// The value and the gradient of f at a place. Off the surface, blends are differenced over the same
    /// points.
    fn jet(&self, x: &[f64], walk: &mut Walk<'_>) -> (f64, Vector) {
        let found = walk.positions(x, N_BLENDED);
        let mut moved = padded(x);
        let blend = self.quadrics.blend(&moved, found);
        if self.is_trusted(&blend) {
            return (-blend.height, blend.gradient.map(|g| -g));
        }
        let (winding, slope) = self.winding_jet(x);
        let step = DIFFERENCE * blend.spacing;
        let mut gradient = [0.0; 3];
        for axis in 0..x.len() {
            let mut at = |by: f64| {
                moved[axis] = x[axis] + by;
                Self::mixed(&self.quadrics.blend(&moved, found), winding + by * slope[axis])
            };
            let (ahead, behind) = (at(step), at(-step));
            moved[axis] = x[axis];
            gradient[axis] = (ahead - behind) / (2.0 * step);
        }
        (Self::mixed(&blend, winding), gradient)
    }
}

impl Field for LocalField<'_> {
    fn dimension(&self) -> usize {
        self.surface.cloud().dimension()
    }

    fn values_at_once(&self, places: &[f64], _observer: &dyn Observer) -> Result<Vec<f64>> {
        let rows = places.par_chunks_exact(self.dimension());
        Ok(rows.map_init(|| self.walk(), |walk, x| self.value(x, walk)).collect())
    }

    fn feet_at_once(&self, places: &[f64], _observer: &dyn Observer) -> Result<Feet> {
        let d = self.dimension();
        let rows = places.par_chunks_exact(d);
        let jets: Vec<(f64, Vector)> = rows.map_init(|| self.walk(), |walk, x| self.jet(x, walk)).collect();
        let mut feet = Feet::default();
        for (x, (f, gradient)) in places.chunks_exact(d).zip(&jets) {
            let length = norm(gradient);
            let per_length = if length > 0.0 { 1.0 / length } else { 0.0 };
            feet.positions.extend(x.iter().zip(gradient).map(|(x, g)| x - f * per_length * per_length * g));
            feet.normals.extend(gradient[..d].iter().map(|g| -g * per_length));
            feet.distances.push(f.abs() * per_length);
        }
        Ok(feet)
    }

    fn tolerance(&self) -> f64 {
        TOLERANCE * self.surface.sampling().scales().spacing
    }
}
