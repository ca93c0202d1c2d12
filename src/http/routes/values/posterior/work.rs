//! Code shared by posteriors of one list of values and of many: checks, price and computation.

use std::sync::Arc;

use super::{PosteriorQuantity as Q, PosteriorTarget, SampleOptions};
use crate::http::fields::{Diagnostics, Fit};
use crate::http::problem::Problem;
use crate::http::serve::answers::values::mean_coefficients;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::{Cost, PlannedValues, Values};
use crate::http::serve::planner::{GivenValues, Planner, RestrictedQuantity, check_seed};
use gramian_host::compute::JobObserver;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_numerics::error::{NumericsError, SolverKind};
use gramian_numerics::machine::normal::{cumulative, quantile};
use gramian_numerics::machine::price::Sizes;
use gramian_numerics::model::price::{PosteriorAsked, posterior_price};
use gramian_numerics::model::{EachAt, JetRequest, ValuesAt};
use gramian_numerics::observer::Observer;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::batch::BatchJets;
use gramian_numerics::regression::function::deviations::JetDeviations;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::function::posterior::{
    Covariance, Variances, covariance_with_mean, log_marginal_likelihood,
};
use gramian_numerics::regression::function::samples::{Root, Stream};
use gramian_numerics::regression::sums::jets::JetOrder;

/// Optional parts of an answer, beside the means.
pub struct PosteriorParts {
    pub include: Vec<Q>,
    pub samples: Option<SampleOptions>,
    pub quantiles: Option<Vec<f64>>,
    pub threshold: Option<f64>,
    /// The random quantity that samples, quantiles and probabilities are of.
    pub of: PosteriorTarget,
}

impl PosteriorParts {
    fn wants(&self, quantity: Q) -> bool {
        self.include.contains(&quantity)
    }

    /// Returns whether the variance at each query is needed.
    fn needs_variances(&self) -> bool {
        let has_bands = self.quantiles.is_some() || self.threshold.is_some();
        has_bands || self.wants(Q::Variances) || self.wants(Q::ObservationVariances)
    }

    fn needs_covariance(&self) -> bool {
        self.samples.is_some() || self.wants(Q::Covariance)
    }

    fn n_quantiles(&self) -> usize {
        self.quantiles.as_ref().map_or(0, Vec::len)
    }

    fn n_samples(&self) -> usize {
        self.samples.map_or(0, |samples| samples.count)
    }

    /// Returns a part of the answer that not every solver has, if one is requested: that which fewest have.
    fn restricted(&self) -> Option<RestrictedQuantity> {
        let not_local: &[SolverKind] = &[SolverKind::Local];
        if self.wants(Q::LogMarginalLikelihood) {
            let without: &[SolverKind] = &[SolverKind::Local, SolverKind::Iterative];
            return Some(RestrictedQuantity {
                name: "log_marginal_likelihood",
                pointer: "/include",
                without,
            });
        }
        if self.wants(Q::Covariance) {
            return Some(RestrictedQuantity { name: "covariance", pointer: "/include", without: not_local });
        }
        self.samples.map(|_| RestrictedQuantity { name: "samples", pointer: "/samples", without: not_local })
    }

    fn check(&self) -> Result<(), Problem> {
        if self.samples.is_some_and(|samples| samples.count == 0) {
            return Err(Problem::invalid_request("/samples/count", "count must be at least 1"));
        }
        if let Some(samples) = self.samples {
            check_seed(samples.seed, "/samples/seed")?;
        }
        let quantiles = self.quantiles.iter().flatten();
        match quantiles.enumerate().find(|(_, p)| !(**p > 0.0 && **p < 1.0)) {
            None => Ok(()),
            Some((at, p)) => {
                let detail = format!("quantiles need probabilities between 0 and 1, found {p}");
                Err(Problem::invalid_request(format!("/quantiles/{at}"), detail))
            }
        }
    }

    /// Returns how many deviations per query are needed for the variances of gradients.
    fn n_deviations(&self, d: usize) -> usize {
        if self.wants(Q::GradientVariances) { 1 + d } else { 0 }
    }

