//! Tables: rows of columns in different units, of which some do not matter.

use std::f64::consts::PI;
use std::sync::Arc;

use gramian_numerics::points::cloud::Cloud;

use crate::common::random::Random;
use crate::posterior::{By, Draw, DrawSummary, Posterior, posterior};

const N_QUERIES: usize = 300;
const N_COLUMNS: usize = 8;
const UNITS: [f64; N_COLUMNS] = [1e-3, 1e2, 1.0, 1e3, 1e-2, 10.0, 1e-1, 1e2];

/// The function of five columns of Friedman (1991, Annals of Statistics 19, eq. 61), with noise, in a table
/// of eight.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    pub n_rows: usize,
    /// Standard deviation of the noise. That of the function is 4.9.
    pub noise: f64,
}

impl Table {
    /// Coverage of the 95 % bands, and root mean square error over the spread of the function, over draws.
    pub fn found(&self, n_draws: u64) -> DrawSummary {
        DrawSummary::over((1..=n_draws).map(|draw| self.draw(draw)))
    }

    fn draw(&self, seed: u64) -> Draw {
        let mut random = Random(seed);
        let mut rows = |n: usize| -> Vec<f64> { (0..N_COLUMNS * n).map(|_| random.uniform()).collect() };
        let function = |x: &[f64]| {
            10.0 * (PI * x[0] * x[1]).sin() + 20.0 * (x[2] - 0.5).powi(2) + 10.0 * x[3] + 5.0 * x[4]
        };
        let (points, queries) = (rows(self.n_rows), rows(N_QUERIES));
        let of_points = points.chunks_exact(N_COLUMNS).map(function);
        let values: Vec<f64> = of_points.map(|value| value + self.noise * random.normal()).collect();
        let truth: Vec<f64> = queries.chunks_exact(N_COLUMNS).map(function).collect();
        let in_units = |rows: Vec<f64>| {
            let scaled = rows.iter().enumerate().map(|(at, x)| UNITS[at % N_COLUMNS] * x);
            Cloud::new(scaled.collect(), N_COLUMNS).unwrap()
        };
        let (cloud, at) = (Arc::new(in_units(points)), in_units(queries));
        let Posterior { means, variances, .. } = posterior(By::Default, cloud, &values, &at);
        let mean = truth.iter().sum::<f64>() / N_QUERIES as f64;
        let spread = truth.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / N_QUERIES as f64;
        let errors: Vec<f64> = means.iter().zip(&truth).map(|(u, t)| u - t).collect();
        Draw::of(&errors, &variances, spread.sqrt())
    }
}
