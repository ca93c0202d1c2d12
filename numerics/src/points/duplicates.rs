//! Exact duplicates among the points of a cloud, and the cloud with them merged.

use std::cmp::Ordering;
use std::collections::HashMap;

use super::cloud::Cloud;
use crate::error::Result;
use crate::observer::{Observer, for_each};

/// A hash table from coordinates to points. Coordinates match if they are equal to the bit.
pub(crate) struct Positions(HashMap<Box<[u64]>, usize>);

impl Positions {
    /// Builds the table. Points that coincide are represented by the first of them.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(crate) fn of(cloud: &Cloud, observer: &dyn Observer) -> Result<Self> {
        let mut positions = HashMap::with_capacity(cloud.n_points());
        for_each(cloud.points().enumerate(), observer, |(point, x)| {
            positions.entry(bits(x)).or_insert(point);
        })?;
        Ok(Self(positions))
    }

    pub(crate) fn find(&self, x: &[f64]) -> Option<usize> {
        self.0.get(&bits(x)).copied()
    }

    pub(crate) fn n_distinct(&self) -> usize {
        self.0.len()
    }
}

/// Bits of the coordinates. `Cloud` stores no −0.0 and no NaN, so equal coordinates have equal bits.
fn bits(x: &[f64]) -> Box<[u64]> {
    x.iter().map(|c| c.to_bits()).collect()
}

/// Number of points that coincide with an earlier one.
pub fn count_duplicates(cloud: &Cloud) -> usize {
    let order = sorted(cloud, |_| true);
    order.windows(2).filter(|pair| coincide(cloud, pair[0], pair[1])).count()
}

/// Returns the points for which `counts` holds, sorted by their coordinates, so that equal points are
/// adjacent.
///
/// A hash table would leave thousands of small holes in the allocator, among allocations that are kept.
fn sorted(cloud: &Cloud, counts: impl Fn(usize) -> bool) -> Vec<u32> {
    let row = |point: u32| cloud.point(point as usize);
    let compare = |&a: &u32, &b: &u32| {
        let different = row(a).iter().zip(row(b)).map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne());
        different.unwrap_or(Ordering::Equal)
    };
    let mut order: Vec<u32> = (0..cloud.n_points() as u32).filter(|&point| counts(point as usize)).collect();
    order.sort_unstable_by(compare);
    order
}

fn coincide(cloud: &Cloud, a: u32, b: u32) -> bool {
    cloud.point(a as usize) == cloud.point(b as usize)
}

/// Returns all points that share their position with another one, ascending, among those for which `counts`
/// holds.
pub(crate) fn coinciding_points(cloud: &Cloud, counts: impl Fn(usize) -> bool) -> Vec<usize> {
    let order = sorted(cloud, counts);
    let groups = order.chunk_by(|&a, &b| coincide(cloud, a, b)).filter(|group| group.len() > 1);
    let mut points: Vec<usize> = groups.flatten().map(|&point| point as usize).collect();
    points.sort_unstable();
    points
}

/// Returns the rows that repeat the position and the value, `[n]`, of an earlier one, ascending.
pub fn row_copies(cloud: &Cloud, values: &[f64]) -> Vec<RowCopy> {
    let order = sorted(cloud, |_| true);
    let value = |row: u32| values[row as usize] + 0.0;
    let mut copies = Vec::new();
    for together in order.chunk_by(|&a, &b| coincide(cloud, a, b)).filter(|rows| rows.len() > 1) {
        let mut rows = together.to_vec();
        rows.sort_unstable_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
        for equal in rows.chunk_by(|&a, &b| value(a) == value(b)) {
            let of = equal[0] as usize;
            copies.extend(equal[1..].iter().map(|&row| RowCopy { row: row as usize, of }));
        }
    }
    copies.sort_unstable_by_key(|copy| copy.row);
    copies
}

/// Flops of [`Merge::duplicates_of`], which allocates and looks up each position: an estimate of 500 ns each.
pub fn merging_flops(n_points: usize) -> f64 {
    1e4 * n_points as f64
}

/// A map from the points of a cloud to merged points, one per distinct position. n′ is the number of merged
/// points.
///
/// Merging replaces values by their mean over each group of coinciding points. This linear map is
/// [`Merge::mean`], of shape `[n′, n]`. [`Merge::spread`] is its transpose: matrices keep one column per
/// point of the original cloud, with the weight split equally within a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Merge {
    group_of: Vec<usize>,
    group_sizes: Vec<usize>,
    /// The first point of each group.
    first_points: Vec<usize>,
}

/// A row that repeats an earlier one: its position, and whatever belongs to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowCopy {
    pub row: usize,
    /// The earlier row, which repeats no other.
    pub of: usize,
}

impl Merge {
    /// Returns the cloud without copies, which ascend, and its map.
    pub fn copies(cloud: &Cloud, copies: &[RowCopy]) -> (Cloud, Self) {
        let mut original: Vec<usize> = (0..cloud.n_points()).collect();
        copies.iter().for_each(|copy| original[copy.row] = copy.of);
        let first_points: Vec<usize> =
            original.iter().enumerate().filter(|(row, of)| row == *of).map(|(row, _)| row).collect();
        let mut group_of = vec![0; cloud.n_points()];
        first_points.iter().enumerate().for_each(|(group, &row)| group_of[row] = group);
        let mut group_sizes = vec![1; first_points.len()];
        for copy in copies {
            group_of[copy.row] = group_of[copy.of];
            group_sizes[group_of[copy.of]] += 1;
        }
        (cloud.select(&first_points), Self { group_of, group_sizes, first_points })
    }

