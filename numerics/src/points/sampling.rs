//! Sampling of a cloud: neighbours, spacings, and the lengths that kernels follow.

use rayon::prelude::*;

use super::cloud::{Cloud, squared_distance};
use super::neighbours::{Distances, Neighbour, Neighbours};
use crate::error::Result;
use crate::machine::heap::vec_bytes;
use crate::machine::price::Price;
use crate::observer::Observer;

/// Number of positions around a point that define the spacing there.
pub(crate) const SPACING_NEIGHBOURS: usize = 4;

/// The neighbour tree, spacings and lengths of a cloud, computed once and shared.
///
/// ```
/// use gramian_numerics::observer::Unobserved;
/// use gramian_numerics::points::cloud::Cloud;
/// use gramian_numerics::points::sampling::Sampling;
///
/// let line = Cloud::new((0..100).map(f64::from).collect(), 1)?;
/// let sampling = Sampling::of(&line, &Unobserved)?;
/// assert_eq!(sampling.scales().nearest, 1.0); // median distance to the nearest point
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
pub struct Sampling {
    neighbours: Neighbours,
    spacings: Vec<f64>,
    scales: Scales,
}

impl Sampling {
    /// Builds the tree and measures the distances from every position to its neighbours.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn of(cloud: &Cloud, observer: &dyn Observer) -> Result<Self> {
        let neighbours = Neighbours::of(cloud, observer)?;
        let measure = |found: &mut Vec<Neighbour>, position: usize| {
            observer.checkpoint()?;
            Ok(neighbours.distances(position, SPACING_NEIGHBOURS, found))
        };
        let at_positions: Vec<Option<Distances>> = (0..neighbours.n_positions())
            .into_par_iter()
            .map_init(Vec::new, measure)
            .collect::<Result<_>>()?;
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

    /// The sampling of the same points in the order of their tree.
    pub(crate) fn in_tree_order(&self) -> Self {
        let Self { neighbours, spacings, scales } = self;
        let spacings = neighbours.rows_in_order(spacings, 1);
        Self { neighbours: neighbours.in_own_order(), spacings, scales: *scales }
    }

    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// h_q: mean distance from a point to the `SPACING_NEIGHBOURS` nearest positions elsewhere, unit L. 0
    /// if the cloud has only one position.
    pub fn spacing(&self, point: usize) -> f64 {
        self.spacings[point]
    }

    /// Spacings of all points, as in [`Sampling::spacing`], `[n]`.
    pub fn spacings(&self) -> &[f64] {
        &self.spacings
    }

    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Returns a sample of `count` points, or fewer than twice as many, that covers all spacings.
    ///
    /// Points are taken at equal steps in the order of [`Sampling::spacing`]. Neither the order of the points
    /// nor the axes changes that order, except that ties are broken by index.
    pub(crate) fn of_every_spacing(&self, count: usize) -> Vec<usize> {
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

/// Lengths of a cloud, unit L. All are 1 for a cloud with only one position, which has no scale.
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

/// Statistics of the distance from each point to the nearest point elsewhere, unit L.
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

    /// Statistics of the nearest distances, or `None` if all points coincide.
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

/// Median of a list, or `None` if it is empty. Of two middle values the upper one is taken.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Flops of [`Sampling::of`]: every search visits a few leaves, in many dimensions most of the cloud.
pub fn sampling_flops(n_points: usize, dimension: usize) -> f64 {
    let n = n_points as f64;
    let visited = n.min(60.0 * 2f64.powi(dimension.min(60) as i32));
    // Distance, comparison and descent.
    n * visited * (3.0 * dimension as f64 + 10.0)
}

/// The price of [`Sampling::of`] at its peak: the tree with the points in its order, and four numbers a
/// point.
pub fn sampling_price(n_points: usize, dimension: usize) -> Price {
    let n_bytes = n_points.saturating_mul((dimension + 6) * size_of::<f64>());
    Price { n_bytes, flops: sampling_flops(n_points, dimension) }
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
