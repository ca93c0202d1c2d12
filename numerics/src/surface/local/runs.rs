//! Runs of points that follow each other and are near each other.

use std::ops::Range;

use crate::error::Result;
use crate::machine::small::{Small, zeros};
use crate::observer::{Observer, for_each};
use crate::points::cloud::{Cloud, squared_distance};
use crate::regression::sums::jets::Jets;

/// Points of ranges that are looked at between two checkpoints: some milliseconds.
const CHECKED_AT_ONCE: usize = 1 << 18;

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
    /// [`crate::error::NumericsError::Cancelled`]. Means of points are points.
    pub(super) fn of(cloud: &Cloud, reach: f64, observer: &dyn Observer) -> Result<Self> {
        let (mut ranges, mut middles) = (Vec::new(), Vec::new());
        let mut pending: Vec<Range<usize>> = std::iter::once(0..cloud.n_points()).collect();
        let mut n_seen = CHECKED_AT_ONCE;
        while let Some(range) = pending.pop() {
            n_seen += range.len();
            if n_seen >= CHECKED_AT_ONCE {
                observer.checkpoint()?;
                n_seen = 0;
            }
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
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn continued(
        &self,
        cloud: &Cloud,
        at_middles: &Jets,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        let d = cloud.dimension();
        let mut gradients = Vec::with_capacity(cloud.n_points() * d);
        for_each(self.ranges.iter().enumerate(), observer, |(run, range)| {
            let (middle, gradient) = (self.middles.point(run), at_middles.gradient(run));
            let hessian = at_middles.hessian(run);
            for x in range.clone().map(|point| cloud.point(point)) {
                let step: Small = x.iter().zip(middle).map(|(x, c)| x - c).collect();
                let rows = gradient.iter().zip(hessian.chunks_exact(d));
                gradients
                    .extend(rows.map(|(g, row)| g + row.iter().zip(&step).map(|(h, s)| h * s).sum::<f64>()));
            }
        })?;
        Ok(gradients)
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
    use crate::error::NumericsError;
    use crate::observer::Unobserved;
    use crate::testing::{StopAt, fibonacci_sphere};

    #[test]
    fn every_point_is_in_one_run_near_its_middle() {
        let cloud = fibonacci_sphere(500);
        for reach in [0.0, 0.05, 0.5, 3.0] {
            let runs = Runs::of(&cloud, reach, &Unobserved).unwrap();
            let points: Vec<usize> = runs.ranges.iter().flat_map(Clone::clone).collect();
            assert_eq!(points, (0..500).collect::<Vec<_>>());
            for (range, middle) in runs.ranges.iter().zip(runs.middles.points()) {
                let mut distances = range.clone().map(|point| squared_distance(cloud.point(point), middle));
                assert!(distances.all(|distance| distance <= reach * reach));
            }
        }
        assert_eq!(Runs::of(&cloud, 3.0, &Unobserved).unwrap().ranges.len(), 1);
    }

    #[test]
    fn runs_have_checkpoints_as_points_are_many() {
        let n_checkpoints = |n: usize| {
            let cloud = Cloud::new((0..n).map(|i| i as f64).collect(), 1).unwrap();
            let observer = StopAt::never();
            Runs::of(&cloud, 0.1, &observer).unwrap();
            observer.n_checkpoints()
        };
        assert!(n_checkpoints(600_000) > 20 && n_checkpoints(1000) < 3);
        let cloud = fibonacci_sphere(500);
        let outcome = Runs::of(&cloud, 0.1, &StopAt::checkpoint(0)).map(|runs| runs.ranges.len());
        assert_eq!(outcome, Err(NumericsError::Cancelled));
    }
}
