//! Local regressions over the points, or over means of them, with the models that the likelihood prefers.

use super::means::Support;
use super::neighbourhood::n_neighbours;
use super::pooled::WeightedModel;
use crate::machine::heap::vec_bytes;

/// Local regressions over the points, or over means of equally many.
pub(crate) struct Level {
    pub support: Support,
    pub models: Vec<WeightedModel>,
    /// Models for the slopes where the surface is flat. Empty where there is no noise.
    pub stiff: Vec<WeightedModel>,
    /// Models with a trend of fourth order, where points are exact and the surface is smooth enough.
    pub quartic: Vec<WeightedModel>,
    /// Points, or means, in a neighbourhood. Below `n_terms(d) + 2`, no query has an answer.
    pub count: usize,
    /// Noise of a point that neighbourhoods do not take for a bend, unit L.
    pub bend_noise: f64,
}

impl Level {
    /// A level without models.
    pub fn of(support: Support, bend_noise: f64) -> Self {
        let count = n_neighbours(support.cloud().dimension(), support.cloud().n_points());
        Self { support, models: Vec::new(), stiff: Vec::new(), quartic: Vec::new(), count, bend_noise }
    }

    pub fn n_bytes(&self) -> usize {
        self.support.n_bytes()
            + [&self.models, &self.stiff, &self.quartic].map(vec_bytes).iter().sum::<usize>()
    }
}
