//! Winding numbers of oriented points: how often a surface winds around a place.
//!
//! Gauss's formula is `w(x) = Σ_y a_y ν_y·(y − x) / (|S^{d−1}| |y − x|^d)`, a_y the area that a point stands
//! for. With outward normals of a closed surface w is 1 inside, 0 outside, and ½ on the surface, where the
//! sum leaves x out. Far cells of a tree count as one dipole each (Barill, Dickson, Schmidt, Levin and
//! Jacobson, "Fast winding numbers for soups and clouds", 2018).

use rayon::prelude::*;
use smallvec::SmallVec;

use crate::machine::small::{Small, zeros};
use crate::machine::vector::norm;
use crate::points::cloud::{Cloud, squared_distance};

/// Points per leaf, whose terms are summed one by one.
const LEAF_SIZE: usize = 16;

/// Points of the half of a cell from which both halves are split at the same time.
const TOGETHER: usize = 4096;

/// Radii of a cell beyond which it counts as one dipole: β of the paper.
const OPENING: f64 = 2.0;

/// Softening length over the width of a point's area. Within this length the term of a point is that of a
/// smooth density. Otherwise normals that are off would count without bound at near points.
const SOFTENING: f64 = 0.35;

/// Points with areas and normals, in a tree of cells.
pub(crate) struct Dipoles {
    dimension: usize,
    /// Positions leaf by leaf, `[m, d]`.
    positions: Vec<f64>,
    /// Area times normal, `[m, d]`, in the order of the positions.
    moments: Vec<f64>,
    /// Squared softening lengths, which are added to squared distances, `[m]`.
    softenings: Vec<f64>,
    tree: Tree,
    inverse_sphere: f64,
}

/// Cells, the first child after its parent.
#[derive(Default)]
struct Tree {
    cells: Vec<Cell>,
    /// Mean positions, weighted by area, `[c, d]`.
    centres: Vec<f64>,
    /// Sums of the moments, `[c, d]`.
    moments: Vec<f64>,
}

/// A range of points.
struct Cell {
    start: u32,
    end: u32,
    /// Cells from this one to the second child, 0 for a leaf.
    right: u32,
    /// Greatest distance of a point from the centre, squared.
    squared_radius: f64,
}

impl Tree {
    fn append(&mut self, mut other: Self) {
        self.cells.append(&mut other.cells);
        self.centres.append(&mut other.centres);
        self.moments.append(&mut other.moments);
    }
}

impl Dipoles {
    /// Builds the tree over some points of a cloud. `moments` are area times normal of all points of the
    /// cloud, `[n, d]`.
    pub(crate) fn of(cloud: &Cloud, moments: &[f64], points: &[usize]) -> Self {
        let d = cloud.dimension();
        let mut order: Vec<u32> = points.iter().map(|&point| point as u32).collect();
        let mut tree = Tree::default();
        let builder = Builder { cloud, moments };
        builder.split(&mut tree, &mut order, 0);
        let rows = |of: &[f64]| -> Vec<f64> {
            order.iter().flat_map(|&point| of[point as usize * d..][..d].iter().copied()).collect()
        };
        let (positions, moments) = (rows(cloud.coordinates()), rows(moments));
        let inverse_sphere = 1.0 / (d as f64 * ball_volume(d));
        let mut dipoles =
            Self { dimension: d, positions, moments, softenings: Vec::new(), tree, inverse_sphere };
        dipoles.soften(SOFTENING);
        dipoles
    }

    /// Sets the softening length over the width of a point's area.
    pub(crate) fn soften(&mut self, softening: f64) {
        let d = self.dimension;
        let squared = |m: &[f64]| (softening * norm(m).powf(1.0 / (d - 1) as f64)).powi(2);
        self.softenings = self.moments.par_chunks_exact(d).map(squared).collect();
    }

    /// Returns w(x), leaving out points at x itself.
    pub(crate) fn winding(&self, x: &[f64]) -> f64 {
        let mut sum = 0.0;
        self.for_each_term(x, |moment, y, softening| sum += flux(moment, y, x, softening));
        sum * self.inverse_sphere
    }

    /// Returns w(x) and its gradient, `[d]`, leaving out points at x itself.
    pub(crate) fn winding_jet(&self, x: &[f64]) -> (f64, Small) {
        let (mut sum, mut gradient) = (0.0, zeros(x.len()));
        self.for_each_term(x, |moment, y, softening| {
            sum += flux(moment, y, x, softening);
            add_slope(Dipole { moment, y, softening }, x, &mut gradient);
        });
        gradient.iter_mut().for_each(|g| *g *= self.inverse_sphere);
        (sum * self.inverse_sphere, gradient)
    }

