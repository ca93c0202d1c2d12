//! Kriging in a moving neighbourhood: value, derivatives and variance at a query from the points nearest to it.
//!
//! Nothing is factorized beforehand and the work grows with the queries alone, so clouds may have any size. With N the nearest points of a
//! query q and `w = (K_NN + α_N)⁻¹ k(N, q)`, the mean is `wᵀy_N` and the variance `k₀ − wᵀk(N, q)`: the posterior given these
//! values alone (Chilès and Delfiner 2012, sec. 3.6). A cloud of no more than [`NEIGHBOURS`] points is its own
//! neighbourhood everywhere, and this is the dense posterior.
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
    /// The cloud in coordinates in which the kernel has one length scale.
    Stretched(Cloud, Neighbours),
}

impl Near {
    /// The nearest points, nearest first.
    fn nearest_into(&self, system: &System, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        match self {
            Self::Sampled(sampling) => sampling.neighbours().nearest_into(system.cloud(), x, count, found),
            Self::Stretched(cloud, neighbours) => {
                let stretched = x.iter().enumerate().map(|(axis, x)| x * system.kernel().stretch(axis));
                neighbours.nearest_into(cloud, &stretched.collect::<Small>(), count, found);
            }
        }
    }

    fn n_bytes(&self) -> usize {
        match self {
            Self::Sampled(sampling) => block_bytes(arc_payload::<Sampling>()) + sampling.n_bytes(),
            Self::Stretched(cloud, neighbours) => cloud.n_bytes() + neighbours.n_bytes(),
        }
    }
}

/// What is asked at queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MovingRequest {
    pub order: JetOrder,
    pub has_variances: bool,
}

/// What is found there.
pub struct MovingAnswer {
    pub jets: Jets,
    /// Variances of the latent function, if asked for.
    pub variances: Option<Variances>,
    /// Queries where some neighbours follow from nearer ones to rounding, and were left out.
    pub n_dependent: usize,
}

impl Moving {
    /// Of a system and how its cloud is sampled.
    pub fn new(system: System, sampling: Arc<Sampling>) -> Self {
        let near = match system.kernel().stretched_cloud(system.cloud()) {
            None => Near::Sampled(sampling),
            Some(cloud) => {
                let neighbours = Neighbours::of(&cloud);
                Near::Stretched(cloud, neighbours)
            }
        };
        Self { system, near }
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
    /// are asked of a kernel with a kink at a point of the cloud; [`NumericsError::NotPositiveDefinite`] with a variance below −τ;
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
        let (m, lanes) = (queries.n_points(), set.n_lanes());
        let layout = Layout::new(request.order, queries.dimension());
        let width = layout.width();
        let (mut packed, mut latent) = (vec![0.0; m * width], vec![0.0; m]);
        let n_dependent = AtomicUsize::new(0);
        let fit = Fit { moving: self, values, queries, request, layout };
        let slots = packed.par_chunks_mut(lanes * width).zip(latent.par_chunks_mut(lanes));
        slots.enumerate().try_for_each_init(
            || Room::new(self, set),
            |room, (batch, (jets, latent))| {
                observer.checkpoint()?;
                room.put(&fit, batch * lanes, latent.len())?;
                n_dependent.fetch_add(fit.answer(room, batch * lanes, jets, latent)?, Ordering::Relaxed);
                Ok(())
            },
        )?;
        let jets = Jets::of(layout, packed);
        let variances = request.has_variances.then(|| clamped(latent));
        Ok(MovingAnswer { jets, variances, n_dependent: n_dependent.into_inner() })
    }
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
    fn new(moving: &Moving, set: InstructionSet) -> Self {
        let (dimension, count) = (moving.system.cloud().dimension(), moving.n_neighbours());
        Self {
            set,
            batch: Batch::new(dimension, count, set.n_lanes()),
            workspace: Workspace::new(dimension, count),
            nearest: Vec::with_capacity(count + 1),
            sums: vec![0.0; Found::of(dimension).n_numbers()],
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
        latent: &mut [f64],
    ) -> Result<usize, NumericsError> {
        let kernel = self.moving.system.kernel();
        let order = match self.request.order {
            JetOrder::Value => 0,
            JetOrder::Gradient => 1,
            JetOrder::Hessian | JetOrder::HessianWithMagnitudes => 2,
        };
        let parts = Parts { order, variances: self.request.has_variances };
        room.set.dispatch(Krige { batch: &room.batch, kernel, parts, workspace: &mut room.workspace });
        let places = Found::of(self.queries.dimension());
        let mut n_thinned = 0;
        for (lane, (jet, variance)) in jets.chunks_exact_mut(self.layout.width()).zip(latent).enumerate() {
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
                *variance = kernel.at_zero() - room.sums[places.explained];
                self.check_is_rounding(query, *variance, room.sums[places.norm_squared], &room.batch)?;
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
