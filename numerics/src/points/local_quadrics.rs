//! Quadrics fitted to the neighbours of many positions: normal, curvatures, height and residual at each.

use rayon::prelude::*;

use super::cloud::Cloud;
use super::neighbourhoods::Neighbourhoods;
use super::patch::Patch;
use super::quadric::Quadric;
use crate::error::{NumericsError, Result};
use crate::machine::eigen::symmetric_eigen;
use crate::machine::heap::vec_bytes;
use crate::machine::small::Small;
use crate::machine::vector::dot;
use crate::observer::Observer;

/// Largest residual, relative to the radius, of a reliable fit: the neighbours then lie on one sheet without
/// an edge.
const RELIABLE_RESIDUAL: f64 = 0.05;
/// Largest product of curvature and radius of a reliable fit.
const RELIABLE_BEND: f64 = 1.5;

/// Residual, relative to the radius, below which the noise is negligible.
const SMOOTH_RESIDUAL: f64 = 0.01;

/// A local model of the surface near a position x: a quadric over its own tangent plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalQuadric<'a> {
    /// Unit normal of either sign, `[d]`.
    pub normal: &'a [f64],
    /// Principal curvatures for that normal, ascending, 1/L, `[d−1]`. They belong to the parallel surface
    /// through x.
    pub curvatures: &'a [f64],
    /// Height of the quadric above x along the normal, unit L.
    pub height: f64,
    /// Root mean square distance of the neighbours from the quadric, unit L.
    pub residual: f64,
    /// Standard error of the curvatures if the residual is noise, 1/L.
    pub uncertainty: f64,
    /// Greatest distance of a neighbour, unit L.
    pub radius: f64,
    pub is_at_rim: bool,
}

impl LocalQuadric<'_> {
    /// Returns whether the neighbours look like a piece of one smooth surface.
    pub(crate) fn is_reliable(&self) -> bool {
        self.residual < RELIABLE_RESIDUAL * self.radius && self.bend() < RELIABLE_BEND
    }

    /// Returns whether the residual is so small that the points count as free of noise.
    pub(crate) fn is_smooth(&self) -> bool {
        self.residual < SMOOTH_RESIDUAL * self.radius && self.bend() < RELIABLE_BEND
    }

    /// Returns the curvatures for a normal on the same side as `normal`, ascending, `[d−1]`.
    pub(crate) fn curvatures_for(&self, normal: &[f64]) -> Small {
        if dot(self.normal, normal) < 0.0 {
            self.curvatures.iter().rev().map(|k| -k).collect()
        } else {
            Small::from_slice(self.curvatures)
        }
    }

    /// Returns this quadric, fitted at p, with `height` measured from x near p to its tangent plane.
    pub(crate) fn seen_from(self, p: &[f64], x: &[f64]) -> Self {
        let along: f64 = x.iter().zip(p).zip(self.normal).map(|((x, p), n)| (x - p) * n).sum();
        Self { height: self.height - along, ..self }
    }

    /// Largest curvature times radius: about the angle by which the normal turns among the neighbours.
    pub(crate) fn bend(&self) -> f64 {
        self.radius * self.curvatures.iter().fold(0.0, |a: f64, k| a.max(k.abs()))
    }
}

/// Outcome of the fit at one position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FitOutcome {
    /// The neighbours do not determine a quadric.
    Nothing,
    Inside,
    AtRim,
}

/// Quadrics at m positions, in flat arrays.
pub(crate) struct LocalQuadrics {
    dimension: usize,
    /// Normal, curvatures, height, residual, uncertainty and radius, `[m, 2d + 3]`.
    rows: Vec<f64>,
    found: Vec<FitOutcome>,
}

impl LocalQuadrics {
    /// Fits a quadric to the nearest points of a cloud around each query, d ≥ 2. The neighbourhoods hold
    /// [`super::quadric::n_quadric_neighbours`] points each.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(crate) fn of(
        cloud: &Cloud,
        neighbourhoods: &Neighbourhoods,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (m, d) = (queries.n_points(), cloud.dimension());
        let width = width(d);
        let (mut rows, mut found) = (vec![0.0; m * width], vec![FitOutcome::Nothing; m]);
        let slots = rows.par_chunks_exact_mut(width).zip(&mut found);
        slots.enumerate().try_for_each(|(query, (row, found))| {
            observer.checkpoint()?;
            let nearest = neighbourhoods.around(query);
            *found = fit(cloud, queries.point(query), nearest, row).unwrap_or(FitOutcome::Nothing);
            Ok::<_, NumericsError>(())
        })?;
        Ok(Self { dimension: d, rows, found })
    }

    /// Returns the quadric at a position, or `None` if its neighbours do not determine one.
    pub(crate) fn at(&self, position: usize) -> Option<LocalQuadric<'_>> {
        let (d, width) = (self.dimension, width(self.dimension));
        if self.found[position] == FitOutcome::Nothing {
            return None;
        }
        let (normal, rest) = self.rows[position * width..][..width].split_at(d);
        let (curvatures, rest) = rest.split_at(d - 1);
        let &[height, residual, uncertainty, radius] = rest else { return None };
        let is_at_rim = self.found[position] == FitOutcome::AtRim;
        Some(LocalQuadric { normal, curvatures, height, residual, uncertainty, radius, is_at_rim })
    }

    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        vec_bytes(&self.rows) + vec_bytes(&self.found)
    }
}

