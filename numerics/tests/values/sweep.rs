//! Coverage of the error bars of a field, its derivatives and its operators, with default parameters.

#![allow(dead_code, reason = "the example prints what the test does not ask")]

use std::sync::Arc;

use gramian_numerics::kernel::Kernel;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling as Spacings;
use gramian_numerics::regression::function::deviations::JetDeviations;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::selection::{LearnedModel, Noise, ObservedCloud, learn};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::jets::JetOrder;
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use crate::common::random::Random;
use crate::fields::Field;
use crate::jet::Jet;
use crate::sampling::{Sampling, sample};
use crate::shapes::{Shape, Truth, dot};

pub const NOISES: [f64; 4] = [0.0, 0.003, 0.01, 0.05];

/// Deviations within which 95 % of normally distributed errors lie.
const BAND: f64 = 1.96;

/// Largest number of queries of a cloud.
const MAX_QUERIES: usize = 300;

/// A field on a surface, its sampling, and the standard deviation of the noise of its
/// values over that of the field.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub shape: Shape,
    pub sampling: Sampling,
    pub field: Field,
    pub n_points: usize,
    pub noise: f64,
}

/// Names of the quantities.
pub const QUANTITIES: [&str; 5] = ["value", "gradient", "Hessian", "surface gradient", "Laplace–Beltrami"];

/// Indices of the quantities that depend on the surface alone. Values at its points do not determine the
/// function across it.
pub const ON_SURFACE: [usize; 3] = [0, 3, 4];

/// Errors and error bars of all clouds of a row, by quantity.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Errors over 1.96 deviations.
    pub ratios: [Vec<f64>; 5],
    /// Sums of squared errors and of squared true values.
    pub squares: [[f64; 2]; 5],
    /// Errors beyond half of the root mean square of the true values, whose deviation
    /// is at most a quarter of it.
    pub n_off: [usize; 5],
    pub n_unflagged: [usize; 5],
    pub learned: Vec<LearnedModel>,
}

impl Case {
    /// Runs the case on `n_clouds` clouds and collects all their errors.
    pub fn run(&self, n_clouds: usize) -> Row {
        let mut row = Row::default();
        for cloud in 0..n_clouds {
            self.run_once(cloud, &mut row);
        }
        row
    }

