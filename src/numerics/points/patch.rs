//! The nearest points in a frame of their own, and the quadric through them.
//!
//! A second opinion on normals and curvatures that knows neither kernel nor length scale: it sees the positions of a few
//! neighbours and nothing else.

use super::cloud::Cloud;
use super::neighbours::{Neighbour, Neighbours};
use crate::numerics::machine::eigen::symmetric_eigen;
use crate::numerics::machine::heap::vec_bytes;
use crate::numerics::machine::vector::{dot, norm};

/// Neighbours per coefficient of a quadric: 18 for surfaces in space.
const NEIGHBOURS_PER_COEFFICIENT: usize = 3;

/// Diagonal entries of R below this fraction of the largest mean that the neighbours do not determine a quadric.
const RANK_TOLERANCE: f64 = 1e-6;

/// Breadth against length under which points lie on a line.
const THREAD: f64 = 1e-3;

/// Coefficients of a quadric over d − 1 tangential coordinates: `d(d+1)/2`.
pub(crate) fn n_coefficients(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Neighbours that a quadric is fitted to by default.
pub(crate) fn n_quadric_neighbours(dimension: usize) -> usize {
    NEIGHBOURS_PER_COEFFICIENT * n_coefficients(dimension)
}

/// Points near a position x in an orthonormal frame at x, scaled by their greatest distance from x.
pub(crate) struct Patch {
    /// Rows: d − 1 tangents, then the normal, `[d, d]`.
    frame: Vec<f64>,
    /// Least standard deviation along a tangent against the greatest.
    breadth: f64,
    /// Coordinates over `radius`, the last one the height above the tangent plane, `[k, d]`.
    coordinates: Vec<f64>,
    /// Greatest distance of a point from x, unit L.
    pub radius: f64,
    /// Which points of the cloud they are, nearest first.
    pub points: Vec<usize>,
}

impl Patch {
    /// The `count` points nearest to x, in the frame of their principal axes; `None` if all of them are at x.
    pub(crate) fn around(cloud: &Cloud, neighbours: &Neighbours, x: &[f64], count: usize) -> Option<Self> {
        let nearest = neighbours.nearest_positions(cloud, x, count);
        Self::of(cloud, x, nearest.into_iter().map(|found| found.point).collect())
    }

    /// The patch of given points, nearest to x first.
    pub(crate) fn of(cloud: &Cloud, x: &[f64], points: Vec<usize>) -> Option<Self> {
        let d = cloud.dimension();
        let mut differences = Vec::with_capacity(points.len() * d);
        for &point in &points {
            differences.extend(cloud.point(point).iter().zip(x).map(|(p, x)| p - x));
        }
        let radius = differences.chunks_exact(d).map(norm).fold(0.0, f64::max);
        if radius == 0.0 {
            return None;
        }
        differences.iter_mut().for_each(|c| *c /= radius);
        let (frame, breadth) = principal_axes(&differences, d);
        let coordinates = in_frame(&frame, &differences, d);
        Some(Self { frame, breadth, coordinates, radius, points })
    }

    pub(crate) fn dimension(&self) -> usize {
        self.frame.len().isqrt()
    }

    /// The normal of the frame.
    pub(crate) fn normal(&self) -> &[f64] {
        &self.frame[self.frame.len() - self.dimension()..]
    }

    /// Coordinates of the points, scaled to radius 1, `[k, d]`.
    pub(crate) fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// Components of a vector in the frame.
    pub(crate) fn to_frame(&self, v: &[f64]) -> Vec<f64> {
        self.frame.chunks_exact(v.len()).map(|axis| dot(axis, v)).collect()
    }

    /// The vector with these components in the frame.
    pub(crate) fn in_space(&self, components: &[f64]) -> Vec<f64> {
        let mut v = vec![0.0; components.len()];
        for (axis, c) in self.frame.chunks_exact(components.len()).zip(components) {
            v.iter_mut().zip(axis).for_each(|(v, a)| *v += c * a);
        }
        v
    }

    /// Whether the points lie on a thread: they span fewer than d − 1 directions, and no surface.
    pub(crate) fn is_thread(&self) -> bool {
        self.breadth < THREAD
    }

    /// Whether x is at the rim of the patch: no neighbour lies within 75° of the direction opposite to most of them.
    ///
    /// In the plane that is a sector of 150° without points; a uniformly random cloud shows one inside at 0.2 % of its
    /// points, a straight rim at nearly all of them.
    pub(crate) fn is_at_rim(&self) -> bool {
        let k = self.dimension() - 1;
        let tangential = || self.coordinates.chunks_exact(k + 1).map(|t| &t[..k]);
        let mut away = vec![0.0; k];
        for t in tangential() {
            away.iter_mut().zip(t).for_each(|(a, t)| *a -= t);
        }
        let length = norm(&away);
        if length == 0.0 {
            return false;
        }
        const COSINE: f64 = 0.26;
        // Points closer than a hundredth of the patch have no direction to speak of.
        tangential().filter(|t| norm(t) > 0.01).all(|t| dot(t, &away) < COSINE * length * norm(t))
    }

    /// The least-squares quadric of heights over tangential coordinates; `None` if the points do not determine it.
    pub(crate) fn quadric(&self) -> Option<Quadric> {
        let d = self.dimension();
        let (k, p) = (d - 1, n_coefficients(d));
        let n = self.points.len();
        if n < p {
            return None;
        }
        let mut rows = Vec::with_capacity(n * p);
        let mut heights = Vec::with_capacity(n);
        for t in self.coordinates.chunks_exact(d) {
            rows.push(1.0);
            rows.extend_from_slice(&t[..k]);
            for a in 0..k {
                rows.extend((a..k).map(|b| if a == b { 0.5 * t[a] * t[a] } else { t[a] * t[b] }));
            }
            heights.push(t[k]);
        }
        let (coefficients, squared_residual) = least_squares(&mut rows, &mut heights, p)?;
        let mut hessian = vec![0.0; k * k];
        let mut at = d;
        for a in 0..k {
            for b in a..k {
                (hessian[a * k + b], hessian[b * k + a]) = (coefficients[at], coefficients[at]);
                at += 1;
            }
        }
        let freedom = (n - p).max(1) as f64;
        Some(Quadric {
            height: coefficients[0],
            slope: coefficients[1..d].to_vec(),
            hessian,
            residual: (squared_residual / freedom).sqrt(),
        })
    }
}

/// `z = height + slope·t + ½ tᵀ hessian t` in the frame and scale of a patch.
pub(crate) struct Quadric {
    pub height: f64,
    /// `[d−1]`.
    pub slope: Vec<f64>,
    /// `[d−1, d−1]`.
    pub hessian: Vec<f64>,
    /// Root mean square of what it leaves, corrected for the degrees of freedom.
    pub residual: f64,
}

/// A surface near a position, from a quadric over its own tangent plane.
#[derive(Debug, Clone)]
pub(crate) struct LocalFit {
    /// Unit normal of either sign, `[d]`.
    pub normal: Vec<f64>,
    /// Principal curvatures for that normal, ascending, 1/L, `[d−1]`: of the parallel surface through x.
    pub curvatures: Vec<f64>,
    /// The quadric at x against x, along the normal, unit L.
    pub height: f64,
    /// Root mean square distance of the neighbours from the quadric, unit L.
    pub residual: f64,
    /// Standard error of the curvatures if the residual is noise, 1/L.
    pub uncertainty: f64,
    /// Greatest distance of a neighbour, unit L.
    pub radius: f64,
    pub is_at_rim: bool,
}

/// Residual against the radius, and curvature times radius, up to which a local fit is believed: the neighbours lie on one
/// sheet without an edge.
const RELIABLE_RESIDUAL: f64 = 0.05;
const RELIABLE_BEND: f64 = 1.5;

/// Residual against the radius below which there is no noise to speak of.
const SMOOTH_RESIDUAL: f64 = 0.01;

/// Standard error of a second derivative, times √k, from k heights of unit noise over the unit disc: the variance of ½t₁² that
/// 1, t and t₂² leave is 1/72.
const DISC_ERROR: f64 = 8.5;

impl LocalFit {
    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        vec_bytes(&self.normal) + vec_bytes(&self.curvatures)
    }

    /// Whether the neighbours look like a piece of one smooth surface.
    pub(crate) fn is_reliable(&self) -> bool {
        self.residual < RELIABLE_RESIDUAL * self.radius && self.bend() < RELIABLE_BEND
    }

    /// The curvatures for a normal on the same side as `normal`, ascending.
    pub(crate) fn curvatures_for(&self, normal: &[f64]) -> Vec<f64> {
        match dot(&self.normal, normal) < 0.0 {
            true => self.curvatures.iter().rev().map(|k| -k).collect(),
            false => self.curvatures.clone(),
        }
    }

    /// Whether the quadric leaves so little that the points are free of noise.
    pub(crate) fn is_smooth(&self) -> bool {
        self.residual < SMOOTH_RESIDUAL * self.radius && self.bend() < RELIABLE_BEND
    }

    /// The fit around p, with the height above its tangent plane of an x near p.
    pub(crate) fn seen_from(&self, p: &[f64], x: &[f64]) -> Self {
        let along: f64 = x.iter().zip(p).zip(&self.normal).map(|((x, p), n)| (x - p) * n).sum();
        Self { height: self.height - along, ..self.clone() }
    }

    /// Largest curvature times radius: about the angle by which the normal turns among the neighbours.
    pub(crate) fn bend(&self) -> f64 {
        self.radius * self.curvatures.iter().fold(0.0, |a: f64, k| a.max(k.abs()))
    }

    /// Fits the given points, nearest to x first; `None` if they do not determine a quadric.
    ///
    /// The frame of the principal axes is tilted by cubic terms of the surface; a second fit over the tangent plane of the
    /// first is not.
    pub(crate) fn of(cloud: &Cloud, x: &[f64], nearest: &[Neighbour]) -> Option<Self> {
        let mut patch = Patch::of(cloud, x, nearest.iter().map(|found| found.point).collect())?;
        let first = patch.quadric()?;
        patch.tilt(&first.slope);
        let quadric = patch.quadric()?;
        let k = patch.dimension() - 1;
        // For the frame's normal the shape operator is minus the Hessian of the height.
        let shape: Vec<f64> = quadric.hessian.iter().map(|h| -h / patch.radius).collect();
        let (curvatures, _) = symmetric_eigen(&shape, k);
        // Through x, at a distance −height, runs a parallel surface.
        let height = quadric.height * patch.radius;
        let curvatures = curvatures.iter().map(|kappa| kappa / (1.0 - height * kappa).max(0.1)).collect();
        Some(Self {
            normal: patch.normal().to_vec(),
            curvatures,
            height,
            residual: quadric.residual * patch.radius,
            uncertainty: DISC_ERROR * quadric.residual / (patch.radius * (patch.points.len() as f64).sqrt()),
            radius: patch.radius,
            is_at_rim: patch.is_at_rim(),
        })
    }
}

