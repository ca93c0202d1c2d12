//! The nearest points of a position in a local frame.

use smallvec::SmallVec;

use super::cloud::Cloud;
use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};
use crate::machine::vector::{dot, norm, tangent_basis};

/// Ratio of breadth to length below which points lie on a line.
const THREAD: f64 = 1e-3;

/// Coordinates of a patch. They fit on the stack for as many points as a quadric of a surface in space is
/// fitted to.
type Coordinates = SmallVec<[f64; 64]>;

/// Points near a position x in an orthonormal frame at x, scaled by their greatest distance from x.
pub(crate) struct Patch {
    /// Axes of the frame as rows: d − 1 tangents, then the normal, `[d, d]`.
    frame: Small,
    /// Least standard deviation of the points along a tangent, relative to the greatest.
    breadth: f64,
    /// Coordinates of the points divided by `radius`, `[k, d]`. The last one is the height above the tangent
    /// plane.
    coordinates: Coordinates,
    dimension: usize,
    /// Greatest distance of a point from x, unit L.
    pub radius: f64,
}

impl Patch {
    /// Makes the patch of the given points in the frame of their principal axes. Returns `None` if all of
    /// them lie at x.
    pub(crate) fn of(cloud: &Cloud, x: &[f64], points: impl IntoIterator<Item = usize>) -> Option<Self> {
        match cloud.dimension() {
            2 => Self::gather::<2>(cloud, x, points),
            3 => Self::gather::<3>(cloud, x, points),
            _ => Self::gather::<0>(cloud, x, points),
        }
    }

    /// Makes the patch. D is the dimension if it is known at compile time, else 0. Knowing it spares a call
    /// for each copy of three numbers.
    fn gather<const D: usize>(
        cloud: &Cloud,
        x: &[f64],
        points: impl IntoIterator<Item = usize>,
    ) -> Option<Self> {
        let d = if D == 0 { cloud.dimension() } else { D };
        let mut coordinates = Coordinates::new();
        for point in points {
            let p = &cloud.point(point)[..d];
            (0..d).for_each(|c| coordinates.push(p[c] - x[c]));
        }
        let radius = coordinates.chunks_exact(d).map(norm).fold(0.0, f64::max);
        if radius == 0.0 {
            return None;
        }
        coordinates.iter_mut().for_each(|c| *c /= radius);
        let (frame, breadth) = principal_axes::<D>(&coordinates, d);
        turn_into::<D>(&frame, &mut coordinates, d);
        Some(Self { frame, breadth, coordinates, dimension: d, radius })
    }

    /// Rotates the frame so that a plane of this slope `[d−1]` becomes the tangent plane.
    pub(crate) fn turn_over(&mut self, slope: &[f64]) {
        match self.dimension {
            2 => self.turn::<2>(slope),
            3 => self.turn::<3>(slope),
            _ => self.turn::<0>(slope),
        }
    }

    fn turn<const D: usize>(&mut self, slope: &[f64]) {
        let d = self.dimension;
        let mut normal: Small = slope.iter().map(|s| -s).collect();
        normal.push(1.0);
        let length = norm(&normal);
        normal.iter_mut().for_each(|c| *c /= length);
        let normal = self.in_space(&normal);
        let mut frame = tangent_basis(&normal);
        frame.extend_from_slice(&normal);
        // The new axes, expressed in the old frame, map old coordinates to new ones.
        let mut turn = frame.clone();
        turn_into::<D>(&self.frame, &mut turn, d);
        turn_into::<D>(&turn, &mut self.coordinates, d);
        self.frame = frame;
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

    /// Returns the components of a vector in the frame.
    pub(crate) fn to_frame(&self, v: &[f64]) -> Small {
        self.frame.chunks_exact(v.len()).map(|axis| dot(axis, v)).collect()
    }

    /// Returns the vector with these components in the frame.
    pub(crate) fn in_space(&self, components: &[f64]) -> Small {
        let mut v = zeros(components.len());
        for (axis, c) in self.frame.chunks_exact(components.len()).zip(components) {
            v.iter_mut().zip(axis).for_each(|(v, a)| *v += c * a);
        }
        v
    }

    /// Returns whether the points lie on a thread: they span fewer than d − 1 directions and so no surface.
    pub(crate) fn is_thread(&self) -> bool {
        self.breadth < THREAD
    }

    /// Returns whether x is at the rim of the patch.
    pub(crate) fn is_at_rim(&self) -> bool {
        let k = self.dimension - 1;
        is_at_rim(self.coordinates.chunks_exact(k + 1).map(|t| &t[..k]), k)
    }
}

/// Cosine of 75°, the half angle of an empty sector at a rim.
const RIM_COSINE: f64 = 0.26;

/// Distance in units of the radius up to which points have no reliable direction.
const RIM_LEAST: f64 = 0.01;

/// Returns whether a position is at the rim of its neighbours: none of them lies within 75° of the direction
/// opposite to most of them.
///
/// `tangential` are the coordinates of the neighbours over the tangent plane, `[k]` each, in units of their
/// radius. In the plane a rim is an empty sector of 150°. Inside a uniformly random cloud it occurs at 0.2 %
/// of the points, at a straight rim at nearly all of them.
#[inline]
pub(crate) fn is_at_rim<'a>(mut tangential: impl Iterator<Item = &'a [f64]> + Clone, k: usize) -> bool {
    let mut away = zeros(k);
    for t in tangential.clone() {
        away.iter_mut().zip(t).for_each(|(a, t)| *a -= t);
    }
    let length = norm(&away);
    let is_elsewhere = |t: &[f64]| {
        let distance = norm(t);
        distance <= RIM_LEAST || dot(t, &away) < RIM_COSINE * length * distance
    };
    length > 0.0 && tangential.all(is_elsewhere)
}

/// Replaces vectors `[k, d]` by their components along the axes of a frame `[d, d]`.
fn turn_into<const D: usize>(frame: &[f64], vectors: &mut [f64], d: usize) {
    let d = if D == 0 { d } else { D };
    let (mut components, frame) = (zeros(d), &frame[..d * d]);
    for v in vectors.chunks_exact_mut(d) {
        let components = &mut components[..d];
        (0..d).for_each(|axis| components[axis] = (0..d).map(|c| frame[axis * d + c] * v[c]).sum());
        (0..d).for_each(|axis| v[axis] = components[axis]);
    }
}

/// Computes the orthonormal principal axes of differences `[k, d]` about their mean, the direction of least
/// variance last. Also returns the standard deviation along the last axis but one, relative to that along the
/// first.
fn principal_axes<const D: usize>(differences: &[f64], d: usize) -> (Small, f64) {
    let d = if D == 0 { d } else { D };
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
