//! Local regression: a surface as heights over a tangent plane at every query, kriged from the nearest points.
//!
//! The surface around a query is a height over its tangent plane: a quadric, what its curvature entails beyond second order, a Gaussian
//! process and noise (`regression`). Hyperparameters come from the likelihood pooled over a sample of neighbourhoods
//! (`pooled`), and so does the size of the neighbourhoods, which grows with the noise (`means`). The posterior gives normal and
//! curvatures with their deviations (`estimate`). Everything is local: work and memory are linear in points and queries.

mod estimate;
mod means;
mod neighbourhood;
mod pooled;
pub(crate) mod regression;

use std::sync::Arc;

use rayon::prelude::*;

use super::error::NumericsError;
use super::machine::heap::vec_bytes;
use super::machine::instruction_set::InstructionSet;
use super::machine::small::{Small, zeros};
use super::machine::vector::norm;
use super::observer::Observer;
use super::points::cloud::Cloud;
use super::points::neighbours::Neighbour;
use super::points::sampling::{Sampling, median};
use estimate::Estimate;
use means::Support;
use neighbourhood::{Neighbourhood, Scratch, n_neighbours};
use pooled::{Weighted, candidates, pool, responsibilities};
use regression::{Batch, Krige, Kriged, MAX_LANES, Model, Workspace, n_terms};

/// Neighbourhoods whose likelihood is pooled.
const N_SAMPLES: usize = 96;

/// Points per mean that are tried, one after the other.
const GROUPS: [usize; 7] = [1, 3, 8, 24, 72, 216, 648];

/// Means that a cloud must leave for it to be worth trying.
const LEAST_MEANS: usize = 60;

/// How much smaller deviations must become for larger neighbourhoods.
const WORTH: f64 = 0.95;

/// Local regressions of the surface that a cloud samples, d ≥ 2.
pub struct Patches {
    support: Support,
    models: Vec<Weighted>,
    count: usize,
    noise: f64,
    kernel: PatchKernel,
    group: usize,
}

/// The covariance of the heights where most of the cloud is.
#[derive(Debug, Clone, Copy, Default)]
pub struct PatchKernel {
    /// ℓ, unit L.
    pub length_scale: f64,
    /// s², unit L².
    pub variance: f64,
}

/// The surface at m queries, in flat arrays; entries of queries without answer are zero.
pub struct PatchGeometry {
    /// Whether there is an answer, `[m]`.
    pub is_known: Vec<bool>,
    /// Unit normals of either sign, `[m, d]`.
    pub normals: Vec<f64>,
    /// Minus the second derivatives of the height, over the tangent plane, in space, `[m, d, d]`, 1/L: the shape operator for these
    /// normals.
    pub shapes: Vec<f64>,
    /// Whether the query is at the rim of its neighbourhood, `[m]`.
    pub is_at_rim: Vec<bool>,
    /// Height of the query above the surface along the normal, `[m]`, L.
    pub heights: Vec<f64>,
    /// `[m]`, radians.
    pub normal_deviations: Vec<f64>,
    /// Deviations of the curvatures, if asked for.
    pub curvatures: Option<CurvatureDeviations>,
}

/// Standard deviations of curvatures, 1/L (1/L^{d−1} for Gauss), in flat arrays; principal ones ascending by the curvatures for the
/// normals they come with.
pub struct CurvatureDeviations {
    /// `[m, d−1]`
    pub principal: Vec<f64>,
    /// `[m]`
    pub mean: Vec<f64>,
    /// `[m]`
    pub gaussian: Vec<f64>,
}

