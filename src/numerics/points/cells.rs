//! A cloud in cells of near points.

use super::cloud::Cloud;
use super::thinning::widest_axis;

/// Points in cells: halves of halves across their widest side, until none has more than a number of points.
///
/// All cells have nearly as many points. Neighbours in the list of cells are mostly neighbours in space.
pub(crate) struct Cells {
    /// Cell by cell.
    points: Vec<u32>,
    /// Where each cell ends among them.
    ends: Vec<u32>,
}

impl Cells {
    /// Cells of at most `most` points each, of some points of a cloud.
    pub(crate) fn of(cloud: &Cloud, mut points: Vec<u32>, most: usize) -> Self {
        let mut ends = Vec::with_capacity(2 * points.len() / most.max(1) + 1);
        halve(cloud, &mut points, most.max(1), &mut ends);
        Self { points, ends }
    }

    /// Cells of all points of a cloud.
    pub(crate) fn of_all(cloud: &Cloud, most: usize) -> Self {
        Self::of(cloud, (0..cloud.n_points() as u32).collect(), most)
    }

    pub(crate) fn n_cells(&self) -> usize {
        self.ends.len()
    }

    /// The points of each cell.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.points[start as usize..end as usize])
    }
}

fn halve(cloud: &Cloud, points: &mut [u32], most: usize, ends: &mut Vec<u32>) {
    if points.len() <= most {
        let before = ends.last().copied().unwrap_or(0);
        ends.push(before + points.len() as u32);
        return;
    }
    let axis = widest_axis(cloud, points);
    let coordinate = |point: u32| cloud.point(point as usize)[axis];
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |&a, &b| coordinate(a).total_cmp(&coordinate(b)).then(a.cmp(&b)));
    let (left, right) = points.split_at_mut(middle);
    halve(cloud, left, most, ends);
    halve(cloud, right, most, ends);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::testing::fibonacci_sphere;

    #[test]
    fn every_point_is_in_one_cell_and_cells_are_alike_and_small() {
        let cloud = fibonacci_sphere(1000);
        for most in [1, 7, 64, 999, 5000] {
            let cells = Cells::of_all(&cloud, most);
            let mut points: Vec<u32> = cells.iter().flatten().copied().collect();
            points.sort_unstable();
            assert!(points.into_iter().eq(0..1000));
            // Half of more than the most, rounded down.
            assert!(cells.iter().all(|cell| (most.min(999) / 2..=most).contains(&cell.len()) || most == 1));
        }
        // A 64th of the sphere is a cap of radius 0.25, and cells are at most three times as long as wide.
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
