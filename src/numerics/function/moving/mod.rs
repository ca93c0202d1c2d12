//! Kriging in a moving neighbourhood: value, derivatives and variance at a query from the points nearest to it.
//!
//! Nothing is factorized beforehand and the work grows with the queries alone, so clouds may have any size. With N the nearest points of a
//! query q and `w = (K_NN + α_N)⁻¹ k(N, q)`, the mean is `wᵀy_N` and the variance `k₀ − wᵀk(N, q)`: the posterior given these
//! values alone (Chilès and Delfiner 2012, sec. 3.6). A cloud of no more than [`NEIGHBOURS`] points is its own
//! neighbourhood everywhere, and this is the dense posterior.
//!
//! Points whose correlation with the query is below 2⁻⁵⁰⁰ do not count: far from all points the mean is exactly that of the process.
//!
//! Gradient and Hessian are those of the function that the neighbours define: exact for it, but the means of two queries with other
//! neighbours are not values of one function.

mod batch;
mod kriging;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::deviations::JetDeviations;
use super::functionals::has_variance;
use super::posterior::Variances;
use crate::numerics::error::{NotDefinite, NumericsError};
use crate::numerics::machine::heap::{arc_payload, block_bytes};
use crate::numerics::machine::instruction_set::InstructionSet;
use crate::numerics::machine::small::Small;
use crate::numerics::observer::{Observer, Stage};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::neighbours::{Neighbour, Neighbours};
use crate::numerics::points::sampling::Sampling;
use crate::numerics::solver::System;
use crate::numerics::solver::choose::NEIGHBOURS;
use crate::numerics::sums::jets::{JetOrder, Jets, Layout};
use batch::Batch;
use kriging::{Found, Krige, Parts, Workspace};

/// A system that is solved around each query anew.
pub struct Moving {
    system: System,
    near: Near,
}

/// Who knows which points are near: those with the greatest covariances.
enum Near {
    Sampled(Arc<Sampling>),
    /// In coordinates in which the kernel has one length scale.
    Stretched(Neighbours),
}

impl Near {
    /// The nearest points, nearest first.
    fn nearest_into(&self, system: &System, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        match self {
            Self::Sampled(sampling) => sampling.neighbours().nearest_into(x, count, found),
            Self::Stretched(neighbours) => {
                let stretched = x.iter().enumerate().map(|(axis, x)| x * system.kernel().stretch(axis));
                neighbours.nearest_into(&stretched.collect::<Small>(), count, found);
            }
        }
    }

    fn n_bytes(&self) -> usize {
        match self {
            Self::Sampled(sampling) => block_bytes(arc_payload::<Sampling>()) + sampling.n_bytes(),
            Self::Stretched(neighbours) => neighbours.n_bytes(),
        }
    }
}

/// What is asked at queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MovingRequest {
    pub order: JetOrder,
    pub has_variances: bool,
    /// Deviations of all that is asked for, derivatives included.
    pub has_deviations: bool,
}

/// What is found there.
pub struct MovingAnswer {
    pub jets: Jets,
    /// Variances of the latent function, if asked for.
    pub variances: Option<Variances>,
    /// Of the jets, if asked for.
    pub deviations: Option<JetDeviations>,
    /// Queries where some neighbours follow from nearer ones to rounding, and were left out.
    pub n_dependent: usize,
}

