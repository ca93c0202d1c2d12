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
//! to 0 where they are not. At the surface of a cloud without gaps ρ is near 1, so w decides only off it.
//! Neighbours change from place to place, so f has small jumps.

use rayon::prelude::*;

use crate::error::Result;
use crate::machine::small::{Small, zeros};
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::patches::PatchGeometry;
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbour;
use crate::points::sampling::Sampling;
use crate::surface::local::LocalSurface;
use crate::surface::mesh::closedness::Closedness;
use crate::surface::mesh::field::{Feet, Field};
use crate::surface::orientation::WindingNumbers;

/// Number of points whose heights are blended. Their weights fall to 0 at the last one.
const N_BLENDED: usize = 13;

/// Length of the mean of unit normals from which they agree, and down to which they do not.
const AGREEING: Ramp = Ramp { zero: 0.5, one: 0.8 };

/// Distance of the foot from the mean of the points, in spacings.
const FOOT: Ramp = Ramp { zero: 1.6, one: 1.1 };

/// Distance from the cloud, in spacings.
const NEAR: Ramp = Ramp { zero: 2.5, one: 1.5 };

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
    cloud: &'a Cloud,
    sampling: &'a Sampling,
    /// Geometry at the points, normals outward.
    at_points: &'a PatchGeometry,
    winding: Option<WindingNumbers>,
    /// Difference of the winding numbers across the surface, which the areas of the points make 1 or not.
    jump: f64,
    /// +1, or −1 if the normals of the points point inward.
    side: f64,
    /// True if the heights alone are the field, since winding numbers of open sheets say nothing.
    is_open: bool,
}

/// Blend of the quadrics around a place.
struct Blend {
    /// Height over the surface, outward, L.
    height: f64,
    /// Gradient of the height without that of the weights, about a unit vector, `[d]`.
    gradient: Small,
    /// ρ: how far the blend is to be trusted.
    trust: f64,
    /// Distance to the nearest point, L.
    distance: f64,
    /// Spacing at the nearest point, L.
    spacing: f64,
}

