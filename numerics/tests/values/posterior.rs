//! Coverage of the 95 % bands of posteriors with default parameters.

#![allow(dead_code, reason = "the example prints what the test does not ask")]

use std::sync::Arc;

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::duplicates::{Merge, RowCopy, row_copies};
use gramian_numerics::points::sampling::Sampling as Spacings;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::function::posterior::variances_with_mean;
use gramian_numerics::regression::selection::{
    Criterion, Hyperparameters, LearnedModel, MAX_EVALUATIONS, Noise, Observations, ObservedCloud, Parameter,
    ScalePrior, Selection, Variation, learn, select,
};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{Disagreement, Solver, System};
use gramian_numerics::regression::sums::jets::JetOrder;
use gramian_numerics::regression::sums::regularization::Regularization;

use crate::common::random::Random;
use crate::fields::Field;

const N_QUERIES: usize = 200;

/// Sensors in a cube, a square or an interval.
#[derive(Debug, Clone, Copy)]
pub struct Sensors {
    pub dimension: usize,
    pub n_points: usize,
    pub field: Field,
    /// Standard deviation of the noise over that of the field.
    pub noise: f64,
    pub factor: f64,
    pub offset: f64,
}

/// The way in which kernel, noise and variance are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum By {
    /// The default for requests that name none of them.
    Default,
    /// A search for the best by a criterion, among the same families.
    Criterion(Criterion),
}

/// Coverage and error over several draws.
#[derive(Debug, Clone, Copy, Default)]
pub struct DrawSummary {
    /// Percentage of the true values within ±1.96 deviations.
    pub coverage: f64,
    /// Root mean square error over the spread of the field.
    pub error: f64,
}

const FAMILIES: [Family; 3] = [Family::Matern { order: 2 }, Family::Matern { order: 4 }, Family::Gauss];

impl Sensors {
    /// Percentage of the true values within ±1.96 deviations, at random queries among the
    /// sensors, over several draws.
    pub fn coverage(&self, n_draws: usize) -> f64 {
        self.found(By::Default, n_draws).coverage
    }

    /// Coverage and error at random queries among the sensors, over several draws.
    pub fn found(&self, by: By, n_draws: usize) -> DrawSummary {
        DrawSummary::over((0..n_draws).map(|draw| self.draw(by, draw)))
    }

    fn draw(&self, by: By, draw: usize) -> Draw {
        let mut random = Random((1000 * draw + self.n_points) as u64 + 1);
        let d = self.dimension;
        let mut places =
            |n: usize| -> Vec<f64> { (0..n * d).map(|_| 2.0 * random.uniform() - 1.0).collect() };
        let (points, queries) = (places(self.n_points), places(N_QUERIES));
        let field =
            |x: &[f64]| self.field.at(std::array::from_fn(|c| x.get(c).copied().unwrap_or(0.0))).value;
        let exact: Vec<f64> = points.chunks_exact(d).map(field).collect();
        let mean = exact.iter().sum::<f64>() / exact.len() as f64;
        let spread = (exact.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / exact.len() as f64).sqrt();
        let noisy = |f: &f64| self.offset + self.factor * (f + self.noise * spread * random.normal());
        let values: Vec<f64> = exact.iter().map(noisy).collect();
        let truth = queries.chunks_exact(d).map(|x| self.offset + self.factor * field(x));
        let truth: Vec<f64> = truth.collect();
        let (cloud, at) = (Arc::new(Cloud::new(points, d).unwrap()), Cloud::new(queries, d).unwrap());

        let Posterior { means: found, variances, .. } = posterior(by, cloud, &values, &at);
        let errors: Vec<f64> = found.iter().zip(&truth).map(|(f, t)| f - t).collect();
        Draw::of(&errors, &variances, self.factor * spread)
    }
}

/// Errors at the queries of one draw.
#[derive(Debug, Clone, Copy)]
pub struct Draw {
    n_queries: usize,
    /// Number of true values within ±1.96 deviations.
    n_within: usize,
    /// Sum of the squares of the errors over the unit.
    squares: f64,
}

impl Draw {
    pub fn of(errors: &[f64], variances: &[f64], unit: f64) -> Self {
        let is_within = |&(error, variance): &(&f64, &f64)| error.abs() <= 1.96 * variance.sqrt();
        Self {
            n_queries: errors.len(),
            n_within: errors.iter().zip(variances).filter(is_within).count(),
            squares: errors.iter().map(|error| (error / unit).powi(2)).sum(),
        }
    }
}

