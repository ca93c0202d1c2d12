//! Evaluation of batches of queries: from neighbourhoods to jets and deviations.

use super::batch::{Batch, Observations};
use super::kriging::{Krige, Workspace};
use super::parts::{Parts, RowOffsets};
use super::quantities::{Quantities, Quantity, ScaledFunctional};
use super::{BatchedRequest, LocalKriging};
use crate::error::{NotDefinite, NumericsError, Result};
use crate::machine::instruction_set::InstructionSet;
use crate::machine::vector::dot;
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbour;
use crate::regression::solver::trend::{Trend, TrendUncertainty};
use crate::regression::sums::jets::{JetOrder, Layout};

/// Data shared by all batches of a request.
pub(super) struct Fit<'a> {
    pub(super) moving: &'a LocalKriging,
    pub(super) observations: Observations<'a>,
    pub(super) queries: &'a Cloud,
    pub(super) parts: Parts,
    pub(super) layout: Layout,
    pub(super) quantities: Quantities<'a>,
    /// Uncertainty of the mean's coefficients.
    pub(super) uncertainty: Option<TrendUncertainty<'a>>,
    /// Whether queries at points of the cloud are refused.
    pub(super) needs_smooth: bool,
    /// Points per neighbourhood.
    pub(super) n_neighbours: usize,
}

/// Buffers that a thread reuses from one batch to the next.
pub(super) struct Room {
    set: InstructionSet,
    batch: Batch,
    workspace: Workspace,
    nearest: Vec<Neighbour>,
    sums: Vec<f64>,
    /// Functionals, lane by lane, if the quantities are functionals.
    functionals: Vec<ScaledFunctional>,
}

impl<'a> Fit<'a> {
    pub(super) fn new(
        moving: &'a LocalKriging,
        values: &'a [f64],
        queries: &'a Cloud,
        asked: BatchedRequest<'a>,
    ) -> Self {
        let BatchedRequest { request, quantities, n_neighbours, .. } = asked;
        let (d, uncertainty) = (queries.dimension(), request.trend.and_then(Trend::uncertainty));
        let observations =
            Observations { system: &moving.system, values, basis: uncertainty.map(|of| of.basis) };
        let [n_derivatives, n_functionals] = quantities.n_rows(d);
        let parts = Parts {
            order: request.order.degree(),
            variances: request.has_variances || request.has_deviations,
            n_derivatives,
            n_functionals,
            n_functions: observations.n_functions(),
        };
        let layout = Layout::new(request.order, d);
        let needs_smooth = request.order != JetOrder::Value && moving.system.kernel().has_kink();
        Self {
            moving,
            observations,
            queries,
            parts,
            layout,
            quantities,
            uncertainty,
            needs_smooth,
            n_neighbours,
        }
    }
}

impl Room {
    pub(super) fn new(fit: &Fit<'_>, set: InstructionSet) -> Self {
        let (dimension, count) = (fit.queries.dimension(), fit.n_neighbours);
        Self {
            set,
            batch: Batch::new(&fit.observations, fit.parts, count, set.n_lanes()),
            workspace: Workspace::new(dimension, count, fit.parts),
            nearest: Vec::with_capacity(count + 1),
            sums: vec![0.0; fit.parts.n_numbers(dimension)],
            functionals: Vec::with_capacity(set.n_lanes() * fit.parts.n_functionals),
        }
    }

    /// Loads the neighbourhoods of `n_queries` consecutive queries from `first` on, one in each lane.
    ///
    /// # Errors
    /// [`NumericsError::KernelNotSmooth`] if a query is a point of the cloud and that is refused.
    pub(super) fn put(&mut self, fit: &Fit<'_>, first: usize, n_queries: usize) -> Result<()> {
        let LocalKriging { system, near, .. } = fit.moving;
        self.functionals.clear();
        for lane in 0..n_queries {
            let (query, count) = (first + lane, self.batch.count);
            let x = fit.queries.point(query);
            near.nearest_into(system, x, count, &mut self.nearest);
            let coinciding = |n: &&Neighbour| system.cloud().point(n.point) == x;
            if let Some(found) = self.nearest.iter().find(coinciding).filter(|_| fit.needs_smooth) {
                return Err(NumericsError::KernelNotSmooth { query, point: found.point });
            }
            self.batch.put(lane, x, &self.nearest, &fit.observations);
            if let Quantities::Functionals { of, .. } = &fit.quantities {
                let sized = of(query)
                    .into_iter()
                    .map(|functional| ScaledFunctional::of(&functional, system.kernel()));
                let first = self.functionals.len();
                self.functionals.extend(sized);
                self.batch.put_functionals(lane, &self.functionals[first..], system.kernel());
            }
        }
        (n_queries..self.set.n_lanes()).for_each(|lane| self.batch.copy_lane(0, lane));
        Ok(())
    }