impl<'a> LocalField<'a> {
    /// Prepares the field, and says how far the points enclose something. `is_open` says that they need not.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn of(
        surface: &'a LocalSurface,
        is_open: bool,
        observer: &dyn Observer,
    ) -> Result<(Self, Closedness)> {
        let (cloud, sampling) = (surface.cloud(), surface.sampling());
        let at_points = surface.at_points();
        let winding = WindingNumbers::of(cloud, sampling, &at_points.normals, observer)?;
        let closedness = Closedness::of(cloud, sampling, &at_points.normals, winding.as_ref(), observer)?;
        let side = if closedness.is_turned { -1.0 } else { 1.0 };
        let jump = closedness.jump;
        Ok((Self { cloud, sampling, at_points, winding, jump, side, is_open }, closedness))
    }

    /// Winding number at a place, with outward normals. 0 for a cloud of one position.
    fn winding(&self, x: &[f64]) -> f64 {
        self.winding.as_ref().map_or(0.0, |winding| self.side * winding.at(x) / self.jump)
    }

    fn blend(&self, x: &[f64], found: &mut Vec<Neighbour>) -> Blend {
        let d = x.len();
        self.sampling.neighbours().nearest_positions_into(x, N_BLENDED, found);
        let (nearest, farthest) = (found[0], found[found.len() - 1].squared_distance);
        let spacing = self.sampling.spacing(nearest.point);
        let distance = nearest.squared_distance.sqrt();
        let (mut total, mut height) = (0.0, 0.0);
        let (mut gradient, mut normal, mut mean) = (zeros(d), zeros(d), zeros(d));
        for neighbour in found.iter().filter(|near| self.at_points.is_known[near.point]) {
            let weight = wendland(neighbour.squared_distance, farthest);
            let point = neighbour.point;
            let (own, shape) = (self.normal(point), self.shape(point));
            let weight = self.side * weight;
            let delta: Small = x.iter().zip(self.cloud.point(point)).map(|(x, y)| x - y).collect();
            let mut bend = 0.0;
            for i in 0..d {
                let row = dot(&shape[i * d..][..d], &delta);
                bend += row * delta[i];
                gradient[i] += weight * (own[i] + row);
                normal[i] += weight * own[i];
                mean[i] -= weight.abs() * delta[i];
            }
            height += weight * (self.at_points.heights[point] + dot(own, &delta) + 0.5 * bend);
            total += weight.abs();
        }
        if total == 0.0 {
            return Blend { height: 0.0, gradient, trust: 0.0, distance, spacing };
        }
        height /= total;
        gradient.iter_mut().chain(&mut normal).chain(&mut mean).for_each(|c| *c /= total);
        let agreement = norm(&normal);
        // From the foot of x to the mean of the points.
        let off: Small = mean.iter().zip(&normal).map(|(m, n)| m + height * n / agreement.max(0.1)).collect();
        let trust = AGREEING.at(agreement) * FOOT.at(norm(&off) / spacing) * NEAR.at(distance / spacing);
        Blend { height, gradient, trust, distance, spacing }
    }

    /// The signed distance: positive inside.
    fn value(&self, x: &[f64], blend: &Blend) -> f64 {
        if blend.trust == 1.0 || self.is_open {
            return -blend.height;
        }
        let by_winding = blend.distance * (1.0 - 2.0 * self.winding(x));
        -(blend.trust * blend.height + (1.0 - blend.trust) * by_winding)
    }

    fn normal(&self, point: usize) -> &[f64] {
        let d = self.cloud.dimension();
        &self.at_points.normals[point * d..][..d]
    }

    fn shape(&self, point: usize) -> &[f64] {
        let d = self.cloud.dimension();
        &self.at_points.shapes[point * d * d..][..d * d]
    }

    /// The value and the gradient of f at a place.
    fn jet(&self, x: &[f64], found: &mut Vec<Neighbour>) -> (f64, Small) {
        let blend = self.blend(x, found);
        let value = self.value(x, &blend);
        if blend.trust == 1.0 || self.is_open {
            return (value, blend.gradient.iter().map(|g| -g).collect());
        }
        let step = DIFFERENCE * blend.spacing;
        let mut moved = Small::from_slice(x);
        let mut gradient = zeros(x.len());
        for axis in 0..x.len() {
            let mut at = |place: f64| {
                moved[axis] = place;
                let blend = self.blend(&moved, found);
                self.value(&moved, &blend)
            };
            let (ahead, behind) = (at(x[axis] + step), at(x[axis] - step));
            moved[axis] = x[axis];
            gradient[axis] = (ahead - behind) / (2.0 * step);
        }
        (value, gradient)
    }
}

/// Wendland's function (1 − r)⁴(4r + 1) of r = distance / farthest, both squared here.
fn wendland(squared: f64, farthest: f64) -> f64 {
    if farthest <= 0.0 {
        return 1.0;
    }
    let r = (squared / farthest).sqrt().min(1.0);
    (1.0 - r).powi(4) * (4.0 * r + 1.0)
}

impl Field for LocalField<'_> {
    fn dimension(&self) -> usize {
        self.cloud.dimension()
    }

    fn values_at_once(&self, places: &[f64], _observer: &dyn Observer) -> Result<Vec<f64>> {
        let rows = places.par_chunks_exact(self.dimension());
        Ok(rows.map_init(Vec::new, |found, x| self.value(x, &self.blend(x, found))).collect())
    }

    fn feet_at_once(&self, places: &[f64], _observer: &dyn Observer) -> Result<Feet> {
        let d = self.dimension();
        let rows = places.par_chunks_exact(d);
        let jets: Vec<(f64, Small)> = rows.map_init(Vec::new, |found, x| self.jet(x, found)).collect();
        let mut feet = Feet::default();
        for (x, (f, gradient)) in places.chunks_exact(d).zip(&jets) {
            let length = norm(gradient);
            let per_length = if length > 0.0 { 1.0 / length } else { 0.0 };
            feet.positions.extend(x.iter().zip(gradient).map(|(x, g)| x - f * per_length * per_length * g));
            feet.normals.extend(gradient.iter().map(|g| -g * per_length));
            feet.distances.push(f.abs() * per_length);
        }
        Ok(feet)
    }

    fn tolerance(&self) -> f64 {
        TOLERANCE * self.sampling.scales().spacing
    }
}
