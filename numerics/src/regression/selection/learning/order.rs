//! Order in which points explain each other.
//!
//! A likelihood of n values takes n³ flops. It is the product of the likelihoods of each value given those
//! before it. Of those before it, the near ones say nearly all (Vecchia 1988). Here values are taken in
//! groups of near ones, each given the nearest of the values that come before (Stein, Chi and Welty 2004).
//!
//! The first group is a sample of near and far points. One half of the others is given points of the sample,
//! and the other half is given points of all. Levels that double from the sample on came nearer to the
//! likelihood of all values, but their bands covered less. Smooth kernels then won more often where a field
//! has a kink.

use super::ObservedCloud;
use crate::error::Result;
use crate::observer::Observer;
use crate::points::cells::{Cells, mean};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::points::thinning::thinned_points;

/// Largest number of values that are taken together.
pub(super) const MAX_TOGETHER: usize = 384;

/// Largest number of points of the sample, where there are too many values to take together.
pub(super) const MAX_SAMPLE: usize = 128;

/// Number of points of the sample that lie together. Noise shows between near points, everything else between
/// far ones.
const TOGETHER: usize = 16;

/// Largest number of values of a group. It is given [`GIVEN`] values of others.
pub(super) const RESPONSES: usize = 32;
pub(super) const GIVEN: usize = 32;

/// Largest size of the cells of near values by which a group is ordered. Larger groups are halved, so their
/// cells have at least half as many values.
pub(super) const PLACE: usize = 16;

/// Number of groups of the last half that are given many more values. How a smooth kernel fits near values
/// alone says little about how it fits all of them.
///
/// From 32 of 2,000 exact values of a front, Gauss of ten spacings seemed right, although its deviations are
/// a fourteenth of its errors.
pub(super) const DEEP_GROUPS: usize = 16;
pub(super) const GIVEN_DEEP: usize = 256;

/// Largest number of groups of a half that a search uses. More of them do not change hyperparameters.
pub(super) const MAX_GROUPS: usize = 96;

/// Points whose values are explained, given those of others.
pub(super) struct Conditional {
    /// Indices of the points, the given ones first.
    pub(super) points: Vec<usize>,
    pub(super) n_given: usize,
}

impl Conditional {
    /// Creates a conditional of some points that are given none.
    pub(super) fn whole(points: Vec<usize>) -> Self {
        Self { points, n_given: 0 }
    }
}

/// The positions of a cloud in groups, each by its first point.
pub(super) struct Order {
    /// Groups by which hyperparameters are searched.
    pub(super) searched: Vec<Conditional>,
    /// Some of the last groups again, given more points.
    pub(super) deep: Vec<Conditional>,
}

impl Order {
    /// Orders the points. The first group is a sample, unless all points form one group.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn of(observed: &ObservedCloud<'_>, observer: &dyn Observer) -> Result<Self> {
        let cloud = observed.cloud;
        if observed.sampling.neighbours().n_positions() <= MAX_TOGETHER {
            let halves = halves(observed, &[]);
            let all = Conditional::whole(halves.iter().flat_map(|half| by_places(cloud, half)).collect());
            return Ok(Self { searched: vec![all], deep: Vec::new() });
        }
        let sample = sample(observed, observer)?;
        let halves = halves(observed, &sample);
        let mut earlier = sample.clone();
        let mut found = Self { searched: vec![Conditional::whole(sample)], deep: Vec::new() };
        for (half, is_last) in halves.into_iter().zip([false, true]) {
            observer.checkpoint()?;
            let tree = Neighbours::of(&cloud.select(&earlier), observer)?;
            let cells = Cells::of(cloud, half.clone(), RESPONSES);
            let near = |cell: &[u32], count: usize| -> Conditional {
                let near = tree.nearest(&mean(cloud, cell), count);
                let given = near.iter().map(|neighbour| earlier[neighbour.point]);
                let points = given.chain(by_places(cloud, cell)).collect();
                Conditional { n_given: near.len(), points }
            };
            let spread = |count: usize| cells.iter().step_by(cells.n_cells().div_ceil(count));
            found.searched.extend(spread(MAX_GROUPS).map(|cell| near(cell, GIVEN)));
            if is_last {
                found.deep.extend(spread(DEEP_GROUPS).map(|cell| near(cell, GIVEN_DEEP)));
            }
            earlier.extend(half.iter().map(|&point| point as usize));
        }
        Ok(found)
    }
}