impl Patches {
    /// Chooses neighbourhoods and hyperparameters.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn of(
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        if cloud.dimension() < 2 {
            return Err(NumericsError::DimensionTooSmall { found: cloud.dimension() });
        }
        let mut best: Option<(f64, Self)> = None;
        for group in GROUPS {
            if group > 1 && cloud.n_points() / group < LEAST_MEANS {
                break;
            }
            let support = match group {
                1 => Support::Points { cloud: cloud.clone(), sampling: sampling.clone() },
                _ => Support::means(&cloud, group)?,
            };
            let (deviation, patches) = Self::over(&cloud, support, group, observer)?;
            let is_exact = patches.noise == 0.0;
            let is_better = best.as_ref().is_none_or(|(least, _)| deviation < WORTH * least);
            if is_better {
                best = Some((deviation, patches));
            }
            if !is_better || is_exact {
                break;
            }
        }
        best.map(|(_, patches)| patches).ok_or(NumericsError::EmptyCloud)
    }

    /// The hyperparameters on one support, with the median deviation of the curvatures that they promise.
    fn over(
        cloud: &Cloud,
        support: Support,
        group: usize,
        observer: &dyn Observer,
    ) -> Result<(f64, Self), NumericsError> {
        let d = cloud.dimension();
        let count = n_neighbours(d, support.cloud().n_points());
        let candidates = candidates(n_terms(d))?;
        let stride = (cloud.n_points() / N_SAMPLES).max(1);
        let sites: Vec<usize> = (0..cloud.n_points()).step_by(stride).collect();
        let blank =
            Self { support, models: Vec::new(), count, noise: 0.0, kernel: PatchKernel::default(), group };
        if count < n_terms(d) + 2 {
            return Ok((f64::INFINITY, blank));
        }
        let queries = cloud.select(&sites);
        let found = blank.krige_each(&queries, &candidates, Purpose::Likelihood, observer)?;
        let logs: Vec<Vec<f64>> = found
            .iter()
            .flatten()
            .map(|(_, kriged)| kriged.iter().map(|k| k.log_likelihood).collect())
            .collect();
        let models = pool(&candidates, &logs);
        let mut patches = Self { models, ..blank };
        let chosen: Vec<Model> = patches.models.iter().map(|weighted| weighted.model).collect();
        let whole = patches.krige_each(&queries, &chosen, Purpose::Prediction, observer)?;
        let estimates: Vec<(f64, f64, f64, f64)> =
            whole.iter().flatten().filter_map(|(at, kriged)| patches.summary(at, kriged, d)).collect();
        let middle = |of: fn(&(f64, f64, f64, f64)) -> f64| median(estimates.iter().map(of).collect());
        let deviation = middle(|e| e.0).unwrap_or(f64::INFINITY);
        patches.noise = middle(|e| e.1).unwrap_or(0.0).sqrt();
        patches.kernel = PatchKernel {
            length_scale: middle(|e| e.2).unwrap_or(1.0),
            variance: middle(|e| e.3).unwrap_or(1.0),
        };
        Ok((deviation, patches))
    }

    /// Largest deviation of a principal curvature, variance of the noise, ℓ and s² of one neighbourhood.
    fn summary(&self, at: &Neighbourhood, kriged: &[Kriged], d: usize) -> Option<(f64, f64, f64, f64)> {
        let estimate = Estimate::of(at, &self.models, kriged, d)?;
        let deviations = estimate.curvatures(d, true).principal;
        let shares = responsibilities(&self.models, kriged);
        let (mut length_scale, mut variance, mut noise) = (0.0, 0.0, 0.0);
        for ((share, kriged), weighted) in
            shares.iter().zip(kriged).zip(&self.models).filter(|((s, _), _)| **s > 0.0)
        {
            length_scale += share * weighted.model.length_scale * at.radius;
            variance += share * kriged.scale * at.radius.powi(2);
            // Below what rounding leaves, there is none.
            noise +=
                share * if weighted.model.noise > 1e-7 { kriged.scale * weighted.model.noise } else { 0.0 };
        }
        Some((
            deviations.iter().copied().fold(0.0, f64::max),
            noise * at.radius.powi(2),
            length_scale,
            variance,
        ))
    }

    /// σ: standard deviation of the noise of the points across the surface, unit L.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// The covariance of the heights where most of the cloud is.
    pub fn kernel(&self) -> PatchKernel {
        self.kernel
    }

    /// Points that a neighbourhood reaches at most.
    pub fn n_points_used(&self) -> usize {
        self.count * self.group
    }

    /// Normals, curvatures and deviations at queries. `are_points` says that they are the points themselves, with their noise.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn at(
        &self,
        queries: &Cloud,
        are_points: bool,
        with_deviations: bool,
        observer: &dyn Observer,
    ) -> Result<PatchGeometry, NumericsError> {
        let (m, d) = (queries.n_points(), queries.dimension());
        let k = d - 1;
        let (mut normals, mut shapes) = (vec![0.0; m * d], vec![0.0; m * d * d]);
        let (mut heights, mut normal_deviations) = (vec![0.0; m], vec![0.0; m]);
        let (mut is_known, mut is_at_rim) = (vec![false; m], vec![false; m]);
        let n_deviations = if with_deviations { m } else { 0 };
        let mut deviations = vec![0.0; n_deviations * (k + 2)];
        let models: Vec<Model> = self.models.iter().map(|weighted| weighted.model).collect();
        let lanes = InstructionSet::best().n_lanes();
        let width = if with_deviations { k + 2 } else { 0 };
        if self.count < n_terms(d) + 2 {
            let curvatures = with_deviations.then(|| split_deviations(&deviations, k));
            return Ok(PatchGeometry {
                is_known,
                normals,
                shapes,
                is_at_rim,
                heights,
                normal_deviations,
                curvatures,
            });
        }
        let slots = normals
            .par_chunks_mut(lanes * d)
            .zip(shapes.par_chunks_mut(lanes * d * d))
            .zip(heights.par_chunks_mut(lanes).zip(normal_deviations.par_chunks_mut(lanes)))
            .zip(is_known.par_chunks_mut(lanes).zip(is_at_rim.par_chunks_mut(lanes)))
            .enumerate();
        let mut chunks: Vec<&mut [f64]> = Vec::new();
        if with_deviations {
            chunks = deviations.chunks_mut(lanes * width).collect();
        } else {
            chunks.resize_with(m.div_ceil(lanes), Default::default);
        }
        slots.zip(chunks).try_for_each_init(
            || Room::new(self.count, d, lanes),
            |room,
             (
                (batch, (((normals, shapes), (heights, normal_deviations)), (is_known, is_at_rim))),
                deviations,
            )| {
                observer.checkpoint()?;
                let first = batch * lanes;
                let places = room.put(self, queries, first..(first + lanes).min(m));
                room.krige(&models, Purpose::Prediction);
                for (lane, place) in places.iter().enumerate() {
                    let Some(place) = place else { continue };
                    let kriged = &room.kriged[lane];
                    let Some(estimate) = Estimate::of(place, &self.models, kriged, d) else {
                        continue;
                    };
                    is_known[lane] = true;
                    is_at_rim[lane] = place.is_at_rim;
                    let (normal, shape) = in_space(&estimate, place, d);
                    normals[lane * d..][..d].copy_from_slice(&normal);
                    shapes[lane * d * d..][..d * d].copy_from_slice(&shape);
                    heights[lane] = -estimate.means[0];
                    normal_deviations[lane] = estimate.normal_deviation(d, are_points);
                    if with_deviations {
                        let found = estimate.curvatures(d, are_points);
                        let slot = &mut deviations[lane * width..][..width];
                        slot[..k].copy_from_slice(&found.principal);
                        (slot[k], slot[k + 1]) = (found.mean, found.gaussian);
                    }
                }
                Ok(())
            },
        )?;
        let curvatures = with_deviations.then(|| split_deviations(&deviations, k));
        Ok(PatchGeometry { is_known, normals, shapes, is_at_rim, heights, normal_deviations, curvatures })
    }

    /// What models say at a few queries.
    fn krige_each(
        &self,
        queries: &Cloud,
        models: &[Model],
        purpose: Purpose,
        observer: &dyn Observer,
    ) -> Result<Vec<Option<Found>>, NumericsError> {
        let (m, d) = (queries.n_points(), queries.dimension());
        let lanes = InstructionSet::best().n_lanes();
        let batches = (0..m.div_ceil(lanes)).into_par_iter().map_init(
            || Room::new(self.count, d, lanes),
            |room, batch| {
                observer.checkpoint()?;
                let first = batch * lanes;
                let places = room.put(self, queries, first..(first + lanes).min(m));
                room.krige(models, purpose);
                let found = places.into_iter().enumerate();
                Ok(found
                    .map(|(lane, place)| place.map(|place| (place, room.kriged[lane].clone())))
                    .collect::<Vec<_>>())
            },
        );
        let batches: Vec<Vec<Option<Found>>> = batches.collect::<Result<_, NumericsError>>()?;
        Ok(batches.into_iter().flatten().collect())
    }

    /// Bytes held on the heap beside the cloud and its sampling.
    pub fn n_bytes(&self) -> usize {
        self.support.n_bytes() + vec_bytes(&self.models)
    }
}

