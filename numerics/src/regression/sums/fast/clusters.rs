//! Clusters of near points: a tree of halvings, down to a few points.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::Result;
use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};
use crate::observer::Observer;
use crate::points::cells::{halve, mean, second_moments};
use crate::points::cloud::{Cloud, squared_distance};

/// Points of the smallest clusters are fewer than twice this.
const LEAST: usize = 64;

/// A tree of clusters. The one with all points has the index 1, and cluster i has the halves 2i and 2i + 1.
/// All clusters of a level have equally many points, up to one.
pub(super) struct Clusters {
    /// Indices of the points, such that those of a cluster are a range.
    pub order: Vec<u32>,
    /// The points in this order, `[n, d]`.
    pub points: Cloud,
    clusters: Vec<Cluster>,
}

/// Some near points with the box around them, whose axes are those of their second moments.
pub(super) struct Cluster {
    /// Places in the order of the points.
    pub points: Range<usize>,
    /// Centre of the box, `[d]`, unit L.
    pub centre: Small,
    /// Directions of the box, one in each row, `[d, d]`.
    pub axes: Small,
    /// Half of the lengths of its sides, `[d]`, unit L.
    pub half: Small,
    /// Largest distance of a point from the centre, unit L.
    pub radius: f64,
}

impl Clusters {
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn of(cloud: &Cloud, observer: &dyn Observer) -> Result<Self> {
        let mut order: Vec<u32> = (0..cloud.n_points() as u32).collect();
        let mut sizes = vec![vec![order.len()]];
        let mut parts = vec![&mut order[..]];
        while parts.iter().all(|part| part.len() >= 2 * LEAST) {
            observer.checkpoint()?;
            let halves = parts.into_par_iter().flat_map_iter(|part| {
                let middle = part.len() / 2;
                let (left, right) = halve(cloud, part, middle);
                [left, right]
            });
            parts = halves.collect();
            sizes.push(parts.iter().map(|part| part.len()).collect());
        }
        let ranges = sizes.iter().flat_map(|level| {
            level.iter().scan(0, |start, size| {
                *start += size;
                Some(*start - size..*start)
            })
        });
        let ranges: Vec<Range<usize>> = ranges.collect();
        let clusters = ranges.into_par_iter().map(|range| {
            observer.checkpoint()?;
            Ok(Cluster::of(cloud, &order, range))
        });
        let clusters = clusters.collect::<Result<_>>()?;
        let points = cloud.select(&order.iter().map(|&point| point as usize).collect::<Vec<_>>());
        Ok(Self { clusters, points, order })
    }

    /// Indices of the clusters.
    pub(super) fn indices(&self) -> Range<usize> {
        1..self.clusters.len() + 1
    }

    pub(super) fn at(&self, index: usize) -> &Cluster {
        &self.clusters[index - 1]
    }

    /// Coordinates of the points of a cluster, `[k, d]`.
    pub(super) fn coordinates(&self, index: usize) -> &[f64] {
        let (d, Range { start, end }) = (self.points.dimension(), self.at(index).points.clone());
        &self.points.coordinates()[start * d..end * d]
    }
}

impl Cluster {
    fn of(cloud: &Cloud, order: &[u32], range: Range<usize>) -> Self {
        let (points, d) = (&order[range.clone()], cloud.dimension());
        let mean = mean(cloud, points);
        let (_, axes) = symmetric_eigen(&second_moments(cloud, points, &mean), d);
        let (mut low, mut high) =
            (Small::from_elem(f64::INFINITY, d), Small::from_elem(f64::NEG_INFINITY, d));
        for &point in points {
            for ((axis, low), high) in axes.chunks_exact(d).zip(&mut low).zip(&mut high) {
                let along = along(axis, cloud.point(point as usize), &mean);
                (*low, *high) = (low.min(along), high.max(along));
            }
        }
        let mut centre = zeros(d);
        for (c, x) in centre.iter_mut().enumerate() {
            let steps = axes.chunks_exact(d).zip(low.iter().zip(&high));
            *x = mean[c] + steps.map(|(axis, (low, high))| 0.5 * (low + high) * axis[c]).sum::<f64>();
        }
        let half = low.iter().zip(&high).map(|(low, high)| 0.5 * (high - low)).collect();
        let distances = points.iter().map(|&point| squared_distance(cloud.point(point as usize), &centre));
        let radius = distances.fold(0.0, f64::max).sqrt();
        Self { points: range, centre, axes, half, radius }
    }
}

/// Component of `x − origin` along an axis.
pub(super) fn along(axis: &[f64], x: &[f64], origin: &[f64]) -> f64 {
    axis.iter().zip(x).zip(origin).map(|((axis, x), origin)| axis * (x - origin)).sum()
}
