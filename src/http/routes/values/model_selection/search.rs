//! The search of a model selection: from the free parameters of a request to the numerics, and back to an
//! answer.

use std::sync::Arc;

use super::rows::Rows;
use super::{
    AlphaScore, FamilyScore, FreeParameter, LeaveOneOutPredictions, MAX_PATH_POINTS, ModelSelectionRequest,
    ModelSelectionResponse, N_ALPHAS, SelectionCriterion, SelectionParameter,
};
use crate::http::fields::kernel::nu_of;
use crate::http::fields::{KernelFamily, KernelUsed};
use crate::http::problem::{Problem, from_numerics};
use crate::http::serve::fitted::Fits;
use crate::http::serve::plan::Values;
use crate::http::serve::planner::check_seed;
use gramian_host::compute::JobObserver;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::json::Nullable;
use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::{Family, Kernel, MAX_MATERN_ORDER, WendlandSmoothness};
use gramian_numerics::machine::price::Price;
use gramian_numerics::model::Report;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::selection::{
    CloudSize, Criterion, Hyperparameters, LeaveOneOut, MAX_EVALUATIONS, Observations, Parameter, ScalePrior,
    SearchResult, SearchSize, Selection, Variation, alpha_path, alpha_path_price, default_alphas,
    expected_evaluations, leave_one_out_price, leave_one_out_with, select, selection_price,
};
use gramian_numerics::regression::solver::trend::Trend;
use gramian_numerics::regression::sums::regularization::Regularization;

const BEYOND_KERNELS: &str =
    "the variance of the values is outside the range of kernels, 1e-140 to 1e140; scale the values";

/// Default number of further starts.
const RESTARTS: u8 = 2;
const MAX_RESTARTS: u8 = 100;

/// Factor from the start to the default bounds of length scale and variance, and to the upper bound of alpha.
const RANGE: f64 = 100.0;

/// Factor from the start down to the default lower bound of alpha.
const RANGE_OF_ALPHA: f64 = 1e6;

/// Largest number of entries of `vary`. There are fewer parameters, even with an entry per axis.
const MAX_VARY: usize = 64;

/// The checked options of a search.
pub struct Search {
    criterion: Criterion,
    vary: Option<Vec<FreeParameter>>,
    /// The smallest and the largest order ν − ½, if ν varies.
    orders: Option<(u8, u8)>,
    families: Vec<KernelFamily>,
    restarts: usize,
    seed: u64,
}

/// A checked request for a model selection.
pub struct Work {
    pub(super) values: Arc<Values>,
    pub(super) search: Search,
}

impl Search {
    /// Checks the options of a request.
    ///
    /// # Errors
    /// 422 for invalid restarts, seed, families or entries of `vary`.
    pub(super) fn of(request: &ModelSelectionRequest) -> Result<Self, Problem> {
        let restarts = request.restarts.unwrap_or(RESTARTS);
        if restarts > MAX_RESTARTS {
            let detail = format!("restarts must be at most {MAX_RESTARTS}");
            return Err(Problem::invalid_request("/restarts", detail));
        }
        check_seed(request.seed.unwrap_or_default(), "/seed")?;
        let families = request.families.clone().unwrap_or_default();
        if let Some(at) = (1..families.len()).find(|&at| families[..at].contains(&families[at])) {
            return Err(Problem::invalid_request(format!("/families/{at}"), "list each family once"));
        }
        let vary = request.vary.as_deref().unwrap_or_default();
        if vary.len() > MAX_VARY {
            let detail = format!("vary has {} entries; at most {MAX_VARY} are allowed", vary.len());
            return Err(Problem::invalid_request("/vary", detail));
        }
        check_axes(vary)?;
        let orders = orders(vary)?;
        let lacks_matern = !families.is_empty() && !families.contains(&KernelFamily::Matern);
        if let Some(at) = vary.iter().position(is_nu).filter(|_| lacks_matern) {
            let detail = "only matern has nu: add it to families, or leave this out";
            return Err(Problem::invalid_request(format!("/vary/{at}"), detail));
        }
        Ok(Self {
            criterion: match request.criterion.unwrap_or_default() {
                SelectionCriterion::MarginalLikelihood => Criterion::MarginalLikelihood,
                SelectionCriterion::LeaveOneOut => Criterion::LeaveOneOut,
                SelectionCriterion::GeneralizedCrossValidation => Criterion::GeneralizedCrossValidation,
            },
            orders,
            vary: request.vary.clone(),
            families,
            restarts: usize::from(restarts),
            seed: request.seed.unwrap_or_default(),
        })
    }

