//! Geometry of local regressions at queries: sides, flags and deviations.

use rayon::prelude::*;

use super::bend::Bend;
use super::edges::{Points, Queries};
use super::{LocalSurface, SampledCloud};
use crate::error::NumericsError;
use crate::observer::{Observer, Stage};
use crate::patches::{CurvatureDeviations, PatchGeometry};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbour;
use crate::surface::NearNormals;
use crate::surface::flags::{FlagReason, is_far};
use crate::surface::request::{GeometryRequest, Orientation};
use crate::surface::served::{Deviations, GeometryArrays, ServedBy, Verdict};

/// Deviation of a normal, radians, beyond which it is flagged. On a scan this flags a fiftieth of the points,
/// among them seven tenths of the normals that are off by 30°.
const UNCERTAIN_NORMAL: f64 = 0.3;

impl LocalSurface {
    /// Serves the geometry at queries, as that of a function with |∇u| = 1 that grows outward.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(in crate::surface) fn serve(
        &self,
        queries: &Cloud,
        request: &GeometryRequest,
        observer: &dyn Observer,
    ) -> Result<GeometryArrays, NumericsError> {
        observer.enter(Stage::Evaluate);
        let (m, d) = (queries.n_points(), queries.dimension());
        let are_all = *queries == *self.cloud;
        let are_points =
            if are_all { vec![true; m] } else { self.ordered().sampling.neighbours().hold(queries) };
        let (geometry, of_sides) = match are_all {
            true => (self.at_points.given(&self.ordered), self.doubts_of_points()),
            false => {
                let mut geometry = self.patches.at(queries, &|query| are_points[query], true, observer)?;
                self.turn_outward(queries, &mut geometry);
                (geometry, self.doubts_of_sides(queries))
            }
        };
        let sign = match request.orientation {
            Orientation::Outward => 1.0,
            // Signature functions grow inward.
            Orientation::Gradient => -1.0,
        };
        let noise = |query: usize| if are_points[query] { self.patches.noise() } else { 0.0 };
        let asked = Queries { places: queries, geometry: &geometry, noise: &noise };
        let points = Points { on: self.ordered(), geometry: &self.at_points };
        let mut edges = points.edges_at(&asked, observer)?;
        let mut doubts = of_sides;
        for edge in &mut edges {
            doubts[edge.query].get_or_insert(FlagReason::Edge);
            edge.normals.iter_mut().for_each(|c| *c *= sign);
        }
        let verdict = |query: usize| {
            let reason = self.reason(&geometry, query, request, doubts[query]);
            Verdict { sign, by: ServedBy::Regression, reason }
        };
        Ok(GeometryArrays {
            dimension: d,
            verdicts: (0..m).into_par_iter().map(verdict).collect(),
            levels: geometry.heights.iter().map(|height| 1.0 - height).collect(),
            deviations: request.has_deviations.then(|| deviations(&geometry, sign, d)),
            edges,
            gradients: geometry.normals,
            hessians: geometry.shapes,
        })
    }

    /// Whether the sides of the given points are in doubt, `[n]`.
    fn doubts_of_points(&self) -> Vec<Option<FlagReason>> {
        let doubt = |&is: &bool| is.then_some(FlagReason::AmbiguousSide);
        self.ordered.given_rows(&self.is_ambiguous.iter().map(doubt).collect::<Vec<_>>(), 1)
    }

    /// Whether the sides of other places are in doubt, `[m]`, which they have from the nearest point.
    fn doubts_of_sides(&self, places: &Cloud) -> Vec<Option<FlagReason>> {
        let SampledCloud { sampling, .. } = self.ordered();
        let doubt = |found: &mut Vec<Neighbour>, place: usize| {
            sampling.neighbours().nearest_into(places.point(place), 1, found);
            let is_near = |found: &&Neighbour| !is_far(found.squared_distance, sampling.spacing(found.point));
            match found.first().filter(is_near) {
                None => Some(FlagReason::FarFromCloud),
                Some(found) => self.is_ambiguous[found.point].then_some(FlagReason::AmbiguousSide),
            }
        };
        (0..places.n_points()).into_par_iter().map_init(Vec::new, doubt).collect()
    }

    /// Reason why an answer is null or doubtful, if it is. `doubt` is the verdict of the neighbours.
    fn reason(
        &self,
        geometry: &PatchGeometry,
        query: usize,
        request: &GeometryRequest,
        doubt: Option<FlagReason>,
    ) -> Option<FlagReason> {
        if !geometry.is_known[query] {
            return Some(FlagReason::VanishingGradient);
        }
        let is_resolved = match request.checks_curvatures {
            true => self.is_resolved(geometry, query),
            false => geometry.normal_std[query] <= UNCERTAIN_NORMAL,
        };
        doubt.or_else(|| (!is_resolved).then_some(FlagReason::UnderResolved))
    }

    /// Returns whether the curvatures are known well enough to be used: to a part of their size, or to be
    /// those of a plane as far as the neighbourhood reaches.
    fn is_resolved(&self, geometry: &PatchGeometry, query: usize) -> bool {
        Bend::of(geometry, query, self.cloud.dimension()).is_some_and(|bend| {
            bend.is_flat() || bend.ratio(self.radius).is_some_and(|ratio| ratio >= self.least_ratio)
        })
    }

    /// Turns normals to the side of the normals of nearby points.
    fn turn_outward(&self, queries: &Cloud, geometry: &mut PatchGeometry) {
        let mut found = Vec::new();
        geometry.turn(|query, normal| {
            let near = NearNormals { sampling: &self.ordered.sampling, normals: &self.at_points.normals };
            if near.along(queries.point(query), normal, &mut found) < 0.0 { -1.0 } else { 1.0 }
        });
    }
}

/// Returns deviations in the order of the curvatures for normals of this sign.
fn deviations(geometry: &PatchGeometry, sign: f64, d: usize) -> Deviations {
    let empty = CurvatureDeviations::default();
    let curvatures = geometry.curvatures.as_ref().unwrap_or(&empty);
    let mut principal = curvatures.principal.clone();
    if sign < 0.0 {
        principal.chunks_exact_mut(d - 1).for_each(<[f64]>::reverse);
    }
    Deviations {
        is_known: geometry.is_known.clone(),
        height: geometry.height_std.clone(),
        normal: geometry.normal_std.clone(),
        principal,
        mean: curvatures.mean.clone(),
        gaussian: curvatures.gaussian.clone(),
    }
}