    /// Checks that the noise of a new observation is known if it is needed. It is known only if it is the
    /// same everywhere.
    fn check_noise(&self, plan: &PlannedValues) -> Result<(), Problem> {
        let asked = if self.wants(Q::ObservationVariances) {
            ("observation_variances", "/include")
        } else if self.of == PosteriorTarget::Observation {
            ("observation", "/of")
        } else {
            return Ok(());
        };
        if !plan.has_noise_variances() {
            return Ok(());
        }
        let (name, pointer) = asked;
        let detail = format!("{name} needs alpha: with noise_variances the noise at queries is unknown");
        Err(Problem::invalid_request(pointer, detail))
    }

    /// Returns the size of the answer in numbers, for k lists of values and m queries in d dimensions.
    fn n_numbers(&self, k: usize, m: usize, d: usize) -> Option<usize> {
        let per_list = 2 + self.n_quantiles() + if self.wants(Q::Gradients) { d } else { 0 };
        let of_lists = m.checked_mul(per_list.checked_add(self.n_samples())?)?.checked_mul(k)?;
        let of_pairs = if self.needs_covariance() { m } else { 0 };
        of_lists.checked_add(m.checked_mul(of_pairs + 2 + d)?)?.checked_add(k * (2 + d))
    }

    /// Returns the parts of the answer that its price depends on, for k lists of values in d dimensions.
    fn of_process(&self, d: usize, n_lists: usize) -> PosteriorAsked {
        PosteriorAsked {
            has_variances: self.needs_variances(),
            has_covariance: self.needs_covariance(),
            n_lists,
            n_derivatives: if self.wants(Q::Gradients) { d } else { 0 },
            n_deviations: self.n_deviations(d),
            n_samples: self.n_samples(),
        }
    }
}

/// A checked request for posteriors.
pub struct Work {
    /// `[k, n]`
    values: Arc<Values>,
    queries: Arc<Cloud>,
    asked: PosteriorParts,
}

impl Work {
    /// Plans posteriors of the values of a fit.
    ///
    /// # Errors
    /// Returns the [`Problem`] to answer with.
    pub fn plan(
        planner: &Planner<'_>,
        fit: Fit,
        given: GivenValues,
        queries: Option<Points>,
        asked: PosteriorParts,
    ) -> Result<Plan<Self>, Problem> {
        asked.check()?;
        let of_batch =
            RestrictedQuantity { name: "batches", pointer: "/solver", without: &[SolverKind::Local] };
        let restricted = asked.restricted().or(given.n_lists.map(|_| of_batch));
        let (mut main, values) = planner.values_fit(fit, given, restricted)?;
        let queries = planner.queries(queries, &mut main.on)?;
        asked.check_noise(&main)?;
        let (m, d) = (queries.n_points(), queries.dimension());
        let sizes = Sizes { n_points: main.on.n_points(), n_queries: m, dimension: d };
        let cost = Cost {
            work: posterior_price(main.solver, asked.of_process(d, values.n_lists), sizes),
            n_numbers: planner.check_answer(asked.n_numbers(values.n_lists, m, d))?,
            n_held: values.list.len() + m * d,
        };
        Ok(Plan::of_values(main, Self { values, queries, asked }, cost))
    }

    fn request(&self) -> JetRequest<'_> {
        JetRequest {
            queries: &self.queries,
            order: if self.asked.wants(Q::Gradients) { JetOrder::Gradient } else { JetOrder::Value },
            has_variances: self.asked.needs_variances(),
            deviations: self.asked.wants(Q::GradientVariances).then_some(JetOrder::Gradient),
        }
    }
}

/// The computed parts of an answer.
pub struct PosteriorArrays {
    pub means: Array,
    pub variances: Option<Array>,
    pub observation_variances: Option<Array>,
    pub covariance: Option<Array>,
    pub gradients: Option<Array>,
    pub gradient_variances: Option<Array>,
    pub samples: Option<Array>,
    pub quantiles: Option<Array>,
    pub exceedance_probabilities: Option<Array>,
    /// Log marginal likelihoods, an entry per list of values. Empty if not asked for.
    pub log_marginal_likelihoods: Vec<f64>,
    pub mean_coefficients: Option<Array>,
    pub diagnostics: Diagnostics,
}

/// Means of k lists at the queries, with variances, deviations and functions.
struct Means {
    jets: BatchJets,
    variances: Option<Variances>,
    deviations: Option<JetDeviations>,
    diagnostics: Diagnostics,
    /// The functions, an entry per list. Empty if each query has a function of its own.
    functions: Vec<Interpolant>,
    mean_coefficients: Option<Array>,
    /// The leading dimensions of arrays with a part per list: `[k]` for a batch, none for one list.
    leading: Vec<usize>,
}

