//! Kriging in a moving neighbourhood: value, derivatives and variance at a query from its nearest points.
//!
//! Nothing is factorized beforehand, and the work grows only with the number of queries. So clouds may have
//! any size.
//!
//! Let N be the nearest points of a query q and `w = (K_NN + α_N)⁻¹ k(N, q)`. The mean is `wᵀy_N` and the
//! variance `k₀ − wᵀk(N, q)`, the posterior given only these values (Chilès and Delfiner 2012, sec. 3.6). If
//! the cloud has at most [`NEIGHBOURS`] points, every neighbourhood is the whole cloud, and this is the dense
//! posterior.
//!
//! Points whose correlation with the query is below 2⁻⁵⁰⁰ are ignored. Far from all points, the posterior
//! mean is therefore exactly the mean of the process.
//!
//! Gradient and Hessian are exact for the function that the neighbours of the query define. Queries with
//! different neighbours use different functions.

mod batch;
mod coarse;
mod enough;
mod fit;
mod kriging;
mod near;
mod parts;
pub(crate) mod price;
mod quantities;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::deviations::JetDeviations;
use super::posterior::Variances;
use crate::error::{NumericsError, Result};
use crate::machine::instruction_set::InstructionSet;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::points::sampling::Sampling;
use crate::regression::solver::System;
use crate::regression::solver::trend::Trend;
use crate::regression::sums::jets::{JetOrder, Jets};
pub use coarse::Coarse;
use fit::{Fit, Room};
use near::Near;
pub(crate) use quantities::Functionals;
use quantities::Quantities;

/// Points of a neighbourhood.
///
/// For Matérn 3/2 in three dimensions with little noise, means are within 3 to 5 % of the deviation of the
/// dense posterior. With 64 points they are within 9 to 13 % (docs/scale.md).
pub const NEIGHBOURS: usize = 128;

/// Local kriging of a system: a small solve around each query.
///
/// ```
/// # use std::sync::Arc;
/// # use gramian_numerics::kernel::{Family, Kernel};
/// # use gramian_numerics::observer::Unobserved;
/// # use gramian_numerics::points::cloud::Cloud;
/// # use gramian_numerics::regression::solver::{Solver, System};
/// # use gramian_numerics::regression::sums::regularization::Regularization;
/// use gramian_numerics::regression::function::local_kriging::{LocalKriging, KrigingRequest};
/// use gramian_numerics::points::sampling::Sampling;
/// use gramian_numerics::regression::sums::jets::JetOrder;
///
/// // Nothing is factorized beforehand: a cloud may have a million points.
/// let cloud = Arc::new(Cloud::new((0..20).map(|i| f64::from(i) / 19.0).collect(), 1)?);
/// let kernel = Kernel::new(Family::Matern { order: 2 }, 0.5, 1.0)?;
/// let system = System::new(cloud, kernel, Regularization::uniform(1e-8)?)?;
/// let sampling = Arc::new(Sampling::of(system.cloud(), &Unobserved)?);
/// let values: Vec<f64> = system.cloud().points().map(|x| x[0].sin()).collect();
/// let kriging = LocalKriging::new(system, sampling, &Unobserved)?;
/// let request =
///     KrigingRequest { order: JetOrder::Value, has_variances: true, has_deviations: false, trend: None };
/// let found = kriging.at(&values, &Cloud::new(vec![0.3], 1)?, request, &Unobserved)?;
/// assert!((found.jets.values()[0] - 0.3f64.sin()).abs() < 1e-4);
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
pub struct LocalKriging {
    system: System,
    near: Near,
}

/// A request for jets at queries, with variances or deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KrigingRequest<'a> {
    pub order: JetOrder,
    /// Whether variances of the latent function are wanted.
    pub has_variances: bool,
    /// Whether deviations of the jet are wanted, derivatives included.
    pub has_deviations: bool,
    /// The mean of the function, if it has one.
    pub trend: Option<&'a Trend>,
}

/// Jets at queries, with variances or deviations.
pub struct KrigingAnswer {
    pub jets: Jets,
    /// Variances of the latent function, if asked for.
    pub variances: Option<Variances>,
    /// Deviations of the jets, if asked for.
    pub deviations: Option<JetDeviations>,
    /// Queries where neighbours were left out, since within rounding they follow from nearer ones.
    pub n_dependent: usize,
}

