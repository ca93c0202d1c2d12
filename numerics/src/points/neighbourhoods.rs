//! Nearest positions around many queries, searched for once.

use rayon::prelude::*;

use super::cloud::Cloud;
use super::neighbours::{Neighbour, Neighbours, Walk};
use crate::error::{NumericsError, Result};
use crate::observer::Observer;

/// The nearest positions of a cloud around each of m queries, nearest first.
pub(crate) struct Neighbourhoods {
    /// Neighbours per query: the number asked for, or all positions of the cloud if it has fewer.
    count: usize,
    /// The first point of each position, `[m, count]`.
    points: Vec<u32>,
    /// Squared distance of each query to its nearest position, `[m]`, unit L².
    nearest: Vec<f64>,
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
        let mut points = vec![0; queries.n_points() * count];
        let mut nearest = vec![0.0; queries.n_points()];
        points.par_chunks_exact_mut(count).zip(&mut nearest).enumerate().try_for_each_init(
            || (Walk::over(neighbours), Vec::new()),
            |(walk, found), (query, (row, nearest))| {
                observer.checkpoint()?;
                walk.points_into(queries.point(query), count, found);
                row.iter_mut().zip(found.iter()).for_each(|(slot, found)| *slot = found.point as u32);
                *nearest = found[0].squared_distance;
                Ok::<_, NumericsError>(())
            },
        )?;
        Ok(Self { count, points, nearest })
    }

    /// The `count` nearest positions around each query alone, of those that are known.
    pub(crate) fn narrowed(self, count: usize) -> Self {
        let count = count.min(self.count);
        let rows = self.points.chunks_exact(self.count);
        Self { points: rows.flat_map(|row| &row[..count]).copied().collect(), count, ..self }
    }

    /// The points around a query, nearest first.
    pub(crate) fn around(&self, query: usize) -> &[u32] {
        &self.points[query * self.count..][..self.count]
    }

    /// The nearest point of a query.
    pub(crate) fn nearest(&self, query: usize) -> Neighbour {
        let point = self.points[query * self.count] as usize;
        Neighbour { point, squared_distance: self.nearest[query] }
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
        (0..cloud.n_points())
            .map(|point| found.around(point).iter().map(|&point| point as usize).collect())
            .collect()
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