/// Returns the sample: groups of near points, spread over the cloud.
///
/// # Errors
/// `NumericsError::Cancelled`.
fn sample(observed: &ObservedCloud<'_>, observer: &dyn Observer) -> Result<Vec<usize>> {
    let cloud = observed.cloud;
    let centres = thinned_points(cloud, MAX_SAMPLE / TOGETHER, observer)?;
    let around = |&point: &usize| {
        let near = observed.sampling.neighbours().nearest_positions(cloud.point(point), TOGETHER);
        near.into_iter().map(|neighbour| neighbour.point)
    };
    let mut points: Vec<usize> = centres.iter().flat_map(around).collect();
    points.sort_unstable();
    points.dedup();
    Ok(points)
}

/// Splits the points outside of the sample into two halves, each spread over the cloud. Of every two near
/// points, each half has one.
fn halves(observed: &ObservedCloud<'_>, sample: &[usize]) -> [Vec<u32>; 2] {
    let neighbours = observed.sampling.neighbours();
    let mut is_left = vec![false; observed.cloud.n_points()];
    for position in 0..neighbours.n_positions() {
        is_left[neighbours.points_at(position)[0] as usize] = true;
    }
    sample.iter().for_each(|&point| is_left[point] = false);
    let left = (0..is_left.len() as u32).filter(|&point| is_left[point as usize]).collect();
    let mut halves = [Vec::new(), Vec::new()];
    for cell in Cells::of(observed.cloud, left, 2).iter() {
        let first = lonelier(observed, cell);
        halves[0].extend(first);
        halves[1].extend(cell.iter().filter(|&&point| Some(point) != first));
    }
    halves
}

/// Orders some points so that near ones follow each other.
fn by_places(cloud: &Cloud, points: &[u32]) -> Vec<usize> {
    Cells::of(cloud, points.to_vec(), PLACE).iter().flatten().map(|&point| point as usize).collect()
}

/// Returns the point of a cell whose neighbours are farthest away, the first of equals.
fn lonelier(observed: &ObservedCloud<'_>, cell: &[u32]) -> Option<u32> {
    let spacing = |point: u32| observed.sampling.spacing(point as usize);
    cell.iter().copied().max_by(|&a, &b| spacing(a).total_cmp(&spacing(b)).then(b.cmp(&a)))
}

#[cfg(test)]
mod tests {
    use super::super::Noise;
    use super::*;
    use crate::observer::Unobserved;
    use crate::points::sampling::Sampling;
    use crate::regression::solver::trend::Mean;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn every_point_is_explained_once_by_earlier_ones() {
        for n in [100, MAX_TOGETHER, MAX_TOGETHER + 1, 3000, 40_000] {
            let (cloud, values) = (fibonacci_sphere(n), vec![0.0; n]);
            let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
            let (noise, mean) = (Noise::Unknown, Mean::Zero);
            let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
            let order = Order::of(&observed, &Unobserved).unwrap();
            let mut is_explained = vec![false; n];
            for group in &order.searched {
                let (given, responses) = group.points.split_at(group.n_given);
                assert!(given.len() <= GIVEN && (given.is_empty() || responses.len() <= RESPONSES));
                // If groups are left out, their responses may be given later all the same.
                assert!(n > 3000 || given.iter().all(|&point| is_explained[point]));
                for &point in responses {
                    assert!(!std::mem::replace(&mut is_explained[point], true), "{point} of {n}");
                }
            }
            // Small clouds are searched by all groups. In larger ones, each half has at most as many as are
            // allowed.
            assert!(n > 3000 || is_explained.iter().all(|&is| is));
            assert!(order.searched.len() <= 1 + 2 * MAX_GROUPS);
            assert_eq!(order.deep.is_empty(), n <= MAX_TOGETHER);
            assert!(order.deep.len() <= DEEP_GROUPS);
        }
    }
}
