//! Whether neighbourhoods are large enough.

use super::{Asked, Moving, MovingRequest, Quantities, Raw};
use crate::error::NumericsError;
use crate::machine::instruction_set::InstructionSet;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::thinning::thinned_points;
use crate::solver::choose::NEIGHBOURS;
use crate::solver::trend::Trend;
use crate::sums::jets::JetOrder;

/// Queries at which it is looked, at most.
const LOOKED_AT: usize = 32;

/// A difference of so many deviations between the answers of a neighbourhood and of its nearer half, in root mean square, is one too many.
///
/// Points beyond a neighbourhood change its answer less than its outer half does, so that what is left out stays well below a deviation.
const UNSETTLED: f64 = 0.1;

impl Moving {
    /// By how many deviations, in root mean square over a sample of the queries, values from the nearer half of a neighbourhood differ from those of
    /// all of it; `None` where that is a tenth at most, or a neighbourhood is the whole cloud.
    ///
    /// # Errors
    /// Those of [`Moving::at`].
    pub fn unsettled(
        &self,
        values: &[f64],
        queries: &Cloud,
        trend: Option<&Trend>,
        observer: &dyn Observer,
    ) -> Result<Option<f64>, NumericsError> {
        if self.system.n_points() <= NEIGHBOURS {
            return Ok(None);
        }
        let sample = queries.select(&thinned_points(queries, LOOKED_AT));
        let by = |n_neighbours: usize| {
            let order = JetOrder::Value;
            let request = MovingRequest { order, has_variances: true, has_deviations: false, trend };
            let (set, quantities) = (InstructionSet::best(), Quantities::none());
            self.run(values, &sample, Asked { set, request, quantities, n_neighbours }, observer)
        };
        let (Raw { jets: half, .. }, Raw { jets, sure, .. }) = (by(NEIGHBOURS / 2)?, by(NEIGHBOURS)?);
        let of_query = |query: usize| match half.value(query) - jets.value(query) {
            0.0 => 0.0,
            // Infinite where there is no variance left.
            difference => difference * difference / sure[query].max(0.0),
        };
        let m = sample.n_points();
        let found = ((0..m).map(of_query).sum::<f64>() / m as f64).sqrt();
        Ok(Some(found).filter(|found| *found > UNSETTLED))
    }
}