    /// Returns the cloud of distinct positions, in the order of their first occurrence, and its map. Returns
    /// `None` if there is nothing to merge.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub fn duplicates_of(cloud: &Cloud, observer: &dyn Observer) -> Result<Option<(Cloud, Merge)>> {
        let positions = Positions::of(cloud, observer)?;
        if positions.n_distinct() == cloud.n_points() {
            return Ok(None);
        }
        let mut coordinates = Vec::with_capacity(positions.n_distinct() * cloud.dimension());
        let mut group_of = vec![0; cloud.n_points()];
        let mut group_sizes = Vec::with_capacity(positions.n_distinct());
        let mut first_points = Vec::with_capacity(positions.n_distinct());
        for_each(cloud.points().enumerate(), observer, |(point, x)| {
            // The table holds every point's position, so the default is never used.
            let first = positions.find(x).unwrap_or(point);
            if first == point {
                group_of[point] = group_sizes.len();
                group_sizes.push(1);
                first_points.push(point);
                coordinates.extend_from_slice(x);
            } else {
                group_of[point] = group_of[first];
                group_sizes[group_of[first]] += 1;
            }
        })?;
        let merged = Cloud::new(coordinates, cloud.dimension())?;
        Ok(Some((merged, Merge { group_of, group_sizes, first_points })))
    }

    /// Number of points before merging, n.
    pub fn n_points(&self) -> usize {
        self.group_of.len()
    }

    /// Number of points that merging removed, n − n′.
    pub fn n_merged(&self) -> usize {
        self.group_of.len() - self.group_sizes.len()
    }

    /// Returns the first point of a group.
    pub fn first_point(&self, group: usize) -> usize {
        self.first_points[group]
    }

    /// Returns the mean of the values over each group, `[n] → [n′]`.
    pub fn mean(&self, values: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.group_sizes.len()];
        for (&group, &value) in self.group_of.iter().zip(values) {
            means[group] += value / self.group_sizes[group] as f64;
        }
        means
    }

    /// Returns the number of its group for each point, `[n′] → [n]`.
    pub fn repeated(&self, of_groups: &[f64]) -> Vec<f64> {
        self.group_of.iter().map(|&group| of_groups[group]).collect()
    }

    /// Returns the matrix with each entry split equally over its group, row by row, `[rows, n′] → [rows, n]`.
    pub fn spread(&self, matrix: &[f64]) -> Vec<f64> {
        let spread_row = |row: &[f64]| {
            let split = |&group: &usize| row[group] / self.group_sizes[group] as f64;
            self.group_of.iter().map(split).collect::<Vec<f64>>()
        };
        matrix.chunks_exact(self.group_sizes.len()).flat_map(spread_row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::NumericsError;
    use crate::observer::Unobserved;
    use crate::testing::StopAt;

    fn cloud() -> Cloud {
        Cloud::new(vec![5.0, 1.0, 5.0, 2.0, 1.0, 5.0], 1).unwrap()
    }

    #[test]
    fn coinciding_points_are_all_named() {
        assert_eq!(coinciding_points(&cloud(), |_| true), [0, 1, 2, 4, 5]);
        assert_eq!(coinciding_points(&cloud(), |point| point != 1), [0, 2, 5]);
        assert_eq!(count_duplicates(&cloud()), 3);
    }

    #[test]
    fn merging_keeps_the_order_of_first_occurrence_and_averages() {
        let merged = |cloud: &Cloud| Merge::duplicates_of(cloud, &Unobserved).unwrap();
        let (cloud, merge) = merged(&cloud()).unwrap();
        assert_eq!(cloud.coordinates(), [5.0, 1.0, 2.0]);
        assert_eq!((merge.n_points(), merge.n_merged()), (6, 3));
        assert_eq!([0, 1, 2].map(|group| merge.first_point(group)), [0, 1, 3]);
        assert_eq!(merge.mean(&[3.0, 1.0, 6.0, 7.0, 3.0, 9.0]), [6.0, 2.0, 7.0]);
        assert_eq!(merge.spread(&[3.0, 4.0, 5.0]), [1.0, 2.0, 1.0, 5.0, 2.0, 1.0]);
        assert_eq!(merged(&cloud), None);
    }

    #[test]
    fn rows_that_repeat_point_and_value_are_copies_of_the_first() {
        let copies = row_copies(&cloud(), &[3.0, 1.0, 3.0, 7.0, 2.0, 0.0]);
        assert_eq!(copies, [RowCopy { row: 2, of: 0 }]);
        let (without, merge) = Merge::copies(&cloud(), &copies);
        assert_eq!(without.coordinates(), [5.0, 1.0, 2.0, 1.0, 5.0]);
        assert_eq!(merge.repeated(&[10.0, 11.0, 12.0, 13.0, 14.0]), [10.0, 11.0, 10.0, 12.0, 13.0, 14.0]);
        assert_eq!(row_copies(&cloud(), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), []);
    }

    #[test]
    fn merging_stops_at_every_checkpoint_and_has_more_for_more_points() {
        let merged = |n: usize, last: usize| {
            let cloud = Cloud::new((0..n).map(|point| (point / 2) as f64).collect(), 1).unwrap();
            let observer = StopAt::checkpoint(last);
            let merged = Merge::duplicates_of(&cloud, &observer).map(|found| found.unwrap().1.n_merged());
            (merged, observer.n_checkpoints())
        };
        let (n_merged, n_checkpoints) = merged(100_000, usize::MAX);
        assert_eq!(n_merged, Ok(50_000));
        assert!(n_checkpoints > 20 && merged(1000, usize::MAX).1 < 5, "{n_checkpoints}");
        for last in 0..n_checkpoints {
            assert_eq!(merged(100_000, last).0, Err(NumericsError::Cancelled));
        }
    }
}