    /// Checks the axes of `vary` against the dimension of the points.
    ///
    /// # Errors
    /// 422 for an axis that the points do not have.
    pub(super) fn check_axes_of(&self, dimension: usize) -> Result<(), Problem> {
        let is_beyond = |free: &FreeParameter| free.axis.is_some_and(|axis| axis >= dimension);
        match self.vary.iter().flatten().position(is_beyond) {
            None => Ok(()),
            Some(at) => {
                let detail = format!("the points have the axes 0 to {}", dimension - 1);
                Err(Problem::invalid_request(format!("/vary/{at}/axis"), detail))
            }
        }
    }

    /// Returns the expected price of the search, from the number of evaluations that descents usually take.
    pub(super) fn price(&self, n: usize, d: usize, n_length_scales: usize) -> Price {
        let is_of_axes =
            |free: &FreeParameter| free.parameter == SelectionParameter::LengthScales && free.axis.is_none();
        let n_free = match &self.vary {
            None => 2 + n_length_scales,
            Some(vary) => vary.iter().map(|free| if is_of_axes(free) { d } else { 1 }).sum(),
        };
        let (n_families, n_starts) = (self.n_families(), 1 + self.restarts);
        let n_evaluations = expected_evaluations(n_free);
        let n_threads = rayon::current_num_threads();
        let size = SearchSize { n_free, n_evaluations, n_families, n_starts, n_threads };
        let cloud = CloudSize { n_points: n, dimension: d };
        let price = selection_price(cloud, self.criterion, size).and(leave_one_out_price(n, 1 + d));
        if n <= MAX_PATH_POINTS {
            price.and(alpha_path_price(cloud, self.criterion, 1 + d, N_ALPHAS))
        } else {
            price
        }
    }

    /// Returns the number of families to try, or one more where the start may be a Matérn kernel itself.
    fn n_families(&self) -> usize {
        let Some((least, most)) = self.orders else { return self.families.len().max(1) };
        let n_others = self.families.iter().filter(|family| **family != KernelFamily::Matern).count();
        n_others.max(usize::from(self.families.is_empty())) + usize::from(most - least) + 1
    }

    /// Returns the families to try. A family that is also that of the start keeps the parameters of the
    /// start.
    fn families(&self, start: Family) -> Vec<Family> {
        let given = |family: &KernelFamily| match (family, start) {
            (KernelFamily::Gauss, _) => vec![Family::Gauss],
            (KernelFamily::InverseMultiquadric, _) => vec![Family::InverseMultiquadric],
            (KernelFamily::Laplace, Family::Laplace { .. })
            | (KernelFamily::Wendland, Family::Wendland { .. }) => {
                vec![start]
            }
            (KernelFamily::Laplace, _) => vec![Family::Laplace { epsilon: 0.0 }],
            (KernelFamily::Wendland, _) => vec![Family::Wendland { smoothness: WendlandSmoothness::C4 }],
            (KernelFamily::Matern, _) => self.matern(start),
        };
        if !self.families.is_empty() {
            self.families.iter().flat_map(given).collect()
        } else if matches!(start, Family::Matern { .. }) {
            self.matern(start)
        } else if self.orders.is_some() {
            [vec![start], self.matern(start)].concat()
        } else {
            vec![start]
        }
    }