type Found = (Neighbourhood, Vec<Kriged>);

/// What a batch is solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    Likelihood,
    Prediction,
}

/// Room that a thread keeps from one batch to the next.
struct Room {
    batch: Batch,
    workspace: Workspace,
    scratch: Scratch,
    nearest: Vec<Neighbour>,
    set: InstructionSet,
    n_used: [usize; MAX_LANES],
    /// By lane and model.
    kriged: Vec<Vec<Kriged>>,
}

impl Room {
    fn new(count: usize, dimension: usize, lanes: usize) -> Self {
        Self {
            batch: Batch::new(dimension, count, lanes),
            workspace: Workspace::new(dimension, count),
            scratch: Scratch::default(),
            nearest: Vec::new(),
            set: InstructionSet::best(),
            n_used: [0; MAX_LANES],
            kriged: vec![Vec::new(); lanes],
        }
    }

    /// Puts the neighbourhoods of some queries side by side.
    fn put(
        &mut self,
        patches: &Patches,
        queries: &Cloud,
        range: std::ops::Range<usize>,
    ) -> Vec<Option<Neighbourhood>> {
        let support = &patches.support;
        let mut places = Vec::with_capacity(range.len());
        for (lane, query) in range.enumerate() {
            let x = queries.point(query);
            support.neighbours().nearest_positions_into(support.cloud(), x, patches.count, &mut self.nearest);
            let place =
                Neighbourhood::put(support, x, &self.nearest, &mut self.batch, lane, &mut self.scratch);
            self.n_used[lane] = place.as_ref().map_or(0, |place| place.n_used);
            if place.is_none() {
                self.batch.keep(lane, 0);
            }
            places.push(place);
        }
        // Lanes without a neighbourhood do as one that has: their numbers are not looked at.
        if let Some(filled) = places.iter().position(Option::is_some) {
            let is_empty = |lane: usize| places.get(lane).is_none_or(Option::is_none);
            for lane in (0..self.batch.lanes).filter(|&lane| is_empty(lane)) {
                self.batch.copy_lane(filled, lane);
            }
        }
        places
    }

