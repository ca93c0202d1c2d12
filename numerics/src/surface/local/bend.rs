//! How far a surface turns in a neighbourhood, and how surely that is known.

use crate::patches::PatchGeometry;
use crate::surface::curvature::{FLAT, principal_curvatures};

/// Greatest angle by which a flat surface turns within a neighbourhood, radians, with [`SURELY`] deviations
/// of the curvature that is known least.
const FLAT_TURN: f64 = 0.1;
const SURELY: f64 = 2.0;

/// The largest principal curvature at a query with the largest deviation of one, 1/L.
pub(super) struct Bend {
    curvature: f64,
    deviation: f64,
    /// Radius of the neighbourhood, L.
    radius: f64,
    /// Whether the surface turns by more than deviations can tell.
    is_bent: bool,
}

impl Bend {
    /// `None` where nothing is known.
    pub(super) fn of(geometry: &PatchGeometry, query: usize, d: usize) -> Option<Self> {
        let deviations = geometry.curvatures.as_ref().filter(|_| geometry.is_known[query])?;
        let normal = &geometry.normals[query * d..][..d];
        let (curvatures, _) = principal_curvatures(normal, &geometry.shapes[query * d * d..][..d * d], 1.0);
        let of_principal = &deviations.principal[query * (d - 1)..][..d - 1];
        Some(Self {
            curvature: curvatures.iter().fold(0.0, |a: f64, k| a.max(k.abs())),
            deviation: of_principal.iter().fold(0.0, |a: f64, &deviation| a.max(deviation)),
            radius: deviations.radii[query],
            is_bent: deviations.is_bent[query],
        })
    }

    /// Whether the surface is surely flat as far as the neighbourhood reaches.
    pub(super) fn is_flat(&self) -> bool {
        self.radius * (self.curvature + SURELY * self.deviation) <= FLAT_TURN
    }

    /// Returns the curvature over its deviation, infinite for a deviation of 0. Curvatures that are 0 in a
    /// cloud of this radius, L, count as the least that is not.
    ///
    /// `None` where the surface bends more than deviations can say, or where nothing is known of them.
    pub(super) fn ratio(&self, radius_of_cloud: f64) -> Option<f64> {
        let curvature = self.curvature.max(FLAT / radius_of_cloud);
        let ratio = if self.deviation > 0.0 { curvature / self.deviation } else { f64::INFINITY };
        (!self.is_bent && !ratio.is_nan()).then_some(ratio)
    }
}
