//! Runs of points that follow each other and are near each other.

use std::ops::Range;

use crate::error::Result;
use crate::machine::small::{Small, zeros};
use crate::points::cloud::{Cloud, squared_distance};
use crate::sums::jets::Jets;

/// The points of a cloud in runs, each within a ball.
pub(super) struct Runs {
    pub ranges: Vec<Range<usize>>,
    /// Mean of the points of each run, `[r, d]`.
    pub middles: Cloud,
}

impl Runs {
    /// Halves the points until every run is within `reach` of its middle.
    ///
    /// # Errors
    /// None: means of points are points. The type of a cloud checks them again.
    pub(super) fn of(cloud: &Cloud, reach: f64) -> Result<Self> {
        let (mut ranges, mut middles) = (Vec::new(), Vec::new());
        let mut pending: Vec<Range<usize>> = std::iter::once(0..cloud.n_points()).collect();
        while let Some(range) = pending.pop() {
            let middle = range.start.midpoint(range.end);
            match mean_within(cloud, range.clone(), reach) {
                Some(mean) => {
                    middles.extend(mean);
                    ranges.push(range);
                }
                None => pending.extend([middle..range.end, range.start..middle]),
            }
        }
        Ok(Self { ranges, middles: Cloud::new(middles, cloud.dimension())? })
    }

    /// Gradients at the points of the cloud, `[n, d]`, from derivatives at the middles:
    /// `∇u(c) + D²u(c)(x − c)`.
    pub(super) fn continued(&self, cloud: &Cloud, at_middles: &Jets) -> Vec<f64> {
        let d = cloud.dimension();
        let mut gradients = Vec::with_capacity(cloud.n_points() * d);
        for (run, range) in self.ranges.iter().enumerate() {
            let (middle, gradient) = (self.middles.point(run), at_middles.gradient(run));
            let hessian = at_middles.hessian(run);
            for x in range.clone().map(|point| cloud.point(point)) {
                let step: Small = x.iter().zip(middle).map(|(x, c)| x - c).collect();
                let rows = gradient.iter().zip(hessian.chunks_exact(d));
                gradients
                    .extend(rows.map(|(g, row)| g + row.iter().zip(&step).map(|(h, s)| h * s).sum::<f64>()));
            }
        }
        gradients
    }
}

/// Mean of the points in a range, if all are within `reach` of it. That of a single point is the point.
fn mean_within(cloud: &Cloud, range: Range<usize>, reach: f64) -> Option<Small> {
    let (first, last) = (cloud.point(range.start), cloud.point(range.end - 1));
    if range.len() == 1 {
        return Some(first.into());
    }
    // Long ranges are seen not to fit without a look at all of their points.
    if squared_distance(first, last) > 4.0 * reach * reach {
        return None;
    }
    let mut mean = zeros(cloud.dimension());
    for point in range.clone() {
        mean.iter_mut().zip(cloud.point(point)).for_each(|(sum, x)| *sum += x / range.len() as f64);
    }
    let is_near = |point| squared_distance(cloud.point(point), &mean) <= reach * reach;
    range.into_iter().all(is_near).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn every_point_is_in_one_run_near_its_middle() {
        let cloud = fibonacci_sphere(500);
        for reach in [0.0, 0.05, 0.5, 3.0] {
            let runs = Runs::of(&cloud, reach).unwrap();
            let points: Vec<usize> = runs.ranges.iter().flat_map(Clone::clone).collect();
            assert_eq!(points, (0..500).collect::<Vec<_>>());
            for (range, middle) in runs.ranges.iter().zip(runs.middles.points()) {
                let mut distances = range.clone().map(|point| squared_distance(cloud.point(point), middle));
                assert!(distances.all(|distance| distance <= reach * reach));
            }
        }
        assert_eq!(Runs::of(&cloud, 3.0).unwrap().ranges.len(), 1);
    }
}