/// A request for jets at queries with the deviations of functionals of their derivatives.
#[derive(Clone, Copy)]
pub(crate) struct FunctionalsRequest<'a> {
    /// Order of the jets. The functionals use derivatives up to this order.
    pub(crate) order: JetOrder,
    pub(crate) functionals: Functionals<'a>,
    /// Functionals per query.
    pub(crate) count: usize,
    /// The mean of the function, if it has one.
    pub(crate) trend: Option<&'a Trend>,
}

/// Jets at queries, with the deviations of functionals of their derivatives.
pub(crate) struct KrigedFunctionals {
    pub(crate) jets: Jets,
    /// Deviations of the functionals, `[m, count]`.
    pub(crate) deviations: Vec<f64>,
    /// Queries where neighbours were left out, since within rounding they follow from nearer ones.
    pub(crate) n_dependent: usize,
}

impl LocalKriging {
    /// Prepares local kriging of a system, given the sampling of its cloud.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn new(system: System, sampling: Arc<Sampling>, observer: &dyn Observer) -> Result<Self> {
        let near = match system.kernel().stretched_cloud(system.cloud()) {
            None => Near::Sampled(sampling),
            Some(cloud) => Near::Stretched(Neighbours::of(&cloud, observer)?),
        };
        Ok(Self { system, near })
    }

    pub fn system(&self) -> &System {
        &self.system
    }

    /// Points per neighbourhood.
    pub fn n_neighbours(&self) -> usize {
        NEIGHBOURS.min(self.system.n_points())
    }

    /// Bytes held on the heap, including those of the cloud and its sampling.
    pub fn n_bytes(&self) -> usize {
        self.system.n_bytes() + self.near.n_bytes()
    }

    /// Evaluates at queries `[m, d]` for values `[n]`, unit V.
    ///
    /// Variances and deviations include the uncertainty of the mean.
    ///
    /// A negative variance is set to 0 and reported, but only if it is at least −τ. Here
    /// `τ = 4ε(k₀ + (k k₀ + max α)|w|²)`, with k the number of neighbours.
    ///
    /// # Errors
    /// - `NumericsError::DimensionMismatch`, `NumericsError::LengthMismatch`.
    /// - `NumericsError::KernelNotSmooth` if derivatives are requested at a point of the cloud and the
    ///   kernel has a kink there.
    /// - `NumericsError::DerivativesVary` if deviations are requested derivatives that the process lacks.
    /// - `NumericsError::NotPositiveDefinite` if a variance is below −τ.
    /// - `NumericsError::Overflow`, `NumericsError::Cancelled`.
    pub fn at(
        &self,
        values: &[f64],
        queries: &Cloud,
        request: KrigingRequest<'_>,
        observer: &dyn Observer,
    ) -> Result<KrigingAnswer> {
        self.at_with(InstructionSet::best(), values, queries, request, observer)
    }

    fn at_with(
        &self,
        set: InstructionSet,
        values: &[f64],
        queries: &Cloud,
        request: KrigingRequest<'_>,
        observer: &dyn Observer,
    ) -> Result<KrigingAnswer> {
        let (kernel, d, order) = (self.system.kernel(), queries.dimension(), request.order.degree());
        let quantities = if request.has_deviations {
            Quantities::derivatives(kernel, d, order)?
        } else {
            Quantities::none()
        };
        let asked = BatchedRequest { set, request, quantities, n_neighbours: self.n_neighbours() };
        let Raw { jets, mut sure, n_sure, n_dependent } = self.run(values, queries, asked, observer)?;
        let variances = clamped(sure.iter().step_by(n_sure).copied().collect());
        let deviations = request.has_deviations.then(|| {
            let values = sure.iter_mut().step_by(n_sure).zip(&variances.latent);
            values.for_each(|(slot, variance)| *slot = if *slot < 0.0 { -0.0 } else { variance.sqrt() });
            let clamped = of_clamped(&mut sure, n_sure);
            JetDeviations { clamped, ..JetDeviations::of_packed(&sure, d, order) }
        });
        let variances = request.has_variances.then_some(variances);
        Ok(KrigingAnswer { jets, variances, deviations, n_dependent })
    }

    /// Evaluates jets at queries, with the deviations `[m, count]` of functionals of their derivatives.
    ///
    /// # Errors
    /// Returns the errors of [`LocalKriging::at`].
    pub(crate) fn functionals_at(
        &self,
        values: &[f64],
        queries: &Cloud,
        asked: FunctionalsRequest<'_>,
        observer: &dyn Observer,
    ) -> Result<KrigedFunctionals> {
        let FunctionalsRequest { order, functionals, count, trend } = asked;
        let quantities = Quantities::functionals(self.system.kernel(), functionals, count, order.degree())?;
        let request = KrigingRequest { order, has_variances: false, has_deviations: false, trend };
        let (set, n_neighbours) = (InstructionSet::best(), self.n_neighbours());
        let asked = BatchedRequest { set, request, quantities, n_neighbours };
        let Raw { jets, sure, n_sure, n_dependent } = self.run(values, queries, asked, observer)?;
        let deviations = sure.chunks_exact(n_sure).flat_map(|sure| &sure[1..]).map(|s| s.abs()).collect();
        Ok(KrigedFunctionals { jets, deviations, n_dependent })
    }

    fn run(
        &self,
        values: &[f64],
        queries: &Cloud,
        asked: BatchedRequest<'_>,
        observer: &dyn Observer,
    ) -> Result<Raw> {
        let (set, trend) = (asked.set, asked.request.trend);
        let cloud = self.system.cloud();
        cloud.check_same_dimension(queries)?;
        cloud.check_one_per_point(values)?;
        observer.enter(Stage::Evaluate);
        let (m, lanes) = (queries.n_points(), set.n_lanes());
        let values = match trend {
            None => Cow::Borrowed(values),
            Some(trend) => Cow::Owned(trend.removed_from(values, cloud)),
        };
        let fit = Fit::new(self, &values, queries, asked);
        let (width, n_sure) = (fit.layout.width(), 1 + fit.parts.n_quantities());
        let (mut packed, mut sure) = (vec![0.0; m * width], vec![0.0; m * n_sure]);
        let n_dependent = AtomicUsize::new(0);
        let slots = packed.par_chunks_mut(lanes * width).zip(sure.par_chunks_mut(lanes * n_sure));
        slots.enumerate().try_for_each_init(
            || Room::new(&fit, set),
            |room, (batch, (jets, sure))| {
                observer.checkpoint()?;
                room.put(&fit, batch * lanes, sure.len() / n_sure)?;
                n_dependent.fetch_add(fit.answer(room, batch * lanes, jets, sure)?, Ordering::Relaxed);
                Ok::<_, NumericsError>(())
            },
        )?;
        let jets = Jets::of(fit.layout, packed);
        let jets = match trend {
            None => jets,
            Some(trend) => jets.plus_linear(queries, &trend.gradient(), |x| trend.at(x)),
        };
        Ok(Raw { jets, sure, n_sure, n_dependent: n_dependent.into_inner() })
    }
}

/// A request to [`LocalKriging::run`], which splits it into batches.
struct BatchedRequest<'a> {
    set: InstructionSet,
    request: KrigingRequest<'a>,
    quantities: Quantities<'a>,
    /// Points per neighbourhood.
    n_neighbours: usize,
}

/// The joined results of all batches.
struct Raw {
    jets: Jets,
    /// The variance of the value, then the deviations of the other quantities, `[m, n_sure]`.
    ///
    /// Rounding may make a variance negative. That of the value is kept so, and any other deviation is then
    /// −0.
    sure: Vec<f64>,
    n_sure: usize,
    n_dependent: usize,
}

/// Returns the queries with a deviation of −0, the mark of a negative variance, and turns each −0 into 0.
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

/// Sets negative variances to 0 and lists their queries.
fn clamped(mut latent: Vec<f64>) -> Variances {
    let clamped = (0..latent.len()).filter(|&query| latent[query] < 0.0).collect();
    latent.iter_mut().for_each(|variance| *variance = variance.max(0.0));
    Variances { latent, clamped }
}