    fn krige(&mut self, models: &[Model], purpose: Purpose) {
        self.kriged.iter_mut().for_each(Vec::clear);
        for model in models {
            let predicts = purpose != Purpose::Likelihood;
            let krige = Krige { batch: &self.batch, model, workspace: &mut self.workspace, predicts };
            for (slot, kriged) in self.kriged.iter_mut().zip(self.set.dispatch(krige)) {
                slot.push(kriged);
            }
        }
    }
}

/// Unit normal and shape operator in space.
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
            let entry = -hessian[a * k + b] / length;
            for (i, u) in axis(a).iter().enumerate() {
                for (j, v) in axis(b).iter().enumerate() {
                    shape[i * d + j] += entry * u * v;
                }
            }
        }
    }
    (normal, shape)
}

fn split_deviations(rows: &[f64], k: usize) -> CurvatureDeviations {
    let rows = rows.chunks_exact(k + 2);
    CurvatureDeviations {
        principal: rows.clone().flat_map(|row| &row[..k]).copied().collect(),
        mean: rows.clone().map(|row| row[k]).collect(),
        gaussian: rows.map(|row| row[k + 1]).collect(),
    }
}

impl std::fmt::Debug for Patches {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "g{} s{:.2e}", self.group, self.noise)?;
        self.models.iter().take(3).try_for_each(|w| {
            write!(f, " {}:{:.0e}({:.2})", w.model.length_scale, w.model.noise, w.log_share.exp())
        })
    }
}
