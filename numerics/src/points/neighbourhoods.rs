//! Nearest positions around many queries, searched for once.

use rayon::prelude::*;

use super::cloud::Cloud;
use super::neighbours::{Neighbour, Neighbours, Walk};
use crate::error::Result;
use crate::observer::Observer;

/// The nearest positions of a cloud around each of m queries, nearest first.
pub(crate) struct Neighbourhoods {
    /// Neighbours per query: the number asked for, or all positions of the cloud if it has fewer.
    count: usize,
    /// Neighbours of each query, `[m, count]`.
    found: Vec<Neighbour>,
}

impl Neighbourhoods {
    /// Finds the `count` nearest positions around each query.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(crate) fn of(
        neighbours: &Neighbours,
        queries: &Cloud,
        count: usize,
        observer: &dyn Observer,
    ) -> Result<Self> {
        // Every query finds equally many positions.
        let count = neighbours.nearest_positions(queries.point(0), count).len();
        let mut found = vec![Neighbour { point: 0, squared_distance: 0.0 }; queries.n_points() * count];
        found.par_chunks_exact_mut(count).enumerate().try_for_each_init(
            || (Walk::over(neighbours), Vec::new()),
            |(walk, nearest), (query, row)| {
                observer.checkpoint()?;
                walk.points_into(queries.point(query), count, nearest);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;

    fn around(coordinates: &[f64], count: usize) -> Vec<Vec<usize>> {
        let cloud = Cloud::new(coordinates.to_vec(), 1).unwrap();
        let found = {
            let neighbours = Neighbours::of(&cloud, &Unobserved).unwrap();
            Neighbourhoods::of(&neighbours, &cloud, count, &Unobserved).unwrap()
        };
        (0..cloud.n_points()).map(|point| found.around(point).iter().map(|n| n.point).collect()).collect()
    }

    #[test]
    fn every_position_is_seen_once_and_no_more_than_there_are() {
        assert_eq!(around(&[0.0, 1.0, 3.0], 2), [[0, 1], [1, 0], [2, 1]]);
        assert_eq!(around(&[0.0, 1.0, 3.0], 18), [[0, 1, 2], [1, 0, 2], [2, 1, 0]]);
        // Copies have neighbours too. As neighbours they are represented by their first point.
        assert_eq!(around(&[0.0, 2.0, 2.0, 2.0], 18), [[0, 1], [1, 0], [1, 0], [1, 0]]);
        assert_eq!(around(&[5.0, 5.0], 18), [[0], [0]]);
    }
}