impl PosteriorArrays {
    /// Computes the posterior of one list of values.
    ///
    /// # Errors
    /// Returns errors of the numerics as a [`Problem`].
    pub fn one(work: Work, fits: &Fits, observer: &JobObserver) -> Result<Self, Problem> {
        let request = work.request();
        let (found, diagnostics) = fits.values_at(&work.values, request, observer)?;
        let ValuesAt { jets, variances, deviations, interpolant, .. } = found;
        let gradients = if request.order == JetOrder::Value { Vec::new() } else { jets.gradients() };
        let jets = BatchJets { values: jets.values(), gradients, hessians: Vec::new() };
        let functions = interpolant.into_iter().collect();
        let (leading, mean_coefficients) = (Vec::new(), None);
        let means = Means { jets, variances, deviations, diagnostics, functions, mean_coefficients, leading };
        Self::of(&work, means, fits, observer)
    }

    /// Computes the posterior of each of many lists of values.
    ///
    /// # Errors
    /// Returns errors of the numerics as a [`Problem`].
    pub fn each(work: Work, fits: &Fits, observer: &JobObserver) -> Result<Self, Problem> {
        let (found, diagnostics) = fits.each_at(&work.values, work.request(), observer)?;
        let EachAt { jets, variances, deviations, batch, .. } = found;
        let leading = vec![batch.solutions.len()];
        let mean_coefficients = mean_coefficients(&batch);
        let functions = batch.interpolants().collect();
        let means = Means { jets, variances, deviations, diagnostics, functions, mean_coefficients, leading };
        Self::of(&work, means, fits, observer)
    }

    fn of(work: &Work, means: Means, fits: &Fits, observer: &JobObserver) -> Result<Self, Problem> {
        let (asked, queries, scale) = (&work.asked, &*work.queries, fits.main.plan.process.scale);
        let (m, d) = (queries.n_points(), queries.dimension());
        let Means { jets, variances, deviations, mut diagnostics, functions, mean_coefficients, leading } =
            means;
        let refused = |error| fits.main.refused(error);
        let function = || functions.first().ok_or_else(Problem::internal);
        let covariance = if asked.needs_covariance() {
            let Interpolant { solver, solution } = function()?;
            let found = covariance_with_mean(solver, solution.trend.as_ref(), queries, observer);
            Some(found.map_err(refused)?.scaled(scale))
        } else {
            None
        };
        let clamped = variances.as_ref().map(|v| &v.clamped).or(covariance.as_ref().map(|c| &c.clamped));
        let clamped = clamped.or(deviations.as_ref().map(|deviations| &deviations.clamped));
        diagnostics.warn_of_clamping(clamped.map_or(&[], Vec::as_slice));
        let shape = |of_each: &[usize]| [&leading, of_each].concat();
        // Alpha is absent with noise per point, and `check_noise` then refuses everything that needs it.
        let alpha = diagnostics.alpha.unwrap_or_default();
        let noise = if asked.of == PosteriorTarget::Observation { alpha } else { 0.0 };
        let samples = match (asked.samples, &covariance) {
            (Some(samples), Some(covariance)) => {
                let prior_variance = function()?.solver.kernel().at_zero() * scale;
                let root = Root::of(covariance, prior_variance, observer).map_err(refused)?.with_noise(noise);
                let drawn = draws(&root, &jets.values, m, samples, observer).map_err(refused)?;
                Some(Array::new(drawn, &shape(&[samples.count, m])))
            }
            (None, _) | (_, None) => None,
        };
        let gradient_variances =
            deviations.map(|found| Array::new(found.gradients.iter().map(|s| s * s).collect(), &[m, d]));
        let mut log_marginal_likelihoods = Vec::new();
        if asked.wants(Q::LogMarginalLikelihood) {
            function()?;
            for Interpolant { solver, solution } in &functions {
                log_marginal_likelihoods
                    .push(log_marginal_likelihood(solver, solution, scale).map_err(refused)?);
            }
        }
        let bands = Bands { asked, means: &jets.values, variances: variances.as_ref(), noise, m };
        Ok(Self {
            variances: bands.variances(Q::Variances, 0.0),
            observation_variances: bands.variances(Q::ObservationVariances, alpha),
            quantiles: bands
                .quantiles(observer)
                .map_err(refused)?
                .map(|found| Array::new(found, &shape(&[asked.n_quantiles(), m]))),
            exceedance_probabilities: bands
                .exceedances(observer)
                .map_err(refused)?
                .map(|found| Array::new(found, &shape(&[m]))),
            means: Array::new(jets.values, &shape(&[m])),
            covariance: covariance
                .filter(|_| asked.wants(Q::Covariance))
                .map(|Covariance { latent, .. }| Array::new(latent, &[m, m])),
            gradients: asked.wants(Q::Gradients).then(|| Array::new(jets.gradients, &shape(&[m, d]))),
            gradient_variances,
            samples,
            log_marginal_likelihoods,
            mean_coefficients,
            diagnostics,
        })
    }
}