    /// Calls `take` with the moment, the position and the squared softening of each term of w(x).
    #[inline(always)]
    fn for_each_term(&self, x: &[f64], mut take: impl FnMut(&[f64], &[f64], f64)) {
        let (d, tree) = (self.dimension, &self.tree);
        let mut at = 0;
        let mut pending: SmallVec<[usize; 32]> = SmallVec::new();
        loop {
            let Some(cell) = tree.cells.get(at) else { return };
            let centre = &tree.centres[at * d..][..d];
            let is_far = squared_distance(centre, x) > OPENING * OPENING * cell.squared_radius;
            if is_far {
                take(&tree.moments[at * d..][..d], centre, 0.0);
            } else if cell.right > 0 {
                pending.push(at + cell.right as usize);
                at += 1;
                continue;
            } else {
                let (start, end) = (cell.start as usize, cell.end as usize);
                let (positions, moments) =
                    (&self.positions[start * d..end * d], &self.moments[start * d..end * d]);
                let terms = moments.chunks_exact(d).zip(positions.chunks_exact(d));
                terms
                    .zip(&self.softenings[start..end])
                    .for_each(|((moment, y), softening)| take(moment, y, *softening));
            }
            match pending.pop() {
                Some(next) => at = next,
                None => return,
            }
        }
    }
}

/// A term of w.
struct Dipole<'a> {
    moment: &'a [f64],
    y: &'a [f64],
    /// Squared softening length.
    softening: f64,
}

/// Adds the gradient of [`flux`] with respect to x, and 0 for y = x:
/// `−m/s^{d/2} + d (m·(y − x)) (y − x)/s^{d/2+1}`, `s = |y − x|² + softening`.
fn add_slope(dipole: Dipole<'_>, x: &[f64], gradient: &mut [f64]) {
    let Dipole { moment, y, softening } = dipole;
    let squared = squared_distance(x, y) + softening;
    if squared == 0.0 {
        return;
    }
    let d = x.len();
    let along: f64 = moment.iter().zip(y).zip(x).map(|((m, y), x)| m * (y - x)).sum();
    let power = root_to_power(squared, d);
    let radial = d as f64 * along / (squared * power);
    for axis in 0..d {
        gradient[axis] += radial * (y[axis] - x[axis]) - moment[axis] / power;
    }
}

/// Returns the term of one dipole, `m·(y − x)/(|y − x|² + softening)^{d/2}`, and 0 for y = x.
fn flux(moment: &[f64], y: &[f64], x: &[f64], softening: f64) -> f64 {
    let squared = squared_distance(x, y) + softening;
    if squared == 0.0 {
        return 0.0;
    }
    let along: f64 = moment.iter().zip(y).zip(x).map(|((m, y), x)| m * (y - x)).sum();
    along / root_to_power(squared, x.len())
}

/// The power d of a square root.
fn root_to_power(squared: f64, d: usize) -> f64 {
    match d {
        2 => squared,
        3 => squared * squared.sqrt(),
        d => squared.sqrt().powi(d as i32),
    }
}

/// Returns the volume of the unit ball in k dimensions: `V_k = V_{k−2} 2π/k`, from V_0 = 1 and V_1 = 2.
pub(crate) fn ball_volume(k: usize) -> f64 {
    match k {
        0 => 1.0,
        1 => 2.0,
        _ => ball_volume(k - 2) * std::f64::consts::TAU / k as f64,
    }
}