    fn matern(&self, start: Family) -> Vec<Family> {
        match (self.orders, start) {
            (Some((least, most)), _) => (least..=most).map(|order| Family::Matern { order }).collect(),
            (None, Family::Matern { .. }) => vec![start],
            (None, _) => vec![Family::Matern { order: 2 }],
        }
    }

    /// Returns the start with one length scale, the geometric mean, if that is to vary and learning found one
    /// for each axis.
    fn sharing(&self, start: Hyperparameters) -> Hyperparameters {
        let shares = |free: &FreeParameter| free.parameter == SelectionParameter::LengthScale;
        if !self.vary.iter().flatten().any(shares) {
            return start;
        }
        let logarithms = start.length_scales.iter().map(|length_scale| length_scale.ln());
        let shared = (logarithms.sum::<f64>() / start.length_scales.len() as f64).exp();
        Hyperparameters { length_scales: vec![shared], ..start }
    }

    /// Returns the free parameters other than ν, each with its position in `vary`.
    fn variations(&self, start: &Hyperparameters) -> Vec<(usize, Variation)> {
        let Some(vary) = &self.vary else { return default_variations(start) };
        let variation = |(at, free): (usize, &FreeParameter)| {
            let parameter = match free.parameter {
                SelectionParameter::LengthScale => Parameter::LengthScale,
                SelectionParameter::LengthScales => {
                    free.axis.map_or(Parameter::LengthScales, Parameter::LengthScaleOfAxis)
                }
                SelectionParameter::Variance => Parameter::Variance,
                SelectionParameter::Alpha => Parameter::Alpha,
                SelectionParameter::Epsilon => Parameter::Epsilon,
                SelectionParameter::Nu => return None,
            };
            Some((at, Variation { parameter, min: free.min, max: free.max }))
        };
        vary.iter().enumerate().filter_map(variation).collect()
    }
}

/// Returns the default variations: length scale, variance and noise around the start.
fn default_variations(start: &Hyperparameters) -> Vec<(usize, Variation)> {
    let between = |parameter: Parameter, min: f64, max: f64| {
        let (least, greatest) = parameter.range();
        Variation { parameter, min: min.clamp(least, greatest), max: max.clamp(least, greatest) }
    };
    let about = |parameter, x: f64| between(parameter, x / RANGE, x * RANGE);
    let mut variations: Vec<Variation> = match start.length_scales[..] {
        [length_scale] => vec![about(Parameter::LengthScale, length_scale)],
        ref all => {
            let axes = all.iter().enumerate();
            axes.map(|(axis, &scale)| about(Parameter::LengthScaleOfAxis(axis), scale)).collect()
        }
    };
    variations.push(about(Parameter::Variance, start.variance));
    if let Regularization::Uniform(alpha) = start.noise {
        // A start without noise does not say how much noise there may be, so the variance sets the scale.
        let least = alpha.max(start.variance / RANGE_OF_ALPHA) / RANGE_OF_ALPHA;
        variations.push(between(Parameter::Alpha, least, RANGE * alpha.max(start.variance)));
    }
    variations.into_iter().enumerate().collect()
}

/// Checks that only `length_scales` have an axis.
///
/// # Errors
/// 422 for another parameter with an axis.
fn check_axes(vary: &[FreeParameter]) -> Result<(), Problem> {
    let is_wrong =
        |free: &FreeParameter| free.axis.is_some() && free.parameter != SelectionParameter::LengthScales;
    match vary.iter().position(is_wrong) {
        None => Ok(()),
        Some(at) => {
            let detail = "only length_scales have an axis";
            Err(Problem::invalid_request(format!("/vary/{at}/axis"), detail))
        }
    }
}

fn is_nu(free: &FreeParameter) -> bool {
    free.parameter == SelectionParameter::Nu
}

