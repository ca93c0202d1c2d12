//! The area of the surface that each point stands for.

mod cell;

use rayon::prelude::*;

use super::dipoles::ball_volume;
use crate::machine::vector::{dot, tangent_basis};
use crate::orientation::edges::{Edge, across, edges_of};
use crate::orientation::{CloudWithNeighbours, n_neighbours};
use crate::points::cloud::squared_distance;
use cell::Cell;

/// Reach of the sum over the distance to the last of the neighbours. It exceeds 1 so that the last ones
/// count.
const REACH: f64 = 1.2;

/// Weight of a point in its own sum. On a lattice 1 is right, at random points 0. With ½ both are right to a
/// tenth.
const OWN: f64 = 0.5;

/// Least share of its neighbours that counts as on the sheet of a point. Rough normals lose edges on their
/// own sheet, and between two sheets half of the neighbours are on the other one.
const LEAST_SHARE: f64 = 0.5;

/// Largest offset of two neighbours across the surface, over their distance, for them to be on one sheet. On
/// a sheet, normals that are off by 25° each make it 0.8. With a bound of ½ areas would then be a third too
/// large. With a bound of 1 the areas of two sheets a spacing apart are too small.
const ON_SHEET: f64 = 0.8;

/// Reach of a cell over the distance to the last of the neighbours.
const REACH_OF_CELL: f64 = 0.75;

/// Computes areas in units of radius^{d−1}, `[n]`, from the neighbours of each point on its sheet.
///
/// `normals` are `[n, d]`.
pub(super) fn areas(
    sampled: &CloudWithNeighbours<'_>,
    normals: &[f64],
    edges: &[Edge],
    radius: f64,
) -> Vec<f64> {
    let area = |point: usize| {
        let place = Place { sampled, normals, point, own: edges_of(edges, point) };
        match sampled.cloud.dimension() {
            2 => place.length() / radius,
            3 => place.cell(radius),
            _ => place.area(radius),
        }
    };
    (0..sampled.cloud.n_points()).into_par_iter().map(area).collect()
}

/// A point with its edges.
struct Place<'a> {
    sampled: &'a CloudWithNeighbours<'a>,
    normals: &'a [f64],
    point: usize,
    own: &'a [Edge],
}