impl Moving {
    /// Local kriging of a system, with how its cloud is sampled.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn new(
        system: System,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let near = match system.kernel().stretched_cloud(system.cloud()) {
            None => Near::Sampled(sampling),
            Some(cloud) => Near::Stretched(Neighbours::of(&cloud, observer)?),
        };
        Ok(Self { system, near })
    }

    pub fn system(&self) -> &System {
        &self.system
    }

    /// Points of a neighbourhood.
    pub fn n_neighbours(&self) -> usize {
        NEIGHBOURS.min(self.system.n_points())
    }

    /// Bytes held on the heap, those of the cloud and its sampling included.
    pub fn n_bytes(&self) -> usize {
        self.system.n_bytes() + self.near.n_bytes()
    }

    /// Answers at queries `[m, d]` for values `[n]`, unit V.
    ///
    /// A negative variance is clamped only within `τ = 4ε(k₀ + (k k₀ + max α)|w|²)`, k the neighbours, and reported.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::LengthMismatch`]; [`NumericsError::KernelNotSmooth`] if derivatives
    /// are asked of a kernel with a kink at a point of the cloud; [`NumericsError::DerivativesVary`] if their deviations are, where the process
    /// has no such derivatives; [`NumericsError::NotPositiveDefinite`] with a variance below −τ;
    /// [`NumericsError::Overflow`]; [`NumericsError::Cancelled`].
    pub fn at(
        &self,
        values: &[f64],
        queries: &Cloud,
        request: MovingRequest,
        observer: &dyn Observer,
    ) -> Result<MovingAnswer, NumericsError> {
        self.at_with(InstructionSet::best(), values, queries, request, observer)
    }

    fn at_with(
        &self,
        set: InstructionSet,
        values: &[f64],
        queries: &Cloud,
        request: MovingRequest,
        observer: &dyn Observer,
    ) -> Result<MovingAnswer, NumericsError> {
        self.system.cloud().check_same_dimension(queries)?;
        self.system.cloud().check_one_per_point(values)?;
        observer.enter(Stage::Evaluate);
        let (m, d, lanes) = (queries.n_points(), queries.dimension(), set.n_lanes());
        let layout = Layout::new(request.order, d);
        let width = layout.width();
        let fit =
            Fit { moving: self, values, queries, request, layout, derivatives: self.derivatives(request)? };
        // The variance of the value, then deviations of derivatives.
        let n_sure = 1 + fit.derivatives.len();
        let (mut packed, mut sure) = (vec![0.0; m * width], vec![0.0; m * n_sure]);
        let n_dependent = AtomicUsize::new(0);
        let slots = packed.par_chunks_mut(lanes * width).zip(sure.par_chunks_mut(lanes * n_sure));
        slots.enumerate().try_for_each_init(
            || Room::new(&fit, set),
            |room, (batch, (jets, sure))| {
                observer.checkpoint()?;
                room.put(&fit, batch * lanes, sure.len() / n_sure)?;
                n_dependent.fetch_add(fit.answer(room, batch * lanes, jets, sure)?, Ordering::Relaxed);
                Ok(())
            },
        )?;
        let jets = Jets::of(layout, packed);
        let variances = clamped(sure.iter().step_by(n_sure).copied().collect());
        let deviations = request.has_deviations.then(|| {
            let values = sure.iter_mut().step_by(n_sure).zip(&variances.latent);
            values.for_each(|(slot, variance)| *slot = if *slot < 0.0 { -0.0 } else { variance.sqrt() });
            let clamped = of_clamped(&mut sure, n_sure);
            JetDeviations { clamped, ..JetDeviations::of_packed(&sure, d, request.order.degree()) }
        });
        let variances = request.has_variances.then_some(variances);
        Ok(MovingAnswer { jets, variances, deviations, n_dependent: n_dependent.into_inner() })
    }

    /// The derivatives whose deviations are asked for.
    fn derivatives(&self, request: MovingRequest) -> Result<Vec<Derivative>, NumericsError> {
        let (kernel, d, order) =
            (self.system.kernel(), self.system.cloud().dimension(), request.order.degree());
        if !request.has_deviations || order == 0 {
            return Ok(Vec::new());
        }
        if !has_variance(kernel, order) {
            return Err(NumericsError::DerivativesVary { order });
        }
        let ([_, slope, bend], v) = (kernel.profile_at_zero(), kernel.variance());
        let unit = |axis: usize| kernel.stretch(axis) / kernel.length_scale();
        let first = (0..d).map(|a| Derivative { prior_variance: -2.0 * v * slope, unit: unit(a) });
        let of_pair = |(a, b): (usize, usize)| Derivative {
            prior_variance: 4.0 * v * bend * if a == b { 3.0 } else { 1.0 },
            unit: unit(a) * unit(b),
        };
        let pairs = (0..d).flat_map(|a| (a..d).map(move |b| (a, b)));
        let second = pairs.map(of_pair).filter(|_| order == 2);
        Ok(first.chain(second).collect())
    }
}

/// A derivative whose deviation is asked for.
struct Derivative {
    /// In units of ℓ.
    prior_variance: f64,
    /// What turns its deviation in units of ℓ into one along the axes.
    unit: f64,
}

/// The queries with a deviation of −0, which says that rounding made its variance negative; it is 0 then.
fn of_clamped(deviations: &mut [f64], per_query: usize) -> Vec<usize> {
    let mut clamped = Vec::new();
    for (query, deviations) in deviations.chunks_exact_mut(per_query).enumerate() {
        if deviations.iter().any(|deviation| deviation.is_sign_negative()) {
            clamped.push(query);
            deviations.iter_mut().for_each(|deviation| *deviation = deviation.abs());
        }
    }
    clamped
}

/// Variances that rounding made negative, served as 0.
fn clamped(mut latent: Vec<f64>) -> Variances {
    let clamped = (0..latent.len()).filter(|&query| latent[query] < 0.0).collect();
    latent.iter_mut().for_each(|variance| *variance = variance.max(0.0));
    Variances { latent, clamped }
}

/// What all batches share.
struct Fit<'a> {
    moving: &'a Moving,
    values: &'a [f64],
    queries: &'a Cloud,
    request: MovingRequest,
    layout: Layout,
    /// Whose deviations are asked for.
    derivatives: Vec<Derivative>,
}