/// Returns the smallest and the largest order ν − ½ within the bounds on ν, or `None` if ν does not vary.
fn orders(vary: &[FreeParameter]) -> Result<Option<(u8, u8)>, Problem> {
    let Some(at) = vary.iter().position(is_nu) else { return Ok(None) };
    let FreeParameter { min, max, .. } = vary[at];
    let (least, most) = ((min - 0.5).ceil(), (max - 0.5).floor());
    let is_twice = vary[at + 1..].iter().any(is_nu);
    if is_twice || !(0.0 <= least && least <= most && most <= f64::from(MAX_MATERN_ORDER)) {
        let detail = "nu varies once, between 0.5 and 8.5, over at least one of 0.5, 1.5, ..., 8.5";
        return Err(Problem::invalid_request(format!("/vary/{at}"), detail));
    }
    Ok(Some((least as u8, most as u8)))
}

impl Work {
    /// Searches, and computes the path and the leave-one-out predictions of the selection.
    ///
    /// # Errors
    /// Returns errors of the numerics as a [`Problem`].
    pub(super) fn run(self, fits: &Fits, observer: &JobObserver) -> Result<ModelSelectionResponse, Problem> {
        let Self { values, search } = self;
        let plan = &fits.main.plan;
        let Interpolant { solver, solution } = fits.interpolant(&values, observer)?;
        let scale = plan.process.scale;
        let report = Report::of_function(&solver, &solution, scale);
        let mut diagnostics = fits.main.diagnostics(&report, plan.stored.cloud.n_points());
        let start = scaled(solver.kernel(), solver.regularization(), scale);
        let start = start.map_err(|error| {
            if plan.process.is_learned {
                Problem::invalid_request("/values", BEYOND_KERNELS)
            } else {
                plan.refused(error)
            }
        })?;
        let start = if plan.process.is_learned { search.sharing(start) } else { start };
        let variations = search.variations(&start);
        let vary: Vec<Variation> = variations.iter().map(|(_, variation)| *variation).collect();
        let finds_noise = vary.iter().any(|variation| variation.parameter == Parameter::Alpha);
        let rows = Rows::of(plan, &values.list, finds_noise);
        rows.warn(&mut diagnostics);
        let (cloud, mean) = (&*rows.cloud, plan.process.mean);
        let selection = Selection {
            observations: Observations { cloud, values: &rows.values, mean },
            criterion: search.criterion,
            start: &start,
            vary: &vary,
            prior: ScalePrior::JointlyRobust,
            families: &search.families(start.family),
            restarts: search.restarts,
            seed: search.seed,
            max_evaluations: MAX_EVALUATIONS,
        };
        // The numerics counts entries without `nu`, which the request may have in between.
        let refused = |error| match error {
            NumericsError::InvalidVariation { entry, requirement } => {
                let entry = variations.get(entry).map_or(entry, |(at, _)| *at);
                from_numerics(NumericsError::InvalidVariation { entry, requirement }, plan.pointers)
            }
            // The search runs in the unit of the values, so its errors are not scaled.
            other => from_numerics(other, plan.pointers),
        };
        let selected = select(&selection, observer).map_err(refused)?;
        let left_out = leave_one_out_with(selection.observations, &selected.hyperparameters, observer);
        let alpha_path = path_over_alpha(&selection, &selected.hyperparameters, observer).map_err(refused)?;
        let n_given = search.vary.as_ref().map_or(variations.len(), Vec::len);
        let score_gradient = score_gradient(&selected, &variations, n_given);
        let kernel = selected.hyperparameters.kernel_on(cloud).map_err(refused)?;
        let noise = &selected.hyperparameters.noise;
        Ok(ModelSelectionResponse {
            kernel: KernelUsed::from(&kernel),
            alpha: match noise {
                Regularization::Uniform(alpha) => Some(*alpha),
                Regularization::PerPoint(_) => None,
            },
            mean_coefficients: selected.trend.as_ref().map(Trend::of_coordinates).map(|coefficients| {
                let p = coefficients.len();
                Array::new(coefficients, &[p])
            }),
            score: selected.score,
            score_gradient,
            converged: selected.converged,
            evaluations: selected.evaluations,
            families: family_scores(&selected),
            alpha_path,
            leave_one_out: rows.left_out(left_out.map_err(refused)?).into(),
            diagnostics,
        })
    }
}

