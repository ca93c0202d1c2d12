//! Normals, curvatures and deviations at many queries.

use rayon::prelude::*;
use smallvec::SmallVec;

use super::estimate::Estimate;
use super::level::Level;
use super::neighbourhood::Neighbourhood;
use super::pooled::WeightedModel;
use super::regression::{ModelResult, n_terms};
use super::room::{Purpose, Room};
use super::{Coarser, Patches};
use crate::error::{NumericsError, Result};
use crate::machine::instruction_set::InstructionSet;
use crate::machine::lanes::MAX_LANES;
use crate::machine::small::{Small, zeros};
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Geometry of the surface at m queries, in flat arrays. Entries of queries without an answer are zero.
#[derive(Clone)]
pub struct PatchGeometry {
    /// True for queries with an answer, `[m]`.
    pub is_known: Vec<bool>,
    /// Unit normals of either sign, `[m, d]`.
    pub normals: Vec<f64>,
    /// Shape operators for these normals, `[m, d, d]`, 1/L: minus the second derivatives of the height over
    /// the tangent plane, in the coordinates of space.
    pub shapes: Vec<f64>,
    /// True for queries at the rim of their neighbourhood, `[m]`.
    pub is_at_rim: Vec<bool>,
    /// Height of the query above the surface along the normal, `[m]`, L.
    pub heights: Vec<f64>,
    /// Standard deviations of the surface along the normal, `[m]`, L.
    pub height_std: Vec<f64>,
    /// Standard deviations of the angles of the normals, `[m]`, radians.
    pub normal_std: Vec<f64>,
    /// Deviations of the curvatures, if asked for.
    pub curvatures: Option<CurvatureDeviations>,
}

/// Standard deviations of curvatures in flat arrays, unit 1/L, and 1/L^{d−1} for the Gaussian one. Those of
/// principal curvatures are in the ascending order of the curvatures for the normals they come with.
#[derive(Clone, Default)]
pub struct CurvatureDeviations {
    /// Principal curvatures, `[m, d−1]`.
    pub principal: Vec<f64>,
    /// Mean curvature, `[m]`.
    pub mean: Vec<f64>,
    /// Gaussian curvature, `[m]`.
    pub gaussian: Vec<f64>,
    /// True where the surface turns by a radian or more within the radius of the neighbourhood, `[m]`. A
    /// quadric cannot follow such a turn, and the deviations miss it.
    pub is_bent: Vec<bool>,
    /// Radius of the neighbourhood, L, at the finest level with a regression there, `[m]`.
    pub radii: Vec<f64>,
}

/// Least bend of a bent surface: its largest curvature in units of the radius of the neighbourhood.
///
/// Half of the curvatures that are off by half in spite of small deviations lie beyond it. Only 2 % of the
/// right ones do (docs/error-bars.md).
const BENT: f64 = 1.0;

/// Deviation of a normal, in radians, below which its neighbourhood is flat. The stiffer process then gives
/// the slopes.
const STIFF_BELOW: f64 = 0.03;

impl PatchGeometry {
    pub(super) fn unknown(m: usize, d: usize, with_deviations: bool) -> Self {
        let curvatures = with_deviations.then(|| CurvatureDeviations {
            principal: vec![0.0; m * (d - 1)],
            mean: vec![0.0; m],
            gaussian: vec![0.0; m],
            is_bent: vec![false; m],
            radii: vec![0.0; m],
        });
        Self {
            is_known: vec![false; m],
            normals: vec![0.0; m * d],
            shapes: vec![0.0; m * d * d],
            is_at_rim: vec![false; m],
            heights: vec![0.0; m],
            height_std: vec![0.0; m],
            normal_std: vec![0.0; m],
            curvatures,
        }
    }