fn width(dimension: usize) -> usize {
    2 * dimension + 3
}

/// Fits a quadric to the given points, nearest to x first, and writes it into `row`. Returns `None` if the
/// points do not determine a quadric.
///
/// Cubic terms of the surface tilt the frame of the principal axes. So a second quadric is fitted over the
/// tangent plane of the first, which they do not tilt.
fn fit(cloud: &Cloud, x: &[f64], nearest: &[u32], row: &mut [f64]) -> Option<FitOutcome> {
    let mut patch = Patch::of(cloud, x, nearest.iter().map(|&point| point as usize))?;
    let first = Quadric::of(&patch)?;
    patch.turn_over(&first.slope);
    let quadric = Quadric::of(&patch)?;
    let d = patch.dimension();
    // For the normal of the frame, the shape operator is minus the Hessian of the height.
    let shape: Small = quadric.hessian.iter().map(|h| -h / patch.radius).collect();
    let (curvatures, directions) = symmetric_eigen(&shape, d - 1);
    let height = quadric.height * patch.radius;
    row[..d].copy_from_slice(patch.normal());
    // The curvatures are those of the parallel surface through x, at the distance −height.
    let parallel = curvatures.iter().map(|kappa| kappa / (1.0 - height * kappa).max(0.1));
    row[d..2 * d - 1].iter_mut().zip(parallel).for_each(|(slot, kappa)| *slot = kappa);
    let errors = directions.chunks_exact(d - 1).map(|direction| quadric.standard_error(direction));
    let uncertainty = errors.fold(0.0, f64::max) / patch.radius;
    row[2 * d - 1..].copy_from_slice(&[height, quadric.residual * patch.radius, uncertainty, patch.radius]);
    Some(if patch.is_at_rim() { FitOutcome::AtRim } else { FitOutcome::Inside })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::points::neighbours::{Neighbour, Neighbours};
    use crate::points::quadric::n_quadric_neighbours;
    use crate::testing::{circle, fibonacci_sphere};

    /// Fits one quadric to the `count` nearest positions around x.
    fn around(cloud: &Cloud, x: &[f64], count: usize) -> LocalQuadrics {
        let d = cloud.dimension();
        let mut rows = vec![0.0; width(d)];
        let nearest = Neighbours::of(cloud, &Unobserved).unwrap().nearest_positions(x, count);
        let nearest: Vec<u32> = nearest.iter().map(|found| found.point as u32).collect();
        let found = fit(cloud, x, &nearest, &mut rows).unwrap_or(FitOutcome::Nothing);
        LocalQuadrics { dimension: d, rows, found: vec![found] }
    }

    #[test]
    fn a_quadric_is_recovered_exactly() {
        let height = |x: f64, y: f64| 0.3 - 0.2 * x + 0.1 * y + 0.7 * x * x - 0.4 * x * y - 0.5 * y * y;
        let grid = (0..25).map(|i| [(i % 5) as f64 * 0.01 - 0.02, (i / 5) as f64 * 0.01 - 0.02]);
        let cloud = Cloud::new(grid.flat_map(|[x, y]| [x, y, height(x, y)]).collect(), 3).unwrap();
        let quadrics = around(&cloud, cloud.point(12), 25);
        let fit = quadrics.at(0).unwrap();
        // Exact values at the origin: unit normal (0.2, −0.1, 1)/|·|, and the shape operator by the first and
        // second fundamental forms.
        let length = (1.0f64 + 0.04 + 0.01).sqrt();
        let cosine = dot(fit.normal, &[0.2 / length, -0.1 / length, 1.0 / length]).abs();
        // A graph over another plane is not exactly a quadric: third-order terms of the patch remain.
        assert!(cosine > 1.0 - 1e-6, "{cosine}");
        let gaussian: f64 = fit.curvatures.iter().product();
        let exact = (-1.4 - 0.16) / length.powi(4);
        assert!((gaussian - exact).abs() < 1e-3 * exact.abs(), "{gaussian} against {exact}");
        assert!(!fit.is_at_rim);
        assert!(around(&cloud, cloud.point(0), 18).at(0).unwrap().is_at_rim);
    }

    #[test]
    fn spheres_and_circles_have_curvature_one() {
        for cloud in [circle(64), fibonacci_sphere(800)] {
            let (tree, count) =
                (Neighbours::of(&cloud, &Unobserved).unwrap(), n_quadric_neighbours(cloud.dimension()));
            let around = Neighbourhoods::of(&tree, &cloud, count, &Unobserved).unwrap();
            let quadrics = LocalQuadrics::of(&cloud, &around, &cloud, &Unobserved).unwrap();
            for (point, x) in cloud.points().enumerate() {
                assert_eq!(around.nearest(point), Neighbour { point, squared_distance: 0.0 });
                let fit = quadrics.at(point).unwrap();
                assert!(dot(fit.normal, x).abs() > 0.999);
                assert!(fit.curvatures.iter().all(|k| (k.abs() - 1.0).abs() < 0.05), "{:?}", fit.curvatures);
                assert!(!fit.is_at_rim);
            }
        }
    }

    #[test]
    fn points_on_a_line_determine_no_surface() {
        let cloud = Cloud::new((0..30).flat_map(|i| [i as f64, 0.0, 0.0]).collect(), 3).unwrap();
        assert!(around(&cloud, cloud.point(15), 18).at(0).is_none());
    }
}