/// Draws functions for each list, `[k, count, m]`. Each list has random numbers of its own.
fn draws(
    root: &Root,
    means: &[f64],
    m: usize,
    SampleOptions { count, seed }: SampleOptions,
    observer: &JobObserver,
) -> Result<Vec<f64>, NumericsError> {
    let mut all = Vec::with_capacity(means.len() * count);
    for (list, means) in means.chunks_exact(m).enumerate() {
        all.extend(root.draw(means, count, Stream { seed, list: list as u64 }, observer)?);
    }
    Ok(all)
}

/// Probabilities that are computed between two checkpoints: about a millisecond.
const AT_ONCE: usize = 1 << 14;

/// Normal distributions at the queries: means `[k, m]` and variances `[m]`.
struct Bands<'a> {
    asked: &'a PosteriorParts,
    means: &'a [f64],
    variances: Option<&'a Variances>,
    /// Variance added to those of the latent function.
    noise: f64,
    m: usize,
}

impl Bands<'_> {
    fn variances(&self, quantity: Q, noise: f64) -> Option<Array> {
        let variances = self.variances.filter(|_| self.asked.wants(quantity))?;
        Some(Array::new(variances.latent.iter().map(|v| v + noise).collect(), &[self.m]))
    }

    /// Returns the quantiles `μ + Φ⁻¹(p)σ`, `[k, q, m]` for q probabilities.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    fn quantiles(&self, observer: &dyn Observer) -> Result<Option<Vec<f64>>, NumericsError> {
        let (Some(variances), Some(levels)) = (self.variances, &self.asked.quantiles) else {
            return Ok(None);
        };
        let deviations: Vec<f64> = variances.latent.iter().map(|v| (v + self.noise).sqrt()).collect();
        let levels: Vec<f64> = levels.iter().map(|&p| quantile(p)).collect();
        let mut quantiles = Vec::with_capacity(self.means.len() * levels.len());
        for means in self.means.chunks_exact(self.m) {
            for z in &levels {
                observer.checkpoint()?;
                quantiles.extend(means.iter().zip(&deviations).map(|(mean, s)| mean + z * s));
            }
        }
        Ok(Some(quantiles))
    }

    /// Returns the probabilities `Φ((μ − t)/√(σ² + σ₀²))` of exceeding the threshold t, `[k, m]`. σ₀² is the
    /// noise.
    ///
    /// Where σ² + σ₀² is 0, the probability is 1 for means above the threshold, else 0.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    fn exceedances(&self, observer: &dyn Observer) -> Result<Option<Vec<f64>>, NumericsError> {
        let (Some(variances), Some(threshold)) = (self.variances, self.asked.threshold) else {
            return Ok(None);
        };
        let of_one = |(mean, variance): (&f64, &f64)| {
            let deviation = (variance + self.noise).sqrt();
            if deviation > 0.0 {
                cumulative((mean - threshold) / deviation)
            } else {
                f64::from(u8::from(*mean > threshold))
            }
        };
        let mut probabilities = Vec::with_capacity(self.means.len());
        for means in self.means.chunks_exact(self.m) {
            for (means, variances) in means.chunks(AT_ONCE).zip(variances.latent.chunks(AT_ONCE)) {
                observer.checkpoint()?;
                probabilities.extend(means.iter().zip(variances).map(of_one));
            }
        }
        Ok(Some(probabilities))
    }
}
