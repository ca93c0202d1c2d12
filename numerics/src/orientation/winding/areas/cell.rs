//! The Voronoi cell of a point in its tangent plane: the region that is nearer to it than to its neighbours.

use smallvec::SmallVec;

/// A position in the plane, relative to the point whose cell it is.
pub(super) type Planar = [f64; 2];

/// Corners of the polygon that a cell is cut from. At a rim, where neighbours do not close the cell, the
/// polygon does.
const N_CORNERS: usize = 8;

/// A convex polygon about the origin.
pub(super) struct Cell {
    corners: SmallVec<[Planar; 16]>,
}

impl Cell {
    /// Returns a regular polygon with its corners at this distance from the origin.
    pub(super) fn within(radius: f64) -> Self {
        let corner = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / N_CORNERS as f64;
            [radius * angle.cos(), radius * angle.sin()]
        };
        Self { corners: (0..N_CORNERS).map(corner).collect() }
    }

    /// Cuts off what is nearer to a neighbour than to the origin.
    pub(super) fn cut(&mut self, neighbour: Planar) {
        let [x, y] = neighbour;
        let beyond = |corner: &Planar| corner[0] * x + corner[1] * y - 0.5 * (x * x + y * y);
        let mut left = SmallVec::new();
        for (i, corner) in self.corners.iter().enumerate() {
            let next = &self.corners[(i + 1) % self.corners.len()];
            let (here, there) = (beyond(corner), beyond(next));
            if here <= 0.0 {
                left.push(*corner);
            }
            if (here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0) {
                let share = here / (here - there);
                left.push([0, 1].map(|c| corner[c] + share * (next[c] - corner[c])));
            }
        }
        self.corners = left;
    }

    pub(super) fn area(&self) -> f64 {
        let following = self.corners.iter().cycle().skip(1);
        let doubled: f64 = self.corners.iter().zip(following).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
        0.5 * doubled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_lattices_are_their_parallelograms() {
        for [a, b] in
            [[[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.5, 0.75f64.sqrt()]], [[1.0, 0.2], [-0.1, 0.7]]]
        {
            let mut cell = Cell::within(5.0);
            for (i, j) in [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2)] {
                let step = [0, 1].map(|c| f64::from(i) * a[c] + f64::from(j) * b[c]);
                cell.cut(step);
                cell.cut(step.map(|c| -c));
            }
            let expected = a[0] * b[1] - a[1] * b[0];
            assert!((cell.area() / expected - 1.0).abs() < 1e-14, "{a:?} {b:?}");
        }
    }

    #[test]
    fn cells_without_neighbours_on_one_side_end() {
        let mut cell = Cell::within(1.0);
        let octagon = 8.0 * 0.5f64.sqrt() / 2.0;
        assert!((cell.area() - octagon).abs() < 1e-14);
        cell.cut([0.0, 0.0]);
        assert!((cell.area() - octagon).abs() < 1e-14);
        cell.cut([1e-9, 0.0]);
        assert!((cell.area() - octagon / 2.0).abs() < 1e-8);
    }
}