    fn run_once(&self, cloud: usize, row: &mut Row) {
        let seed = 31 * self.n_points + 7 * self.sampling as usize + 1001 * cloud;
        let mut random = Random(seed as u64 + 1);
        let points = sample(self.shape, self.sampling, self.n_points, &mut random);
        let n = points.len();
        let exact: Vec<f64> = points.iter().map(|&x| self.field.at(x).value).collect();
        let mean = exact.iter().sum::<f64>() / n as f64;
        let spread = (exact.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
        let values: Vec<f64> = exact.iter().map(|f| f + self.noise * spread * random.normal()).collect();
        let cloud = Arc::new(Cloud::new(points.concat(), 3).unwrap());
        let step = n.div_ceil(MAX_QUERIES);
        let queries: Vec<[f64; 3]> = points.iter().step_by(step).copied().collect();
        let at = Cloud::new(queries.concat(), 3).unwrap();
        let sampling = Arc::new(Spacings::of(&cloud, &Unobserved).unwrap());

        let observed = ObservedCloud {
            cloud: &cloud,
            sampling: &sampling,
            values: &values,
            noise: Noise::Unknown,
            mean: Mean::Constant,
        };
        let learned = learn(observed, &Unobserved).unwrap();
        let kernel = Kernel::new(learned.family, learned.length_scale, 1.0).unwrap();
        let alpha = Regularization::uniform(learned.ratio).unwrap();
        let system = System::new(cloud.clone(), kernel, alpha).unwrap();
        let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
        let u = Interpolant::fit_with_mean(solver, &values, Mean::Constant, &Unobserved).unwrap();
        let factor = learned.variance;
        row.learned.push(learned);

        let jets = u.at(&at, JetOrder::Hessian, &Unobserved).unwrap();
        let bars = JetDeviations::of(&u, factor, &at, 2, &Unobserved).unwrap();
        let truth: Vec<Jet> = queries.iter().map(|&x| self.field.at(x)).collect();
        row.add(0, &jets.values(), &bars.values, truth.iter().map(|t| t.value));
        row.add(1, &jets.gradients(), &bars.gradients, truth.iter().flat_map(|t| t.gradient));
        row.add(2, &jets.hessians(), &bars.hessians, truth.iter().flat_map(|t| t.hessian.concat()));

        let local = LocalSurface::of(cloud.clone(), sampling, LocalInputs::default(), &Unobserved).unwrap();
        let surface = Surface::from(local);
        let request = GeometryRequest {
            model: SurfaceModel::Regression,
            has_deviations: true,
            ..GeometryRequest::CURVATURES
        };
        let geometry = Geometry::of(&surface, &at, &request, &Unobserved).unwrap();
        let on: Vec<(Jet, Truth)> =
            truth.iter().zip(&queries).map(|(t, &x)| (*t, self.shape.truth(x))).collect();
        let found = Operator::SurfaceGradient.apply(&geometry, &u, &at, &Unobserved).unwrap();
        let bars = Operator::SurfaceGradient.deviations(&geometry, &u, factor, &at, &Unobserved).unwrap();
        row.add(3, &found, &bars, on.iter().flat_map(|(t, on)| tangential(t, on)));
        let found = Operator::LaplaceBeltrami.apply(&geometry, &u, &at, &Unobserved).unwrap();
        let bars = Operator::LaplaceBeltrami.deviations(&geometry, &u, factor, &at, &Unobserved).unwrap();
        row.add(4, &found, &bars, on.iter().map(|(t, on)| laplacian(t, on)));
    }
}

pub fn tangential(field: &Jet, on: &Truth) -> [f64; 3] {
    let along = dot(field.gradient, on.normal);
    std::array::from_fn(|c| field.gradient[c] - along * on.normal[c])
}

/// Laplace–Beltrami of a field, `tr D²f − νᵀD²fν − (κ₁ + κ₂) ∂_νf`.
pub fn laplacian(field: &Jet, on: &Truth) -> f64 {
    let trace: f64 = (0..3).map(|c| field.hessian[c][c]).sum();
    let across: f64 = (0..3).map(|c| on.normal[c] * dot(field.hessian[c], on.normal)).sum();
    trace - across - (on.curvatures[0] + on.curvatures[1]) * dot(field.gradient, on.normal)
}

impl Row {
    fn add(&mut self, quantity: usize, found: &[f64], bars: &[f64], truth: impl Iterator<Item = f64>) {
        let truth: Vec<f64> = truth.collect();
        assert_eq!((found.len(), bars.len()), (truth.len(), truth.len()));
        let scale = (truth.iter().map(|t| t * t).sum::<f64>() / truth.len() as f64).sqrt();
        for ((found, bar), truth) in found.iter().zip(bars).zip(&truth) {
            let error = (found - truth).abs();
            self.ratios[quantity].push(error / (BAND * bar));
            self.squares[quantity][0] += error * error;
            self.squares[quantity][1] += truth * truth;
            if *bar <= 0.25 * scale {
                self.n_unflagged[quantity] += 1;
                self.n_off[quantity] += usize::from(error > 0.5 * scale);
            }
        }
    }

    /// Percentages of the true values within the bars.
    pub fn coverages(&self) -> [f64; 5] {
        std::array::from_fn(|quantity| {
            let ratios = &self.ratios[quantity];
            100.0 * ratios.iter().filter(|ratio| **ratio <= 1.0).count() as f64 / ratios.len() as f64
        })
    }

    /// Root mean square errors over the root mean square of the true values.
    pub fn errors(&self) -> [f64; 5] {
        self.squares.map(|[error, truth]| (error / truth).sqrt())
    }

    /// Whether the coverages of values and operators on the surface are at least 88 %, and
    /// with noise at most 99.5 %.
    pub fn holds(&self, noise: f64) -> bool {
        let most = if noise > 0.0 { 99.5 } else { 100.0 };
        let coverages = self.coverages();
        ON_SURFACE.iter().all(|&quantity| (88.0..=most).contains(&coverages[quantity]))
    }
}
