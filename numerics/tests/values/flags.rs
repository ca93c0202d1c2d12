//! Counts of answers of operators on values that are off by half without a flag, for
//! requests without deviations.

#![allow(dead_code, reason = "the example prints what the test does not ask")]

use std::sync::Arc;

use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::defaults::{Purpose, default_fit};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::{Operator, OperatorAnswers};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::noise::estimate_noise;
use gramian_numerics::points::sampling::Sampling as Spacings;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::selection::{LearnedModel, Noise, ObservedCloud, learn};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};

use crate::common::random::Random;
use crate::fields::Field;
use crate::jet::Jet;
use crate::sampling::{Sampling, sample};
use crate::shapes::{Shape, Truth};
use crate::sweep::{laplacian, tangential};

/// The kernel that a request names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KernelChoice {
    /// No kernel: all is learned or chosen by default.
    Nothing,
    /// A family without a length scale.
    Family(Family),
    /// A family with a multiple of its default length scale for values, in both fits: of the
    /// values and of the surface.
    Width(Family, f64),
}

/// Values of a field on clouds of a shape.
#[derive(Debug, Clone, Copy)]
pub struct Values {
    pub shape: Shape,
    pub field: Field,
    pub n_points: usize,
    /// Standard deviation of the noise over that of the field.
    pub noise: f64,
}

/// Counts for the surface gradient and for Laplace–Beltrami.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub n: [usize; 2],
    pub n_unflagged: [usize; 2],
    /// Answers without a flag that are off by more than half of the root mean square of the true values.
    pub n_off: [usize; 2],
    /// Requests that were refused.
    pub n_refused: usize,
}

impl Counts {
    pub fn plus(mut self, other: &Self) -> Self {
        for (sum, count) in [
            (&mut self.n, other.n),
            (&mut self.n_unflagged, other.n_unflagged),
            (&mut self.n_off, other.n_off),
        ] {
            sum.iter_mut().zip(count).for_each(|(sum, count)| *sum += count);
        }
        self.n_refused += other.n_refused;
        self
    }
}

/// Largest number of queries of a cloud.
const MAX_QUERIES: usize = 300;

/// α for kernels that the request names.
const ALPHA: f64 = 1e-10;

impl Values {
    /// Counts the answers to each request, for `n_clouds` clouds. `[asked]`
    pub fn run(&self, asked: &[KernelChoice], n_clouds: usize) -> Vec<Counts> {
        let refused = Counts { n_refused: 1, ..Counts::default() };
        let mut sums = vec![Counts::default(); asked.len()];
        for cloud in 0..n_clouds {
            let on_cloud = OnCloud::of(self, cloud);
            for (sum, &asked) in sums.iter_mut().zip(asked) {
                let counts = on_cloud.as_ref().ok().and_then(|on_cloud| on_cloud.counts(asked).ok());
                *sum = sum.plus(&counts.unwrap_or(refused));
            }
        }
        sums
    }
}

/// A cloud with its values, the kernel learned from them, and the exact answers at its queries.
struct OnCloud {
    cloud: Arc<Cloud>,
    queries: Cloud,
    spacings: Spacings,
    values: Vec<f64>,
    learned: LearnedModel,
    truth: Vec<(Jet, Truth)>,
}

