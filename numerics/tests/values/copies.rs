//! Tables in which rows repeat, as exports and joins leave them.

use std::sync::Arc;

use gramian_numerics::points::cloud::Cloud;

use crate::common::random::Random;
use crate::posterior::{By, Draw, DrawSummary, Posterior, posterior};

const N_QUERIES: usize = 300;

/// Values with noise at random places of a square, some of whose rows are sent again.
#[derive(Debug, Clone, Copy)]
pub struct RepeatedRows {
    pub n_points: usize,
    /// Standard deviation of the noise. That of the field is 0.7.
    pub noise: f64,
    /// Rows that are sent again as they are.
    pub n_copies: usize,
    /// Places that are measured once more.
    pub n_differing: usize,
    pub by: By,
}

impl RepeatedRows {
    /// Coverage of the 95 % bands, and root mean square error, over draws.
    pub fn found(&self, n_draws: u64) -> DrawSummary {
        DrawSummary::over((1..=n_draws).map(|draw| self.draw(draw)))
    }

    fn draw(&self, seed: u64) -> Draw {
        let mut random = Random(seed);
        let mut places = |n: usize| -> Vec<f64> { (0..2 * n).map(|_| random.uniform()).collect() };
        let (mut points, queries) = (places(self.n_points), places(N_QUERIES));
        let field = |x: &[f64]| (5.0 * x[0]).sin() + (4.0 * x[1]).cos() * x[0];
        let exact: Vec<f64> = points.chunks_exact(2).map(field).collect();
        let mut values: Vec<f64> = exact.iter().map(|u| u + self.noise * random.normal()).collect();
        for repeat in 0..self.n_copies + self.n_differing {
            let row = repeat * 7 % self.n_points;
            points.extend_from_within(2 * row..2 * row + 2);
            let is_copy = repeat < self.n_copies;
            values.push(if is_copy { values[row] } else { exact[row] + self.noise * random.normal() });
        }
        let (cloud, at) = (Arc::new(Cloud::new(points, 2).unwrap()), Cloud::new(queries, 2).unwrap());
        let Posterior { means, variances, .. } = posterior(self.by, cloud, &values, &at);
        let errors: Vec<f64> = means.iter().zip(at.points()).map(|(u, x)| u - field(x)).collect();
        Draw::of(&errors, &variances, 1.0)
    }
}