impl Patch {
    /// Rotates the frame so that a plane of this slope becomes its tangent plane.
    pub(crate) fn tilt(&mut self, slope: &[f64]) {
        let d = self.dimension();
        let mut normal: Vec<f64> = slope.iter().map(|s| -s).collect();
        normal.push(1.0);
        let length = norm(&normal);
        normal.iter_mut().for_each(|c| *c /= length);
        let normal = self.in_space(&normal);
        let tangents = crate::numerics::machine::vector::tangent_basis(&normal);
        let frame: Vec<f64> = tangents.into_iter().flatten().chain(normal).collect();
        // The new axes in the old frame turn coordinates in that into the new ones.
        let turn = in_frame(&self.frame, &frame, d);
        self.coordinates = in_frame(&turn, &self.coordinates, d);
        self.frame = frame;
    }
}

/// Components of vectors `[k, d]` along the axes of a frame `[d, d]`.
fn in_frame(frame: &[f64], vectors: &[f64], d: usize) -> Vec<f64> {
    let mut components = Vec::with_capacity(vectors.len());
    for v in vectors.chunks_exact(d) {
        components.extend(frame.chunks_exact(d).map(|axis| dot(axis, v)));
    }
    components
}

/// Orthonormal principal axes of differences `[k, d]` about their mean, the direction of least variance last; and the standard
/// deviation along the last but one against that along the first.
fn principal_axes(differences: &[f64], d: usize) -> (Vec<f64>, f64) {
    let n = (differences.len() / d) as f64;
    let mut mean = vec![0.0; d];
    for v in differences.chunks_exact(d) {
        mean.iter_mut().zip(v).for_each(|(m, c)| *m += c / n);
    }
    let mut covariance = vec![0.0; d * d];
    for v in differences.chunks_exact(d) {
        for a in 0..d {
            for b in 0..d {
                covariance[a * d + b] += (v[a] - mean[a]) * (v[b] - mean[b]);
            }
        }
    }
    let (variances, vectors) = symmetric_eigen(&covariance, d);
    let breadth = (variances[1].max(0.0) / variances[d - 1]).sqrt();
    (vectors.into_iter().rev().flatten().collect(), breadth)
}

