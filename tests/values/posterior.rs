//! How many true values lie within 95 % bands of a posterior of which nothing was said.

use std::sync::Arc;

use gramian::numerics::function::interpolant::Interpolant;
use gramian::numerics::function::posterior::variances_with_mean;
use gramian::numerics::kernel::Kernel;
use gramian::numerics::observer::Unobserved;
use gramian::numerics::points::cloud::Cloud;
use gramian::numerics::points::sampling::Sampling as Spacings;
use gramian::numerics::selection::{Noise, Observed, learn};
use gramian::numerics::solver::trend::Mean;
use gramian::numerics::solver::{Solver, System};
use gramian::numerics::sums::jets::JetOrder;
use gramian::numerics::sums::regularization::Regularization;

use crate::common::random::Random;
use crate::fields::Field;

const N_QUERIES: usize = 200;

/// Sensors in a cube, on a square or along a line.
#[derive(Debug, Clone, Copy)]
pub struct Sensors {
    pub dimension: usize,
    pub n_points: usize,
    pub field: Field,
    /// Deviation of the noise over that of the field.
    pub noise: f64,
    pub factor: f64,
    pub offset: f64,
}

impl Sensors {
    /// Per cent of the true values within ±1.96 deviations, at random queries among the sensors, over some draws.
    pub fn coverage(&self, n_draws: usize) -> f64 {
        let n_within: usize = (0..n_draws).map(|draw| self.n_within(draw)).sum();
        100.0 * n_within as f64 / (n_draws * N_QUERIES) as f64
    }

    fn n_within(&self, draw: usize) -> usize {
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

        let sampling = Spacings::of(&cloud, &Unobserved).unwrap();
        let (noise, mean) = (Noise::Unknown, Mean::Constant);
        let observed = Observed { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
        let learned = learn(observed, &Unobserved).unwrap();
        let kernel = Kernel::new(learned.family, learned.length_scale, 1.0).unwrap();
        let alpha = Regularization::uniform(learned.ratio).unwrap();
        let solver = System::new(cloud, kernel, alpha).and_then(|system| Solver::dense(system, &Unobserved));
        let u = Interpolant::fit_with_mean(Arc::new(solver.unwrap()), &values, mean, &Unobserved).unwrap();
        let found = u.at(&at, JetOrder::Value, &Unobserved).unwrap().values();
        let trend = u.solution.trend.as_ref();
        let variances = variances_with_mean(&u.solver, trend, &at, &Unobserved).unwrap();
        let latent = variances.scaled(learned.variance).latent;
        let within = |((f, t), v): ((&f64, &f64), &f64)| (f - t).abs() <= 1.96 * v.sqrt();
        found.iter().zip(&truth).zip(&latent).filter(|&entry| within(entry)).count()
    }
}