    /// Reads the results of one query into `sums`.
    fn read(&mut self, lane: usize) {
        let numbers = self.workspace.found[lane..].iter().step_by(self.set.n_lanes());
        self.sums.iter_mut().zip(numbers).for_each(|(sum, number)| *sum = *number);
    }
}

impl Fit<'_> {
    /// Evaluates the queries of a batch and returns at how many of them neighbours were left out.
    ///
    /// Writes `jets`, `[queries, width]`, and `sure`, laid out as [`Raw::sure`](super::Raw::sure).
    ///
    /// # Errors
    /// [`NumericsError::Overflow`]. [`NumericsError::NotPositiveDefinite`] if a variance is below −τ.
    pub(super) fn answer(
        &self,
        room: &mut Room,
        first: usize,
        jets: &mut [f64],
        sure: &mut [f64],
    ) -> Result<usize> {
        let kernel = self.moving.system.kernel();
        let parts = self.parts;
        room.set.dispatch(Krige { batch: &room.batch, kernel, parts, workspace: &mut room.workspace });
        let places = RowOffsets::of(self.queries.dimension());
        let mut n_thinned = 0;
        let slots = jets.chunks_exact_mut(self.layout.width());
        for (lane, (jet, sure)) in slots.zip(sure.chunks_exact_mut(1 + parts.n_quantities())).enumerate() {
            let query = first + lane;
            room.read(lane);
            self.layout.finish(kernel, &room.sums, jet);
            // The sum for the value, unlike the others, contains the kernel's variance already.
            jet[0] = room.sums[0];
            if jet.iter().any(|x| !x.is_finite()) {
                return Err(NumericsError::Overflow { query });
            }
            n_thinned += usize::from(room.sums[places.n_dependent] > 0.0);
            if parts.variances {
                sure[0] = kernel.at_zero() - room.sums[places.explained];
                self.check_is_rounding(query, sure[0], room.sums[places.norm_squared], &room.batch)?;
                sure[0] += self.of_mean(query, Quantity::Value, &room.sums, 0);
            }
            for (at, slot) in sure[1..].iter_mut().enumerate() {
                let quantity = self.quantities.get(&room.functionals, lane, at);
                let explained = room.sums[places.of_quantities() + at];
                let unexplained = self.of_mean(query, quantity, &room.sums, 1 + at);
                let variance = quantity.prior_variance(kernel) - explained + unexplained;
                // NaN propagates.
                *slot = if variance < 0.0 { -0.0 } else { quantity.unit() * variance.sqrt() };
            }
            if sure[1..].iter().any(|deviation| !deviation.is_finite()) {
                return Err(NumericsError::Overflow { query });
            }
        }
        Ok(n_thinned)
    }

    /// Returns the part of a variance that is due to the unknown mean: `hᵀCh`.
    ///
    /// h is the part of the mean's functions that the neighbours do not explain. C is the covariance of the
    /// functions' coefficients (Rasmussen and Williams 2006, eq. 2.42). `place` is that of the quantity: 0
    /// for the value, then the others in order.
    fn of_mean(&self, query: usize, quantity: Quantity<'_>, sums: &[f64], place: usize) -> f64 {
        let Some(TrendUncertainty { basis, covariance }) = self.uncertainty else { return 0.0 };
        let mut unexplained = quantity.on_mean(basis, self.queries.point(query));
        let first = RowOffsets::of(self.queries.dimension()).of_functions(&self.parts) + place;
        let explained = sums[first..].iter().step_by(1 + self.parts.n_quantities());
        unexplained.iter_mut().zip(explained).for_each(|(h, explained)| *h -= explained);
        let rows = covariance.chunks_exact(unexplained.len());
        let form: f64 = unexplained.iter().zip(rows).map(|(h, row)| h * dot(row, &unexplained)).sum();
        self.moving.system.kernel().variance() * form
    }

    /// Checks that a negative variance is at least −τ, the tolerance of [`LocalKriging::at`].
    fn check_is_rounding(&self, query: usize, variance: f64, norm_squared: f64, batch: &Batch) -> Result<()> {
        if variance >= 0.0 {
            return Ok(());
        }
        let k0 = self.moving.system.kernel().at_zero();
        // An upper bound of the norm of the matrix, since no entry of K exceeds k₀.
        let norm = batch.count as f64 * k0 + batch.noise.iter().copied().fold(0.0, f64::max);
        if -variance <= 4.0 * f64::EPSILON * (k0 + norm * norm_squared) {
            return Ok(());
        }
        let minimum_alpha = 4.0 * batch.count as f64 * f64::EPSILON * norm;
        let reason = NotDefinite::NegativeVariance { query, variance };
        Err(NumericsError::NotPositiveDefinite { reason, minimum_alpha })
    }
}
