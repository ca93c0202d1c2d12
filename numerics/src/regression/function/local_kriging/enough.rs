//! A check that neighbourhoods are large enough.

use super::NEIGHBOURS;
use super::{BatchedRequest, KrigingRequest, LocalKriging, Quantities, Raw};
use crate::error::Result;
use crate::machine::instruction_set::InstructionSet;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::thinning::thinned_points;
use crate::regression::solver::trend::Trend;
use crate::regression::sums::jets::JetOrder;

/// Queries that are checked, at most.
const LOOKED_AT: usize = 32;

/// Root mean square difference, in deviations, above which neighbourhoods count as too small.
///
/// The difference is between the values from a neighbourhood and from its nearer half. Points beyond a
/// neighbourhood change its value less than its outer half does. Up to this limit, their effect is thus well
/// below a deviation.
const UNSETTLED: f64 = 0.1;

impl LocalKriging {
    /// Returns the difference between values from neighbourhoods and from their nearer halves, in deviations.
    ///
    /// It is the root mean square over a sample of at most 32 queries. `None` if it is at most 0.1, or if
    /// every neighbourhood is the whole cloud.
    ///
    /// # Errors
    /// Returns the errors of [`LocalKriging::at`].
    pub fn unsettled(
        &self,
        values: &[f64],
        queries: &Cloud,
        trend: Option<&Trend>,
        observer: &dyn Observer,
    ) -> Result<Option<f64>> {
        if self.system.n_points() <= NEIGHBOURS {
            return Ok(None);
        }
        let sample = queries.select(&thinned_points(queries, LOOKED_AT, observer)?);
        let by = |n_neighbours: usize| {
            let order = JetOrder::Value;
            let request = KrigingRequest { order, has_variances: true, has_deviations: false, trend };
            let (set, quantities) = (InstructionSet::best(), Quantities::none());
            self.run(values, &sample, BatchedRequest { set, request, quantities, n_neighbours }, observer)
        };
        let (Raw { jets: half, .. }, Raw { jets, sure, .. }) = (by(NEIGHBOURS / 2)?, by(NEIGHBOURS)?);
        let of_query = |query: usize| match half.value(query) - jets.value(query) {
            0.0 => 0.0,
            // Infinite where the variance is 0.
            difference => difference * difference / sure[query].max(0.0),
        };
        let m = sample.n_points();
        let found = ((0..m).map(of_query).sum::<f64>() / m as f64).sqrt();
        Ok(Some(found).filter(|found| *found > UNSETTLED))
    }
}
