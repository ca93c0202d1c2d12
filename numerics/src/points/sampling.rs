//! How a cloud is sampled: who is near whom, how far apart, and the lengths that kernels follow.

use rayon::prelude::*;

use super::cloud::{Cloud, squared_distance};
use super::neighbours::{Distances, Neighbour, Neighbours};
use crate::error::NumericsError;
use crate::machine::heap::vec_bytes;
use crate::observer::Observer;

/// Positions around a point that define the sampling distance there.
pub const SPACING_NEIGHBOURS: usize = 4;

/// What the positions of a cloud say, found once for all who ask.
pub struct Sampling {
    neighbours: Neighbours,
    spacings: Vec<f64>,
    scales: Scales,
}

impl Sampling {
    /// Looks at the neighbours of every point.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn of(cloud: &Cloud, observer: &dyn Observer) -> Result<Self, NumericsError> {
        let neighbours = Neighbours::of(cloud, observer)?;
        let measure = |found: &mut Vec<Neighbour>, position: usize| {
            observer.checkpoint()?;
            Ok(neighbours.distances(position, SPACING_NEIGHBOURS, found))
        };
        let at_positions: Vec<Option<Distances>> = (0..neighbours.n_positions())
            .into_par_iter()
            .map_init(Vec::new, measure)
            .collect::<Result<_, NumericsError>>()?;
        let (mut nearest, mut spacings) = (Vec::with_capacity(cloud.n_points()), vec![0.0; cloud.n_points()]);
        for (position, distances) in at_positions.iter().enumerate() {
            // A position without others is the only one.
            let Some(Distances { nearest: distance, mean }) = *distances else { continue };
            for &point in neighbours.points_at(position) {
                nearest.push(distance);
                spacings[point as usize] = mean;
            }
        }
        let means = if nearest.is_empty() { Vec::new() } else { spacings.clone() };
        Ok(Self { neighbours, spacings, scales: Scales::of(cloud, nearest, means) })
    }

    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// h_q: mean distance from a point to the [`SPACING_NEIGHBOURS`] nearest positions elsewhere, unit L; 0 for one position alone.
    pub fn spacing(&self, point: usize) -> f64 {
        self.spacings[point]
    }

    /// [`Sampling::spacing`] of all points, `[n]`.
    pub fn spacings(&self) -> &[f64] {
        &self.spacings
    }

    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// So many points, or fewer than twice as many, of every spacing: at equal steps in the order of
    /// [`Sampling::spacing`], which neither the order of the points nor the axes change. Where spacings tie,
    /// by index.
    pub fn of_every_spacing(&self, count: usize) -> Vec<usize> {
        let n = self.spacings.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.par_sort_unstable_by(|&a, &b| self.spacings[a].total_cmp(&self.spacings[b]).then(a.cmp(&b)));
        order.into_iter().step_by((n / count).max(1)).collect()
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        self.neighbours.n_bytes() + vec_bytes(&self.spacings)
    }
}

/// Lengths of a cloud, unit L; those that kernels follow are 1 for one position alone, which has no scale.
#[derive(Debug, Clone, Copy)]
pub struct Scales {
    /// Half the diagonal of the bounding box.
    pub radius: f64,
    /// Root mean square distance to the centroid, which no rotation changes.
    pub extent: f64,
    /// h: median distance to the nearest point elsewhere.
    pub nearest: f64,
    /// h₄: median of the mean distance to the 4 nearest points elsewhere.
    pub spacing: f64,
    nearest_range: Option<NearestRange>,
}

/// Distances from each point to the nearest point elsewhere, unit L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestRange {
    pub min: f64,
    pub median: f64,
    pub max: f64,
}

impl Scales {
    fn of(cloud: &Cloud, nearest: Vec<f64>, means: Vec<f64>) -> Self {
        let range = |of: fn(f64, f64) -> f64| nearest.iter().copied().reduce(of);
        let (min, max) = (range(f64::min), range(f64::max));
        match (min, median(nearest), max, median(means)) {
            (Some(min), Some(median), Some(max), Some(spacing)) => Self {
                radius: cloud.radius(),
                extent: extent(cloud),
                nearest: median,
                spacing,
                nearest_range: Some(NearestRange { min, median, max }),
            },
            _ => Self { radius: 1.0, extent: 1.0, nearest: 1.0, spacing: 1.0, nearest_range: None },
        }
    }

    /// `None` if all points coincide.
    pub fn nearest_range(&self) -> Option<NearestRange> {
        self.nearest_range
    }
}

fn extent(cloud: &Cloud) -> f64 {
    let n = cloud.n_points() as f64;
    let mut centroid = vec![0.0; cloud.dimension()];
    for x in cloud.points() {
        centroid.iter_mut().zip(x).for_each(|(c, x)| *c += x / n);
    }
    cloud.points().map(|x| squared_distance(x, &centroid) / n).sum::<f64>().sqrt()
}

/// The middle of a list, the upper one of two.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::testing::Random;

    #[test]
    fn points_of_every_spacing_are_the_same_in_any_order() {
        let mut random = Random(3);
        let xs: Vec<f64> = (0..900).map(|_| random.uniform().powi(2)).collect();
        let chosen = |xs: &[f64]| -> Vec<f64> {
            let cloud = Cloud::new(xs.to_vec(), 1).unwrap();
            let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
            sampling.of_every_spacing(100).into_iter().map(|point| xs[point]).collect()
        };
        let (found, turned) = (chosen(&xs), xs.iter().rev().copied().collect::<Vec<_>>());
        assert_eq!(found.len(), 100);
        assert_eq!(found, chosen(&turned));
        assert_eq!(chosen(&xs[..150]).len(), 150);
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![]), None);
    }
}
