//! A cloud partitioned into cells of near points.

use super::cloud::{Cloud, squared_distance};
use crate::machine::small::{Small, zeros};

/// Number of points above which the two halves are split in parallel.
const SHARED: usize = 4096;

/// A partition of points into cells, made by halving until no cell exceeds a given number of points.
///
/// Each halving cuts across the direction in which the points reach farthest. All cells have nearly as many
/// points. Neighbours in the list of cells are mostly neighbours in space.
pub(crate) struct Cells {
    /// Point indices, cell by cell.
    points: Vec<u32>,
    /// End of each cell within `points`.
    ends: Vec<u32>,
}

impl Cells {
    /// Partitions `points` of a cloud into cells of at most `most` points each.
    pub(crate) fn of(cloud: &Cloud, mut points: Vec<u32>, most: usize) -> Self {
        let sizes = split(cloud, &mut points, most.max(1));
        let add = |end: &mut u32, size: u32| {
            *end += size;
            Some(*end)
        };
        Self { points, ends: sizes.into_iter().scan(0, add).collect() }
    }

    /// Partitions all points of a cloud into cells of at most `most` points each.
    pub(crate) fn of_all(cloud: &Cloud, most: usize) -> Self {
        Self::of(cloud, (0..cloud.n_points() as u32).collect(), most)
    }

    pub(crate) fn n_cells(&self) -> usize {
        self.ends.len()
    }

    /// Iterates over the cells, each as a slice of point indices.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.points[start as usize..end as usize])
    }
}

/// Reorders points cell by cell and returns the size of each cell.
fn split(cloud: &Cloud, points: &mut [u32], most: usize) -> Vec<u32> {
    let n = points.len();
    if n <= most {
        return vec![n as u32];
    }
    let (left, right) = halve(cloud, points, n / 2);
    let (mut sizes, others) = if n > SHARED {
        rayon::join(|| split(cloud, left, most), || split(cloud, right, most))
    } else {
        (split(cloud, left, most), split(cloud, right, most))
    };
    sizes.extend(others);
    sizes
}

/// Splits points into the first `middle` and the rest, ordered along a line between two points that lie far
/// apart.
///
/// The line starts at the point farthest from the mean of the points. It ends at the point farthest from its
/// start. Ties at `middle` are broken by index. The cut turns with the cloud, unlike cuts parallel to the
/// axes, so nothing computed from the halves depends on the axes.
pub(crate) fn halve<'a>(
    cloud: &Cloud,
    points: &'a mut [u32],
    middle: usize,
) -> (&'a mut [u32], &'a mut [u32]) {
    let position = |point: u32| cloud.point(point as usize);
    let start = farthest(cloud, points, &mean(cloud, points));
    let end = farthest(cloud, points, &start);
    let along = |point: u32| -> f64 {
        position(point).iter().zip(&start).zip(&end).map(|((x, from), to)| (x - from) * (to - from)).sum()
    };
    if middle < points.len() {
        points.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    }
    points.split_at_mut(middle)
}

/// Returns the position of the point farthest from x, or x if there are no points.
fn farthest(cloud: &Cloud, points: &[u32], x: &[f64]) -> Small {
    let mut found = (-1.0, x);
    for &point in points {
        let position = cloud.point(point as usize);
        let distance = squared_distance(position, x);
        if distance > found.0 {
            found = (distance, position);
        }
    }
    Small::from_slice(found.1)
}

/// Mean of `points`, `[d]`, unit L. Zero if there are none.
pub(crate) fn mean(cloud: &Cloud, points: &[u32]) -> Small {
    let mut mean = zeros(cloud.dimension());
    let Some(&first) = points.first() else { return mean };
    // Differences to the first point are summed, so that no digit is lost far from the origin.
    let origin = cloud.point(first as usize);
    for &point in points {
        let position = cloud.point(point as usize);
        mean.iter_mut().zip(position).zip(origin).for_each(|((sum, x), o)| *sum += x - o);
    }
    mean.iter_mut().zip(origin).for_each(|(mean, o)| *mean = o + *mean / points.len() as f64);
    mean
}

/// Second moments of `points` about their mean, divided by their number: `[d, d]`, unit L².
pub(crate) fn second_moments(cloud: &Cloud, points: &[u32], mean: &[f64]) -> Small {
    let d = mean.len();
    let mut moments = zeros(d * d);
    for &point in points {
        let arm: Small = cloud.point(point as usize).iter().zip(mean).map(|(x, mean)| x - mean).collect();
        for (at, moment) in moments.iter_mut().enumerate() {
            *moment += arm[at / d] * arm[at % d] / points.len() as f64;
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn every_point_is_in_one_cell_and_cells_are_alike_and_small() {
        let cloud = fibonacci_sphere(1000);
        for most in [1, 7, 64, 999, 5000] {
            let cells = Cells::of_all(&cloud, most);
            let mut points: Vec<u32> = cells.iter().flatten().copied().collect();
            points.sort_unstable();
            assert!(points.into_iter().eq(0..1000));
            // A cell is split only if it exceeds `most`, so no half is smaller than `most / 2` rounded down.
            assert!(cells.iter().all(|cell| (most.min(999) / 2..=most).contains(&cell.len()) || most == 1));
        }
        // A cell is a 64th of the sphere: as a cap it has radius 0.25. Cells are at most three times as long
        // as wide.
        for cell in Cells::of_all(&cloud, 16).iter() {
            let first = cloud.point(cell[0] as usize);
            let is_near = |&point: &u32| {
                let x = cloud.point(point as usize);
                x.iter().zip(first).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() < 1.0
            };
            assert!(cell.iter().all(is_near));
        }
    }
}
