//! The nearest points in a frame of their own.

use smallvec::SmallVec;

use super::cloud::Cloud;
use crate::numerics::machine::eigen::symmetric_eigen;
use crate::numerics::machine::small::{Small, zeros};
use crate::numerics::machine::vector::{dot, norm, tangent_basis};

/// Breadth against length under which points lie on a line.
const THREAD: f64 = 1e-3;

/// Numbers of a patch, on the stack for as many points as the quadric of a surface in space is fitted to.
pub(super) type PatchNumbers = SmallVec<[f64; 128]>;

/// Points near a position x in an orthonormal frame at x, scaled by their greatest distance from x.
pub(crate) struct Patch {
    /// Rows: d − 1 tangents, then the normal, `[d, d]`.
    frame: Small,
    /// Least standard deviation along a tangent against the greatest.
    breadth: f64,
    /// Coordinates over `radius`, the last one the height above the tangent plane, `[k, d]`.
    coordinates: PatchNumbers,
    dimension: usize,
    /// Greatest distance of a point from x, unit L.
    pub radius: f64,
}

impl Patch {
    /// The patch of given points, in the frame of their principal axes; `None` if all of them are at x.
    pub(crate) fn of(cloud: &Cloud, x: &[f64], points: impl IntoIterator<Item = usize>) -> Option<Self> {
        let d = cloud.dimension();
        let mut differences = PatchNumbers::new();
        for point in points {
            differences.extend(cloud.point(point).iter().zip(x).map(|(p, x)| p - x));
        }
        let radius = differences.chunks_exact(d).map(norm).fold(0.0, f64::max);
        if radius == 0.0 {
            return None;
        }
        differences.iter_mut().for_each(|c| *c /= radius);
        let (frame, breadth) = principal_axes(&differences, d);
        let coordinates = in_frame(&frame, &differences, d);
        Some(Self { frame, breadth, coordinates, dimension: d, radius })
    }

    /// The same points over a plane of this slope `[d−1]`: the frame is rotated so that it becomes the tangent plane.
    pub(crate) fn over(self, slope: &[f64]) -> Self {
        let d = self.dimension;
        let mut normal: Small = slope.iter().map(|s| -s).collect();
        normal.push(1.0);
        let length = norm(&normal);
        normal.iter_mut().for_each(|c| *c /= length);
        let normal = self.in_space(&normal);
        let mut frame = tangent_basis(&normal);
        frame.extend_from_slice(&normal);
        // The new axes in the old frame turn coordinates in that into the new ones.
        let turn = in_frame(&self.frame, &frame, d);
        let coordinates = in_frame(&turn, &self.coordinates, d);
        Self { frame, coordinates, ..self }
    }

    pub(crate) fn dimension(&self) -> usize {
        self.dimension
    }

    pub(crate) fn n_points(&self) -> usize {
        self.coordinates.len() / self.dimension
    }

    /// The normal of the frame.
    pub(crate) fn normal(&self) -> &[f64] {
        &self.frame[self.frame.len() - self.dimension..]
    }

    /// Coordinates of the points, scaled to radius 1, `[k, d]`.
    pub(crate) fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// Components of a vector in the frame.
    pub(crate) fn to_frame(&self, v: &[f64]) -> Small {
        self.frame.chunks_exact(v.len()).map(|axis| dot(axis, v)).collect()
    }

    /// The vector with these components in the frame.
    pub(crate) fn in_space(&self, components: &[f64]) -> Small {
        let mut v = zeros(components.len());
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
        let k = self.dimension - 1;
        let tangential = || self.coordinates.chunks_exact(k + 1).map(|t| &t[..k]);
        let mut away = zeros(k);
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
}

/// Components of vectors `[k, d]` along the axes of a frame `[d, d]`.
fn in_frame(frame: &[f64], vectors: &[f64], d: usize) -> PatchNumbers {
    let mut components = PatchNumbers::with_capacity(vectors.len());
    for v in vectors.chunks_exact(d) {
        components.extend(frame.chunks_exact(d).map(|axis| dot(axis, v)));
    }
    components
}

/// Orthonormal principal axes of differences `[k, d]` about their mean, the direction of least variance last; and the standard
/// deviation along the last but one against that along the first.
fn principal_axes(differences: &[f64], d: usize) -> (Small, f64) {
    let n = (differences.len() / d) as f64;
    let mut mean = zeros(d);
    for v in differences.chunks_exact(d) {
        mean.iter_mut().zip(v).for_each(|(m, c)| *m += c / n);
    }
    let mut covariance = zeros(d * d);
    for v in differences.chunks_exact(d) {
        for a in 0..d {
            for b in a..d {
                covariance[a * d + b] += (v[a] - mean[a]) * (v[b] - mean[b]);
            }
        }
    }
    let (variances, vectors) = symmetric_eigen(&covariance, d);
    let breadth = (variances[1].max(0.0) / variances[d - 1]).sqrt();
    (vectors.chunks_exact(d).rev().flatten().copied().collect(), breadth)
}