    /// Splits the arrays into one part for every `lanes` queries.
    fn slots(&mut self, d: usize, lanes: usize) -> Vec<Slots<'_>> {
        let n_slots = self.is_known.len().div_ceil(lanes);
        let mut curvatures: Vec<Option<CurvatureSlots<'_>>> = Vec::new();
        if let Some(deviations) = &mut self.curvatures {
            let rest = deviations.mean.chunks_mut(lanes).zip(deviations.gaussian.chunks_mut(lanes));
            let bends = deviations.is_bent.chunks_mut(lanes).zip(deviations.radii.chunks_mut(lanes));
            let all = deviations.principal.chunks_mut(lanes * (d - 1)).zip(rest.zip(bends));
            let slots = |(principal, ((mean, gaussian), (is_bent, radii)))| {
                Some(CurvatureSlots { principal, mean, gaussian, is_bent, radii })
            };
            curvatures.extend(all.map(slots));
        }
        curvatures.resize_with(n_slots, || None);
        let vectors = self.normals.chunks_mut(lanes * d).zip(self.shapes.chunks_mut(lanes * d * d));
        let heights = self.heights.chunks_mut(lanes).zip(self.height_std.chunks_mut(lanes));
        let numbers = heights.zip(self.normal_std.chunks_mut(lanes));
        let flags = self.is_known.chunks_mut(lanes).zip(self.is_at_rim.chunks_mut(lanes));
        let all = vectors.zip(numbers).zip(flags).zip(curvatures);
        all.map(|((((normals, shapes), numbers), (is_known, is_at_rim)), curvatures)| {
            let ((heights, height_std), normal_std) = numbers;
            Slots { normals, shapes, heights, height_std, normal_std, is_known, is_at_rim, curvatures }
        })
        .collect()
    }
}

/// Part of a [`PatchGeometry`] that belongs to the queries of one batch.
struct Slots<'a> {
    normals: &'a mut [f64],
    shapes: &'a mut [f64],
    heights: &'a mut [f64],
    height_std: &'a mut [f64],
    normal_std: &'a mut [f64],
    is_known: &'a mut [bool],
    is_at_rim: &'a mut [bool],
    curvatures: Option<CurvatureSlots<'a>>,
}

struct CurvatureSlots<'a> {
    principal: &'a mut [f64],
    mean: &'a mut [f64],
    gaussian: &'a mut [f64],
    is_bent: &'a mut [bool],
    radii: &'a mut [f64],
}

impl Slots<'_> {
    fn put(&mut self, lane: usize, place: &Neighbourhood, estimate: &Estimate, is_point: bool) {
        let d = self.normals.len() / self.heights.len();
        let k = d - 1;
        self.is_known[lane] = true;
        self.is_at_rim[lane] = place.is_at_rim;
        let (normal, shape) = in_space(estimate, place, d);
        self.normals[lane * d..][..d].copy_from_slice(&normal);
        self.shapes[lane * d * d..][..d * d].copy_from_slice(&shape);
        self.heights[lane] = -estimate.means[0] * place.radius;
        self.height_std[lane] = estimate.covariance[0].max(0.0).sqrt() * place.radius;
        self.normal_std[lane] = estimate.normal_deviation(d, is_point);
        if let Some(curvatures) = &mut self.curvatures {
            let found = estimate.curvatures(d, is_point);
            let principal = curvatures.principal[lane * k..][..k].iter_mut();
            principal.zip(&found.principal).for_each(|(slot, deviation)| *slot = deviation / place.radius);
            curvatures.mean[lane] = found.mean / place.radius;
            curvatures.gaussian[lane] = found.gaussian / place.radius.powi(k as i32);
            curvatures.is_bent[lane] = found.bend >= BENT;
            curvatures.radii[lane] = place.radius;
        }
    }
}

impl Patches {
    /// Computes normals, curvatures and deviations at queries. Those for which `is_point` is true are points
    /// of the cloud, with their noise. The others are exact places.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn at(
        &self,
        queries: &Cloud,
        is_point: &(dyn Fn(usize) -> bool + Sync),
        with_deviations: bool,
        observer: &dyn Observer,
    ) -> Result<PatchGeometry> {
        // Levels are weighed by curvatures as well, which come with deviations only.
        let with_deviations = with_deviations || !self.coarser.is_empty();
        let mut geometry = self.finest.at(queries, is_point, with_deviations, observer)?;
        for Coarser { level, agreement } in &self.coarser {
            geometry.refine(&level.at(queries, is_point, true, observer)?, agreement, queries.dimension());
        }
        Ok(geometry)
    }
}

