//! The nearest points of many positions, searched for once.

use rayon::prelude::*;

use super::cloud::Cloud;
use super::neighbours::{Neighbour, Neighbours};
use crate::numerics::error::NumericsError;
use crate::numerics::observer::Observer;

/// The nearest positions of a cloud around each of m queries, nearest first.
pub(crate) struct Neighbourhoods {
    /// As many as were asked for, or as the cloud has.
    count: usize,
    /// `[m, count]`.
    found: Vec<Neighbour>,
}

impl Neighbourhoods {
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of(
        cloud: &Cloud,
        neighbours: &Neighbours,
        queries: &Cloud,
        count: usize,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        // Every query sees as many positions.
        let count = neighbours.nearest_positions(cloud, queries.point(0), count).len();
        let mut found = vec![Neighbour { point: 0, squared_distance: 0.0 }; queries.n_points() * count];
        found.par_chunks_exact_mut(count).enumerate().try_for_each_init(
            Vec::new,
            |nearest, (query, row)| {
                observer.checkpoint()?;
                neighbours.nearest_positions_into(cloud, queries.point(query), count, nearest);
                row.iter_mut().zip(nearest).for_each(|(slot, found)| *slot = *found);
                Ok(())
            },
        )?;
        Ok(Self { count, found })
    }

    pub(crate) fn around(&self, query: usize) -> &[Neighbour] {
        &self.found[query * self.count..][..self.count]
    }

    pub(crate) fn nearest(&self, query: usize) -> Neighbour {
        self.found[query * self.count]
    }
}
