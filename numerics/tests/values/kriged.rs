//! Operators on values by the local solver, which kriges around each query: coverage of error bars,
//! and errors without a flag.

#![allow(dead_code, reason = "the example prints what the test does not ask")]

use std::sync::Arc;

use gramian_numerics::kernel::Kernel;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::{KrigedFunction, OfKriged, Operator};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling as Spacings;
use gramian_numerics::regression::function::local_kriging::LocalKriging;
use gramian_numerics::regression::selection::{LearnedModel, Noise, ObservedCloud, learn};
use gramian_numerics::regression::solver::System;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use crate::common::random::Random;
use crate::fields::Field;
use crate::jet::Jet;
use crate::sampling::{Sampling, sample};
use crate::shapes::{Shape, Truth};
use crate::sweep::{laplacian, tangential};

/// A field on a surface, and the standard deviation of the noise of its values over that of the field.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub shape: Shape,
    pub field: Field,
    pub n_points: usize,
    pub noise: f64,
}

/// Coverage, flags and errors of an operator.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    /// Percentage of the components within ±1.96 deviations.
    pub coverage: f64,
    /// Percentage of the answers with a flag.
    pub flagged: f64,
    /// Percentage of the answers without a flag that are off by more than half of the root mean
    /// square of the true values.
    pub off: f64,
    /// Median error over the largest true value, per cent.
    pub error: f64,
}

/// Largest number of queries of a cloud.
const MAX_QUERIES: usize = 500;

impl Case {
    /// Outcomes of the surface gradient and of Laplace–Beltrami, and the hyperparameters that were learned.
    pub fn run(&self, draw: usize) -> ([Outcome; 2], LearnedModel) {
        let mut random = Random((31 * self.n_points + 1001 * draw) as u64 + 5);
        let points = sample(self.shape, Sampling::Random, self.n_points, &mut random);
        let n = points.len();
        let exact: Vec<f64> = points.iter().map(|&x| self.field.at(x).value).collect();
        let mean = exact.iter().sum::<f64>() / n as f64;
        let spread = (exact.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
        let values: Vec<f64> = exact.iter().map(|f| f + self.noise * spread * random.normal()).collect();
        let cloud = Arc::new(Cloud::new(points.concat(), 3).unwrap());
        let queries: Vec<[f64; 3]> = points.iter().step_by(n.div_ceil(MAX_QUERIES)).copied().collect();
        let at = Cloud::new(queries.concat(), 3).unwrap();
        let sampling = Arc::new(Spacings::of(&cloud, &Unobserved).unwrap());

        let (noise, mean) = (Noise::Unknown, Mean::Constant);
        let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
        let learned = learn(observed, &Unobserved).unwrap();
        let kernel = Kernel::new(learned.family, learned.length_scale, 1.0).unwrap();
        let alpha = Regularization::uniform(learned.ratio).unwrap();
        let system = System::new(cloud.clone(), kernel, alpha).unwrap();
        let moving = LocalKriging::new(system, sampling.clone(), &Unobserved).unwrap();
        let surface =
            Surface::from(LocalSurface::of(cloud, sampling, LocalInputs::default(), &Unobserved).unwrap());
        let request = GeometryRequest {
            model: SurfaceModel::Regression,
            has_deviations: true,
            ..GeometryRequest::CURVATURES
        };
        let geometry = Geometry::of(&surface, &at, &request, &Unobserved).unwrap();
        let function = KrigedFunction {
            moving: &moving,
            values: &values,
            trend: learned.trend.as_ref(),
            factor: learned.variance,
        };
        let truth: Vec<(Jet, Truth)> =
            queries.iter().map(|&x| (self.field.at(x), self.shape.truth(x))).collect();
        let gradients: Vec<f64> = truth.iter().flat_map(|(t, on)| tangential(t, on)).collect();
        let laplacians: Vec<f64> = truth.iter().map(|(t, on)| laplacian(t, on)).collect();
        let gradient = Operator::SurfaceGradient.on_kriged(&geometry, function, &at, &Unobserved).unwrap();
        let operator = Operator::LaplaceBeltrami.on_kriged(&geometry, function, &at, &Unobserved).unwrap();
        ([outcome(&gradient, &gradients, 3), outcome(&operator, &laplacians, 1)], learned)
    }
}

/// The outcome of an operator with k components at each query.
fn outcome(found: &OfKriged, truth: &[f64], k: usize) -> Outcome {
    let within = found.values.iter().zip(truth).zip(&found.deviations);
    let n_within = within.filter(|((f, t), s)| (*f - *t).abs() <= 1.96 * **s).count();
    let lengths: Vec<f64> = truth.chunks_exact(k).map(norm_of).collect();
    let scale = (lengths.iter().map(|t| t * t).sum::<f64>() / lengths.len() as f64).sqrt();
    let differences: Vec<f64> = found.values.iter().zip(truth).map(|(f, t)| f - t).collect();
    let mut errors: Vec<f64> = differences.chunks_exact(k).map(norm_of).collect();
    let mut is_flagged = vec![false; errors.len()];
    found.uncertain.iter().for_each(|&query| is_flagged[query] = true);
    let n_flagged = found.uncertain.len();
    let n_off = errors.iter().zip(&is_flagged).filter(|(e, flag)| !**flag && **e > 0.5 * scale).count();
    let n_unflagged = errors.len() - n_flagged;
    let count = errors.len();
    errors.sort_by(f64::total_cmp);
    let largest = lengths.iter().copied().fold(0.0, f64::max);
    let per_cent = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
    Outcome {
        coverage: per_cent(n_within, truth.len()),
        flagged: per_cent(n_flagged, count),
        off: per_cent(n_off, n_unflagged),
        error: 100.0 * errors[count / 2] / largest,
    }
}

fn norm_of(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