impl OnCloud {
    fn of(of: &Values, cloud: usize) -> Result<Self, NumericsError> {
        let mut random = Random((31 * of.n_points + 1001 * cloud) as u64 + 1);
        let points = sample(of.shape, Sampling::Random, of.n_points, &mut random);
        let n = points.len();
        let exact: Vec<f64> = points.iter().map(|&x| of.field.at(x).value).collect();
        let mean = exact.iter().sum::<f64>() / n as f64;
        let spread = (exact.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
        let values: Vec<f64> = exact.iter().map(|f| f + of.noise * spread * random.normal()).collect();
        let cloud = Arc::new(Cloud::new(points.concat(), 3).unwrap());
        let queries: Vec<[f64; 3]> = points.iter().step_by(n.div_ceil(MAX_QUERIES)).copied().collect();
        let spacings = Spacings::of(&cloud, &Unobserved)?;
        let (noise, mean) = (Noise::Unknown, Mean::Constant);
        let observed = ObservedCloud { cloud: &cloud, sampling: &spacings, values: &values, noise, mean };
        let learned = learn(observed, &Unobserved)?;
        let truth = queries.iter().map(|&x| (of.field.at(x), of.shape.truth(x))).collect();
        let queries = Cloud::new(queries.concat(), 3).unwrap();
        Ok(Self { cloud, queries, spacings, values, learned, truth })
    }

    fn counts(&self, asked: KernelChoice) -> Result<Counts, NumericsError> {
        let (interpolant, factor) = self.function(asked)?;
        let geometry =
            Geometry::of(&self.surface(asked)?, &self.queries, &GeometryRequest::CURVATURES, &Unobserved)?;
        let mut counts = Counts::default();
        let mut count = |operator: Operator, at: usize, exact: &[f64]| {
            let found = operator.apply(&geometry, &interpolant, &self.queries, &Unobserved)?;
            let judged = OperatorAnswers {
                geometry: &geometry,
                interpolant: &interpolant,
                factor,
                queries: &self.queries,
                found: &found,
                learned: Some(&self.learned).filter(|_| asked != KernelChoice::Nothing),
            };
            let doubts = judged.judge(operator, &Unobserved)?;
            counts.add(at, &found, exact, &geometry, &doubts);
            Ok::<_, NumericsError>(())
        };
        let exact: Vec<f64> = self.truth.iter().flat_map(|(jet, on)| tangential(jet, on)).collect();
        count(Operator::SurfaceGradient, 0, &exact)?;
        let exact: Vec<f64> = self.truth.iter().map(|(jet, on)| laplacian(jet, on)).collect();
        count(Operator::LaplaceBeltrami, 1, &exact)?;
        Ok(counts)
    }

    /// The fit of the values, and the variance by which its unit kernel is multiplied.
    fn function(&self, asked: KernelChoice) -> Result<(Interpolant, f64), NumericsError> {
        let Self { cloud, spacings, values, learned, .. } = self;
        let (family, length_scale) = match asked {
            KernelChoice::Nothing => {
                let kernel = Kernel::new(learned.family, learned.length_scale, 1.0)?;
                let solver = solver(cloud, kernel, learned.ratio)?;
                let interpolant = Interpolant::fit_with_mean(solver, values, Mean::Constant, &Unobserved)?;
                return Ok((interpolant, learned.variance));
            }
            KernelChoice::Family(family) => (family, family.length_scale_of_values(spacings.scales())),
            KernelChoice::Width(family, factor) => {
                (family, factor * family.length_scale_of_values(spacings.scales()))
            }
        };
        let solver = solver(cloud, Kernel::new(family, length_scale, 1.0)?, ALPHA)?;
        Ok((Interpolant::fit(solver, values, &Unobserved)?, 1.0))
    }

    fn surface(&self, asked: KernelChoice) -> Result<Surface, NumericsError> {
        let Self { cloud, spacings, .. } = self;
        let scales = spacings.scales();
        let (kernel, alpha) = match asked {
            KernelChoice::Nothing => {
                let noise = estimate_noise(cloud, spacings, &Unobserved)?;
                default_fit(scales, Purpose::Curvatures, || noise)?
            }
            KernelChoice::Family(family) => {
                (Kernel::new(family, family.default_length_scale(scales), 1.0)?, ALPHA)
            }
            KernelChoice::Width(family, factor) => {
                (Kernel::new(family, factor * family.length_scale_of_values(scales), 1.0)?, ALPHA)
            }
        };
        let signature = Interpolant::signature(solver(cloud, kernel, alpha)?, &Unobserved)?;
        Surface::of(signature, None, &Unobserved)
    }
}

fn solver(cloud: &Arc<Cloud>, kernel: Kernel, alpha: f64) -> Result<Arc<Solver>, NumericsError> {
    let system = System::new(cloud.clone(), kernel, Regularization::uniform(alpha)?)?;
    Solver::dense(system, &Unobserved).map(Arc::new)
}

impl Counts {
    fn add(&mut self, operator: usize, found: &[f64], exact: &[f64], geometry: &Geometry, doubts: &[usize]) {
        let m = geometry.n_queries();
        let k = found.len() / m;
        let mut is_flagged = geometry.is_null().to_vec();
        geometry.flags().iter().for_each(|entry| is_flagged[entry.query] = true);
        doubts.iter().for_each(|&query| is_flagged[query] = true);
        let mean_square = exact.iter().map(|t| t * t).sum::<f64>() / m as f64;
        for query in 0..m {
            let both = found[query * k..][..k].iter().zip(&exact[query * k..][..k]);
            let error: f64 = both.map(|(found, exact)| (found - exact).powi(2)).sum();
            self.n[operator] += 1;
            self.n_unflagged[operator] += usize::from(!is_flagged[query]);
            self.n_off[operator] += usize::from(!is_flagged[query] && error > 0.25 * mean_square);
        }
    }
}