/// Returns the slopes of the selection for each of `n_given` entries of `vary`. Null for `nu`.
fn score_gradient(
    selected: &SearchResult,
    variations: &[(usize, Variation)],
    n_given: usize,
) -> Vec<Nullable> {
    let n_axes = selected.hyperparameters.length_scales.len();
    let mut gradient = vec![Nullable(None); n_given];
    let mut slopes = selected.gradient.iter();
    for (at, variation) in variations {
        let n_free = if variation.parameter == Parameter::LengthScales { n_axes } else { 1 };
        gradient[*at] = Nullable(Some(slopes.by_ref().take(n_free).sum()));
    }
    gradient
}

/// Returns the start of the search: kernel and noise in the unit of the values.
fn scaled(
    kernel: &Kernel,
    regularization: &Regularization,
    scale: f64,
) -> Result<Hyperparameters, NumericsError> {
    let kernel = kernel.with_variance(kernel.variance() * scale)?;
    let noise = match regularization {
        Regularization::Uniform(alpha) => Regularization::uniform(alpha * scale)?,
        // Noise per point is never scaled.
        per_point @ Regularization::PerPoint(_) => per_point.clone(),
    };
    Ok(Hyperparameters::of(&kernel, noise))
}

/// Computes the score over α at the selection.
///
/// The path is empty with noise per point, and for more than [`MAX_PATH_POINTS`] points.
fn path_over_alpha(
    selection: &Selection<'_>,
    at: &Hyperparameters,
    observer: &JobObserver,
) -> Result<Vec<AlphaScore>, NumericsError> {
    let is_too_large = selection.observations.cloud.n_points() > MAX_PATH_POINTS;
    if is_too_large || !matches!(at.noise, Regularization::Uniform(_)) {
        return Ok(Vec::new());
    }
    let Selection { observations, criterion, .. } = *selection;
    let cloud = observations.cloud;
    let kernel = at.kernel_on(cloud)?;
    let alphas = default_alphas(cloud.n_points(), &kernel, N_ALPHAS);
    let scores = alpha_path(observations, at, &alphas, criterion, observer)?;
    let entry = |(&alpha, score): (&f64, f64)| AlphaScore {
        alpha,
        score: Nullable(Some(score).filter(|score| score.is_finite())),
    };
    Ok(alphas.iter().zip(scores).map(entry).collect())
}

fn family_scores(selected: &SearchResult) -> Vec<FamilyScore> {
    let one = |&(family, score): &(Family, Option<f64>)| {
        let nu = if let Family::Matern { order } = family { Some(nu_of(order)) } else { None };
        FamilyScore { family: family.into(), nu, score: Nullable(score) }
    };
    selected.families.iter().map(one).collect()
}

impl From<LeaveOneOut> for LeaveOneOutPredictions {
    fn from(found: LeaveOneOut) -> Self {
        // Only points without a determined mean are null. Other numbers that are not finite left float64.
        let is_determined: Vec<bool> = found.observation_variances.iter().map(|x| !x.is_nan()).collect();
        let or_null = |list: Vec<f64>| {
            let entries = list.into_iter().zip(&is_determined);
            entries.map(|(x, is_determined)| Nullable(is_determined.then_some(x))).collect()
        };
        Self {
            means: or_null(found.means),
            variances: or_null(found.observation_variances),
            log_predictive_densities: or_null(found.log_predictive_densities),
        }
    }
}