/// Returns the axis along which some points of a cloud spread most, the first one on a tie.
///
/// Sides that are in doubt may therefore come out differently for a rotated cloud. Axes that rotate with the
/// cloud give more wrong sides on folded strips.
fn widest_axis(cloud: &Cloud, points: &[u32]) -> usize {
    let extent = |axis: usize| {
        let along = || points.iter().map(|&point| cloud.point(point as usize)[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let wider = |best: (usize, f64), axis: usize| match extent(axis) {
        extent if extent > best.1 => (axis, extent),
        _ => best,
    };
    (0..cloud.dimension()).fold((0, f64::NEG_INFINITY), wider).0
}

struct Builder<'a> {
    cloud: &'a Cloud,
    moments: &'a [f64],
}

impl Builder<'_> {
    /// Appends the cells of these points, in halves across the widest side. `start` is the number of points
    /// before them.
    fn split(&self, tree: &mut Tree, order: &mut [u32], start: usize) {
        let this = tree.cells.len();
        self.push_cell(tree, order, start);
        if order.len() <= LEAF_SIZE || tree.cells[this].squared_radius == 0.0 {
            return;
        }
        let axis = widest_axis(self.cloud, order);
        let at = |point: u32| self.cloud.point(point as usize)[axis];
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| at(a).total_cmp(&at(b)).then(a.cmp(&b)));
        let (left, right) = order.split_at_mut(middle);
        if left.len() < TOGETHER {
            self.split(tree, left, start);
            tree.cells[this].right = (tree.cells.len() - this) as u32;
            self.split(tree, right, start + middle);
            return;
        }
        let (mut of_left, mut of_right) = (Tree::default(), Tree::default());
        rayon::join(
            || self.split(&mut of_left, left, start),
            || self.split(&mut of_right, right, start + middle),
        );
        tree.cells[this].right = 1 + of_left.cells.len() as u32;
        tree.append(of_left);
        tree.append(of_right);
    }

    fn push_cell(&self, tree: &mut Tree, order: &[u32], start: usize) {
        let d = self.cloud.dimension();
        let (mut centre, mut moment, mut total) = (zeros(d), zeros(d), 0.0);
        for &point in order {
            let own = &self.moments[point as usize * d..][..d];
            let area = norm(own);
            total += area;
            moment.iter_mut().zip(own).for_each(|(sum, m)| *sum += m);
            centre.iter_mut().zip(self.cloud.point(point as usize)).for_each(|(sum, x)| *sum += area * x);
        }
        match order.first() {
            Some(&first) if total == 0.0 => centre.copy_from_slice(self.cloud.point(first as usize)),
            Some(_) => centre.iter_mut().for_each(|c| *c /= total),
            None => {}
        }
        let squared = |&point: &u32| squared_distance(&centre, self.cloud.point(point as usize));
        let squared_radius = order.iter().map(squared).fold(0.0, f64::max);
        let (start, end) = (start as u32, (start + order.len()) as u32);
        tree.cells.push(Cell { start, end, right: 0, squared_radius });
        tree.centres.extend(centre);
        tree.moments.extend(moment);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{circle, fibonacci_sphere};

    /// Outward moments of equal areas.
    fn moments(cloud: &Cloud, area: f64) -> Vec<f64> {
        cloud.coordinates().iter().map(|c| c * area / cloud.n_points() as f64).collect()
    }

    #[test]
    fn spheres_wind_once_around_their_inside_and_half_on_themselves() {
        use std::f64::consts::TAU;
        for (cloud, area) in [(fibonacci_sphere(3000), 2.0 * TAU), (circle(500), TAU)] {
            let all: Vec<usize> = (0..cloud.n_points()).collect();
            let dipoles = Dipoles::of(&cloud, &moments(&cloud, area), &all);
            for (radius, expected, tolerance) in [(0.5, 1.0, 0.02), (1.5, 0.0, 0.02), (1.0, 0.5, 0.05)] {
                for x in cloud.points().step_by(97) {
                    let found = dipoles.winding(&x.iter().map(|c| radius * c).collect::<Vec<_>>());
                    assert!((found - expected).abs() < tolerance, "{radius}: {found}");
                }
            }
        }
    }

    #[test]
    fn far_cells_change_the_sum_by_little() {
        let cloud = fibonacci_sphere(2000);
        let moments = moments(&cloud, 1.0);
        let all: Vec<usize> = (0..2000).collect();
        let dipoles = Dipoles::of(&cloud, &moments, &all);
        for x in [[0.3, 0.2, -0.5], [0.9, 0.1, 0.2], [1.2, -0.4, 0.1]] {
            let terms = cloud.points().zip(moments.chunks_exact(3)).map(|(y, m)| flux(m, y, &x, 0.0));
            let exact = terms.sum::<f64>() * dipoles.inverse_sphere;
            assert!((dipoles.winding(&x) - exact).abs() < 0.05 * dipoles.inverse_sphere, "{exact}");
        }
    }

    #[test]
    fn gradients_are_those_of_differences() {
        for cloud in [fibonacci_sphere(300), circle(100)] {
            let all: Vec<usize> = (0..cloud.n_points()).collect();
            let dipoles = Dipoles::of(&cloud, &moments(&cloud, 6.0), &all);
            for point in [0, 17, 60] {
                let x: Vec<f64> = cloud.point(point).iter().map(|c| 1.1 * c + 0.03).collect();
                let (winding, gradient) = dipoles.winding_jet(&x);
                assert_eq!(winding, dipoles.winding(&x));
                for axis in 0..x.len() {
                    let at = |by: f64| {
                        let mut moved = x.clone();
                        moved[axis] += by;
                        dipoles.winding(&moved)
                    };
                    let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                    // Differences of this step are off by 1e-10 of third derivatives, some 100 here.
                    assert!((gradient[axis] - difference).abs() < 1e-6, "{} {difference}", gradient[axis]);
                }
            }
        }
    }

    #[test]
    fn balls_have_their_volumes() {
        use std::f64::consts::PI;
        for (k, expected) in [(1, 2.0), (2, PI), (3, 4.0 * PI / 3.0), (4, PI * PI / 2.0)] {
            assert!((ball_volume(k) - expected).abs() < 1e-14);
        }
    }
}