/// Minimises `|Ac − b|` by Householder reflections in place (Golub and Van Loan 2013, sec. 5.2.2), A row-major `[n, p]`.
/// Answers c and the squared residual; `None` if A has not full rank.
fn least_squares(a: &mut [f64], b: &mut [f64], p: usize) -> Option<(Vec<f64>, f64)> {
    let n = b.len();
    let mut diagonal = vec![0.0; p];
    for j in 0..p {
        let length = (j..n).map(|i| a[i * p + j] * a[i * p + j]).sum::<f64>().sqrt();
        let alpha = if a[j * p + j] > 0.0 { -length } else { length };
        let pivot = a[j * p + j] - alpha;
        diagonal[j] = alpha;
        // vᵀv/2 = −α·pivot for v = x − αe₁.
        let half_square = -alpha * pivot;
        if half_square == 0.0 {
            return None;
        }
        a[j * p + j] = pivot;
        for column in j + 1..p {
            let along = (j..n).map(|i| a[i * p + j] * a[i * p + column]).sum::<f64>() / half_square;
            (j..n).for_each(|i| a[i * p + column] -= along * a[i * p + j]);
        }
        let along = (j..n).map(|i| a[i * p + j] * b[i]).sum::<f64>() / half_square;
        (j..n).for_each(|i| b[i] -= along * a[i * p + j]);
    }
    let largest = diagonal.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
    if diagonal.iter().any(|r| r.abs() <= RANK_TOLERANCE * largest) {
        return None;
    }
    let mut c = b[..p].to_vec();
    for j in (0..p).rev() {
        let known: f64 = (j + 1..p).map(|column| a[j * p + column] * c[column]).sum();
        c[j] = (c[j] - known) / diagonal[j];
    }
    Some((c, b[p..].iter().map(|r| r * r).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::testing::{circle, fibonacci_sphere};

    fn fit_around(cloud: &Cloud, x: &[f64], count: usize) -> Option<LocalFit> {
        LocalFit::of(cloud, x, &Neighbours::of(cloud).nearest_positions(cloud, x, count))
    }

    #[test]
    fn a_quadric_is_recovered_exactly() {
        let height = |x: f64, y: f64| 0.3 - 0.2 * x + 0.1 * y + 0.7 * x * x - 0.4 * x * y - 0.5 * y * y;
        let grid = (0..25).map(|i| [(i % 5) as f64 * 0.01 - 0.02, (i / 5) as f64 * 0.01 - 0.02]);
        let cloud = Cloud::new(grid.flat_map(|[x, y]| [x, y, height(x, y)]).collect(), 3).unwrap();
        let fit = fit_around(&cloud, cloud.point(12), 25).unwrap();
        // At the origin: unit normal (0.2, −0.1, 1)/|·|, shape operator by the first and second fundamental forms.
        let length = (1.0f64 + 0.04 + 0.01).sqrt();
        let cosine = dot(&fit.normal, &[0.2 / length, -0.1 / length, 1.0 / length]).abs();
        // A graph over another plane is not exactly a quadric: third-order terms of the patch remain.
        assert!(cosine > 1.0 - 1e-6, "{cosine}");
        let gaussian: f64 = fit.curvatures.iter().product();
        let exact = (-1.4 - 0.16) / length.powi(4);
        assert!((gaussian - exact).abs() < 1e-3 * exact.abs(), "{gaussian} against {exact}");
        assert!(!fit.is_at_rim);
        assert!(fit_around(&cloud, cloud.point(0), 18).unwrap().is_at_rim);
    }

    #[test]
    fn spheres_and_circles_have_curvature_one() {
        for (cloud, count) in [(circle(64), 9), (fibonacci_sphere(800), 18)] {
            let neighbours = Neighbours::of(&cloud);
            for x in cloud.points() {
                let fit = LocalFit::of(&cloud, x, &neighbours.nearest_positions(&cloud, x, count)).unwrap();
                assert!(dot(&fit.normal, x).abs() > 0.999);
                assert!(fit.curvatures.iter().all(|k| (k.abs() - 1.0).abs() < 0.05), "{:?}", fit.curvatures);
                assert!(!fit.is_at_rim);
            }
        }
    }

    #[test]
    fn points_on_a_line_determine_no_surface() {
        let cloud = Cloud::new((0..30).flat_map(|i| [i as f64, 0.0, 0.0]).collect(), 3).unwrap();
        assert!(fit_around(&cloud, cloud.point(15), 18).is_none());
    }
}