impl Place<'_> {
    /// Computes the area of the cell of the point among its neighbours on the sheet.
    ///
    /// In the tangent plane the neighbours are as far from the point as in space.
    fn cell(&self, radius: f64) -> f64 {
        let (cloud, d) = (self.sampled.cloud, self.sampled.cloud.dimension());
        let around = self.sampled.around.around(self.point);
        let around = &around[..around.len().min(n_neighbours(cloud) + 1)];
        let x = cloud.point(self.point);
        let squared = |point: u32| squared_distance(x, cloud.point(point as usize));
        let reach = around.last().map_or(0.0, |last| squared(*last).sqrt());
        if reach == 0.0 {
            return 0.0;
        }
        let mut cell = Cell::within(REACH_OF_CELL);
        let basis = tangent_basis(&self.normals[self.point * d..][..d]);
        for &found in around.iter().filter(|found| squared(**found) > 0.0) {
            if across(cloud, self.normals, self.point, found as usize) > ON_SHEET {
                continue;
            }
            let y = cloud.point(found as usize);
            let along =
                |row: &[f64]| -> f64 { row.iter().zip(x).zip(y).map(|((t, x), y)| t * (y - x)).sum() };
            let [u, v] = [along(&basis[..d]), along(&basis[d..])];
            let length = u.hypot(v);
            // A neighbour straight above, of a point without a normal, has no direction in the plane.
            if length > 0.0 {
                let stretch = squared(found).sqrt() / length / reach;
                cell.cut([u * stretch, v * stretch]);
            }
        }
        cell.area() * (reach / radius).powi(2)
    }

    /// Computes `V_{d−1} R^{d−1} 2/(d+1) / Σ (1 − |y − x|²/R²)`: the integral of the summand over its sum.
    fn area(&self, radius: f64) -> f64 {
        let (cloud, k) = (self.sampled.cloud, self.sampled.cloud.dimension() - 1);
        let x = cloud.point(self.point);
        let around = self.sampled.around.around(self.point).iter().take(n_neighbours(cloud) + 1);
        let around = around.map(|&point| squared_distance(x, cloud.point(point as usize)));
        let squared_reach = REACH * REACH * around.clone().next_back().unwrap_or(0.0);
        if squared_reach == 0.0 {
            return 0.0;
        }
        // An edge across a gap may be longer than the reach.
        let term = |squared: f64| (1.0 - squared / squared_reach).max(0.0);
        let on_sheet: f64 =
            self.own.iter().map(|edge| term(squared_distance(x, cloud.point(edge.b())))).sum();
        let all: f64 = around.filter(|squared| *squared > 0.0).map(term).sum();
        let sum = OWN + on_sheet.max(LEAST_SHARE * all);
        ball_volume(k) * 2.0 / (k + 2) as f64 * (squared_reach.sqrt() / radius).powi(k as i32) / sum
    }

    /// Computes half the way to the next points of the curve on both sides. At an end the half on one side
    /// counts twice.
    fn length(&self) -> f64 {
        let x = self.sampled.cloud.point(self.point);
        let step = |edge: &Edge| -> [f64; 2] {
            let y = self.sampled.cloud.point(edge.b());
            [y[0] - x[0], y[1] - x[1]]
        };
        let Some(ahead) = self.own.first().map(step) else {
            return self.sampled.sampling.spacing(self.point);
        };
        let first = dot(&ahead, &ahead).sqrt();
        // Edges come nearest first.
        let behind = self.own.iter().map(step).find(|step| dot(step, &ahead) < 0.0);
        0.5 * (first + behind.map_or(first, |step| dot(&step, &step).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::observer::Unobserved;
    use crate::orientation::edges::sheet_edges;
    use crate::points::cloud::Cloud;
    use crate::points::neighbourhoods::Neighbourhoods;
    use crate::points::sampling::Sampling;
    use crate::testing::{Random, fibonacci_sphere};

    /// Returns areas on the unit sphere, and on a sphere around it at this distance.
    fn areas_of_shells(distance: f64, roughness: f64) -> Vec<f64> {
        let (inner, mut random) = (fibonacci_sphere(1000), Random(3));
        let outer = inner.coordinates().iter().map(|c| c * (1.0 + distance));
        let cloud = Cloud::new(inner.coordinates().iter().copied().chain(outer).collect(), 3).unwrap();
        let rough = inner.points().chain(inner.points()).flat_map(|x| {
            let moved: Vec<f64> = x.iter().map(|c| c + roughness * random.normal()).collect();
            let length = dot(&moved, &moved).sqrt();
            moved.into_iter().map(move |c| c / length)
        });
        let normals: Vec<f64> = rough.collect();
        let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
        let around = Neighbourhoods::of(sampling.neighbours(), &cloud, 18, &Unobserved).unwrap();
        let sampled = CloudWithNeighbours {
            cloud: &cloud,
            sampling: &sampling,
            around: &around,
            observer: &Unobserved,
        };
        areas(&sampled, &normals, &sheet_edges(&sampled, &normals).unwrap(), 1.0)
    }

    #[test]
    fn areas_are_those_of_the_sphere_with_another_one_near_and_rough_normals() {
        // Points are 0.11 apart. A roughness of 0.2 is 11° in each direction.
        for (distance, roughness, tolerance) in [(1.0, 0.0, 0.02), (0.15, 0.0, 0.02), (0.15, 0.2, 0.1)] {
            let sum: f64 = areas_of_shells(distance, roughness)[..1000].iter().sum();
            assert!((sum / (4.0 * PI) - 1.0).abs() < tolerance, "{distance} {roughness}: {sum}");
        }
    }
}