/// Room that a thread keeps from one batch to the next.
struct Room {
    set: InstructionSet,
    batch: Batch,
    workspace: Workspace,
    nearest: Vec<Neighbour>,
    sums: Vec<f64>,
}

impl Room {
    fn new(fit: &Fit<'_>, set: InstructionSet) -> Self {
        let (dimension, count) = (fit.queries.dimension(), fit.moving.n_neighbours());
        let n_derivatives = fit.derivatives.len();
        Self {
            set,
            batch: Batch::new(dimension, count, set.n_lanes()),
            workspace: Workspace::new(dimension, count, n_derivatives),
            nearest: Vec::with_capacity(count + 1),
            sums: vec![0.0; Found::of(dimension).of_derivatives() + n_derivatives],
        }
    }

    /// Puts the neighbourhoods of some consecutive queries side by side.
    fn put(&mut self, fit: &Fit<'_>, first: usize, n_queries: usize) -> Result<(), NumericsError> {
        let Moving { system, near } = fit.moving;
        let needs_smooth = fit.request.order != JetOrder::Value && system.kernel().has_kink();
        for lane in 0..n_queries {
            let (query, count) = (first + lane, self.batch.count);
            let x = fit.queries.point(query);
            near.nearest_into(system, x, count, &mut self.nearest);
            let coinciding = |n: &&Neighbour| system.cloud().point(n.point) == x;
            if let Some(found) = self.nearest.iter().find(coinciding).filter(|_| needs_smooth) {
                return Err(NumericsError::KernelNotSmooth { query, point: found.point });
            }
            self.batch.put(lane, x, &self.nearest, system, fit.values);
        }
        (n_queries..self.set.n_lanes()).for_each(|lane| self.batch.copy_lane(0, lane));
        Ok(())
    }

    /// The numbers of one query.
    fn read(&mut self, lane: usize) {
        let numbers = self.workspace.found[lane..].iter().step_by(self.set.n_lanes());
        self.sums.iter_mut().zip(numbers).for_each(|(sum, number)| *sum = *number);
    }
}

impl Fit<'_> {
    /// Answers the queries of a batch; says at how many of them neighbours were left out.
    fn answer(
        &self,
        room: &mut Room,
        first: usize,
        jets: &mut [f64],
        sure: &mut [f64],
    ) -> Result<usize, NumericsError> {
        let kernel = self.moving.system.kernel();
        let parts = Parts {
            order: self.request.order.degree(),
            variances: self.request.has_variances || self.request.has_deviations,
            n_derivatives: self.derivatives.len(),
        };
        room.set.dispatch(Krige { batch: &room.batch, kernel, parts, workspace: &mut room.workspace });
        let places = Found::of(self.queries.dimension());
        let mut n_thinned = 0;
        let slots = jets.chunks_exact_mut(self.layout.width());
        for (lane, (jet, sure)) in slots.zip(sure.chunks_exact_mut(1 + parts.n_derivatives)).enumerate() {
            let query = first + lane;
            room.read(lane);
            self.layout.finish(kernel, &room.sums, jet);
            // It has the variance already.
            jet[0] = room.sums[0];
            if jet.iter().any(|x| !x.is_finite()) {
                return Err(NumericsError::Overflow { query });
            }
            n_thinned += usize::from(room.sums[places.n_dependent] > 0.0);
            if parts.variances {
                sure[0] = kernel.at_zero() - room.sums[places.explained];
                self.check_is_rounding(query, sure[0], room.sums[places.norm_squared], &room.batch)?;
            }
            let explained = &room.sums[places.of_derivatives()..];
            for ((slot, of), explained) in sure[1..].iter_mut().zip(&self.derivatives).zip(explained) {
                let variance = of.prior_variance - explained;
                // What is no number stays none.
                *slot = if variance < 0.0 { -0.0 } else { of.unit * variance.sqrt() };
            }
            if sure[1..].iter().any(|deviation| !deviation.is_finite()) {
                return Err(NumericsError::Overflow { query });
            }
        }
        Ok(n_thinned)
    }

    fn check_is_rounding(
        &self,
        query: usize,
        variance: f64,
        norm_squared: f64,
        batch: &Batch,
    ) -> Result<(), NumericsError> {
        if variance >= 0.0 {
            return Ok(());
        }
        let k0 = self.moving.system.kernel().at_zero();
        // At least the norm of the matrix: no entry of K is greater than k₀.
        let norm = batch.count as f64 * k0 + batch.noise.iter().copied().fold(0.0, f64::max);
        if -variance <= 4.0 * f64::EPSILON * (k0 + norm * norm_squared) {
            return Ok(());
        }
        let minimum_alpha = 4.0 * batch.count as f64 * f64::EPSILON * norm;
        let reason = NotDefinite::NegativeVariance { query, variance };
        Err(NumericsError::NotPositiveDefinite { reason, minimum_alpha })
    }
}