impl DrawSummary {
    pub fn over(draws: impl Iterator<Item = Draw>) -> Self {
        let sum = draws.fold((0, 0, 0.0), |(n, within, squares), draw| {
            (n + draw.n_queries, within + draw.n_within, squares + draw.squares)
        });
        let (n, n_within, squares) = (sum.0 as f64, sum.1, sum.2);
        Self { coverage: 100.0 * n_within as f64 / n, error: (squares / n).sqrt() }
    }
}

/// Means and variances at queries.
pub struct Posterior {
    pub means: Vec<f64>,
    /// Variances of the latent function.
    pub variances: Vec<f64>,
    /// Whether the values contradict kernel and noise.
    pub has_misfit: bool,
}

pub fn posterior(by: By, cloud: Arc<Cloud>, values: &[f64], at: &Cloud) -> Posterior {
    let LearnedProcess { kernel, ratio, variance, is_contradicted, copies } = chosen(by, &cloud, values);
    let (without, merge) = Merge::copies(&cloud, &copies);
    let (cloud, values) = (Arc::new(without), &merge.mean(values)[..]);
    let alpha = Regularization::uniform(ratio).unwrap();
    let solver = System::new(cloud, kernel, alpha).and_then(|system| Solver::dense(system, &Unobserved));
    let u = Interpolant::fit_with_mean(Arc::new(solver.unwrap()), values, Mean::Constant, &Unobserved);
    let u = u.unwrap();
    let means = u.at(at, JetOrder::Value, &Unobserved).unwrap().values();
    let trend = u.solution.trend.as_ref();
    let variances = variances_with_mean(&u.solver, trend, at, &Unobserved).unwrap();
    let has_misfit = is_contradicted || u.solution.disagreement(values.len(), variance).is_some();
    Posterior { means, variances: variances.scaled(variance).latent, has_misfit }
}

struct LearnedProcess {
    /// The kernel with variance 1.
    kernel: Kernel,
    /// Noise over variance.
    ratio: f64,
    variance: f64,
    /// Whether near values contradict the kernel together, at some place or everywhere.
    is_contradicted: bool,
    copies: Vec<RowCopy>,
}

fn chosen(by: By, cloud: &Cloud, values: &[f64]) -> LearnedProcess {
    let sampling = Spacings::of(cloud, &Unobserved).unwrap();
    let (noise, mean) = (Noise::Unknown, Mean::Constant);
    let learned =
        learn(ObservedCloud { cloud, sampling: &sampling, values, noise, mean }, &Unobserved).unwrap();
    let By::Criterion(criterion) = by else {
        let kernel = learned.kernel(1.0).unwrap();
        let is_contradicted = learned.disagreement.as_ref().is_some_and(Disagreement::is_of_near_values);
        let LearnedModel { ratio, variance, copies, .. } = learned;
        return LearnedProcess { kernel, ratio, variance, is_contradicted, copies };
    };
    let kernel = Kernel::new(learned.family, learned.length_scale, learned.variance).unwrap();
    let start = Hyperparameters::of(&kernel, Regularization::Uniform(learned.ratio * learned.variance));
    let spacing = sampling.scales().spacing;
    let free = |parameter, min: f64, max: f64| Variation { parameter, min, max };
    let vary = [
        free(Parameter::LengthScale, 0.625 * spacing, 80.0 * spacing),
        free(Parameter::Variance, 1e-3 * learned.variance, 1e3 * learned.variance),
        free(Parameter::Alpha, 1e-10 * learned.variance, 10.0 * learned.variance),
    ];
    // As the service does where the noise is searched for.
    let copies = row_copies(cloud, values);
    let (without, merge) = Merge::copies(cloud, &copies);
    let selection = Selection {
        observations: Observations { cloud: &without, values: &merge.mean(values), mean },
        criterion,
        start: &start,
        vary: &vary,
        prior: ScalePrior::default(),
        families: &FAMILIES,
        restarts: 1,
        seed: 0,
        max_evaluations: MAX_EVALUATIONS,
    };
    let found = select(&selection, &Unobserved).unwrap().hyperparameters;
    let Regularization::Uniform(noise) = found.noise else { unreachable!("it was uniform") };
    let kernel = Kernel::new(found.family, found.length_scales[0], 1.0).unwrap();
    // The least noise with which many points can be factorized.
    let ratio = (noise / found.variance).max(1e-10);
    LearnedProcess { kernel, ratio, variance: found.variance, is_contradicted: false, copies }
}