impl Level {
    /// Computes normals, curvatures and deviations at queries by this level alone.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn at(
        &self,
        queries: &Cloud,
        is_point: &(dyn Fn(usize) -> bool + Sync),
        with_deviations: bool,
        observer: &dyn Observer,
    ) -> Result<PatchGeometry> {
        let (m, d) = (queries.n_points(), queries.dimension());
        let mut geometry = PatchGeometry::unknown(m, d, with_deviations);
        if self.count < n_terms(d) + 2 {
            return Ok(geometry);
        }
        let lanes = InstructionSet::best().n_lanes();
        let slots = geometry.slots(d, lanes).into_par_iter().enumerate();
        slots.try_for_each_init(
            || Room::new(self, lanes),
            |room, (batch, mut slots)| {
                observer.checkpoint()?;
                let first = batch * lanes;
                let batch = first..(first + lanes).min(m);
                let are_points: SmallVec<[bool; MAX_LANES]> = batch.clone().map(is_point).collect();
                let places = room.put(queries, batch);
                let estimates = self.estimates(room, &places, &are_points);
                for (lane, (place, estimate)) in places.iter().zip(&estimates).enumerate() {
                    if let (Some(place), Some(estimate)) = (place, estimate) {
                        slots.put(lane, place, estimate, are_points[lane]);
                    }
                }
                Ok::<_, NumericsError>(())
            },
        )?;
        Ok(geometry)
    }

    /// Estimates the surface in each lane: with a trend of fourth order where that was learned and there are
    /// enough points for it, with a quadric elsewhere. Where a surface with noise is flat, the slopes are
    /// those of the stiff models.
    fn estimates(
        &self,
        room: &mut Room<'_>,
        places: &[Option<Neighbourhood>],
        are_points: &[bool],
    ) -> Estimates {
        let mut estimates: Estimates = places.iter().map(|_| None).collect();
        for mixture in [&self.quartic, &self.models] {
            let is_missing = places.iter().zip(&estimates).any(|(p, e)| p.is_some() && e.is_none());
            if is_missing && !mixture.is_empty() {
                let found = mixed(room, places, mixture);
                estimates.iter_mut().zip(found).for_each(|(own, found)| *own = own.take().or(found));
            }
        }
        let d = self.support.cloud().dimension();
        let is_flat = |(estimate, &is_point): (&Option<Estimate>, &bool)| {
            estimate.as_ref().is_some_and(|estimate| estimate.normal_deviation(d, is_point) < STIFF_BELOW)
        };
        let are_flat: SmallVec<[bool; MAX_LANES]> = estimates.iter().zip(are_points).map(is_flat).collect();
        if self.stiff.is_empty() || !are_flat.contains(&true) {
            return estimates;
        }
        let stiff = mixed(room, places, &self.stiff);
        for ((estimate, stiff), is_flat) in estimates.iter_mut().zip(stiff).zip(are_flat) {
            if let Some(estimate) = estimate.as_mut().filter(|_| is_flat) {
                estimate.take_slopes(stiff, d);
            }
        }
        estimates
    }
}

/// Estimates by lane.
type Estimates = SmallVec<[Option<Estimate>; MAX_LANES]>;

/// Estimates in the lanes with a neighbourhood that is large enough for the models.
fn mixed(room: &mut Room<'_>, places: &[Option<Neighbourhood>], mixture: &[WeightedModel]) -> Estimates {
    room.krige(mixture.iter().map(|weighted| &weighted.model), Purpose::Prediction);
    let d = room.dimension();
    let of = |(place, kriged): (&Option<Neighbourhood>, &Vec<ModelResult>)| {
        place.as_ref().and_then(|_| Estimate::of(mixture, kriged, d))
    };
    places.iter().zip(&room.kriged).map(of).collect()
}

/// Unit normal and shape operator in the coordinates of space.
fn in_space(estimate: &Estimate, place: &Neighbourhood, d: usize) -> (Small, Small) {
    let k = d - 1;
    let axis = |i: usize| &place.frame[i * d..][..d];
    let mut normal = Small::from_slice(axis(k));
    for a in 0..k {
        normal.iter_mut().zip(axis(a)).for_each(|(n, t)| *n -= estimate.means[1 + a] * t);
    }
    let length = norm(&normal);
    normal.iter_mut().for_each(|n| *n /= length);
    let hessian = estimate.hessian(d);
    let mut shape = zeros(d * d);
    for a in 0..k {
        for b in 0..k {
            let entry = -hessian[a * k + b] / (length * place.radius);
            for (i, u) in axis(a).iter().enumerate() {
                for (j, v) in axis(b).iter().enumerate() {
                    shape[i * d + j] += entry * u * v;
                }
            }
        }
    }
    (normal, shape)
}
