//! Connected pieces of a surface, and the sign of each by itself.

use super::{CloudWithNeighbours, Directions};
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;

/// Factor by which consistent signs may shrink the volume.
const LOST_VOLUME: f64 = 1.05;

/// Share of the gradients that must agree for their sign to be believed without the volume.
const UNANIMITY: f64 = 0.95;

/// Volume of a piece, over that of a ball of as much surface as far from its centre, above which the volume
/// decides. It is then known better than any gradient: those of a wide kernel on an octahedron agree, and
/// point inward. A torus with a tube of a seventh of its radius has twice as much.
const BULKY: f64 = 0.1;

/// Sums over a piece that decide its side.
pub(super) struct Evidence {
    /// Area where gradients have a sign.
    pub total: f64,
    /// Vote of the gradients by area, for the signs of the piece as they are.
    pub vote: f64,
    /// d times the volume inside, negative if the normals point inward.
    pub volume: f64,
    /// d times the volume of a ball of as much surface.
    pub ball: f64,
    /// True if the piece lies inside another one.
    pub is_nested: bool,
}

impl Evidence {
    pub(super) fn is_bulky(&self) -> bool {
        !self.is_nested && self.volume.abs() > BULKY * self.ball
    }

    pub(super) fn is_unanimous(&self) -> bool {
        self.vote.abs() >= (2.0 * UNANIMITY - 1.0) * self.total
    }

    /// Returns the sign of the piece.
    pub(super) fn sign(&self, has_rim: bool) -> f64 {
        let decides_itself = has_rim || self.is_unanimous() && !self.is_bulky();
        let by_vote = self.total > 0.0 && decides_itself || self.volume == 0.0;
        if (if by_vote { self.vote } else { self.volume }) < 0.0 { -1.0 } else { 1.0 }
    }
}

/// Returns whether separate surfaces that nearly touch were taken for one. Then gradients by themselves
/// enclose more than signs that go together: `volumes` are these two. Curves cross their own inside too often
/// for this to tell.
pub(super) fn are_several(volumes: [f64; 2], dimension: usize) -> bool {
    let [by_gradients, together] = volumes;
    dimension > 2 && by_gradients > LOST_VOLUME * together
}

/// A connected part of the surface with signs relative to one another.
pub(super) struct Piece<'a> {
    pub sampled: &'a CloudWithNeighbours<'a>,
    pub directions: &'a Directions,
    pub points: &'a [usize],
    pub relative: &'a [f64],
}

impl Piece<'_> {
    /// Returns whether the piece has two ends of a curve, or a row of rim points of a surface.
    pub(super) fn has_rim(&self, is_at_rim: &[bool]) -> bool {
        let n_rim = self.points.iter().filter(|&&point| is_at_rim[point]).count();
        match self.sampled.cloud.dimension() {
            2 => n_rim >= 2,
            _ => n_rim >= 4 && 50 * n_rim >= self.points.len(),
        }
    }

    /// Returns the sign of the piece.
    ///
    /// Gradients vote by area. Their vote decides on a piece with a rim, and where they agree and the volume
    /// is small or inside another piece. Otherwise the sign of the volume decides.
    pub(super) fn sign(&self, has_rim: bool, is_nested: bool) -> f64 {
        let signed = || self.points.iter().filter(|&&point| self.directions.has_sign[point]);
        let evidence = Evidence {
            total: signed().map(|&point| self.area(point)).sum(),
            vote: signed().map(|&point| self.relative[point] * self.area(point)).sum(),
            volume: self.volume(|point| self.relative[point]),
            ball: self.volume_of_ball(),
            is_nested,
        };
        evidence.sign(has_rim)
    }

    /// Returns whether consistent signs enclose less than the gradients do by themselves.
    ///
    /// See [`are_several`].
    pub(super) fn loses_volume(&self) -> bool {
        let signed = |sign: f64, point: usize| if self.directions.has_sign[point] { sign } else { 0.0 };
        let by_gradients = self.volume(|point| signed(1.0, point)).abs();
        let repaired = self.volume(|point| signed(self.relative[point], point)).abs();
        are_several([by_gradients, repaired], self.sampled.cloud.dimension())
    }

    /// Computes `Σ a (x − c)·ν`, d times the volume inside by the divergence theorem.
    fn volume(&self, sign: impl Fn(usize) -> f64) -> f64 {
        let d = self.sampled.cloud.dimension();
        let centre = self.centre();
        let of_point = |&point: &usize| {
            let normal = &self.directions.normals[point * d..][..d];
            let arm = self.sampled.cloud.point(point).iter().zip(&centre).map(|(x, c)| x - c);
            sign(point) * self.area(point) * arm.zip(normal).map(|(a, n)| a * n).sum::<f64>()
        };
        self.points.iter().map(of_point).sum()
    }

    /// Computes `Σ a |x − c|`, d times the volume of a ball of as much surface as far from its centre.
    fn volume_of_ball(&self) -> f64 {
        let (cloud, centre) = (self.sampled.cloud, self.centre());
        let distance = |x: &[f64]| x.iter().zip(&centre).map(|(x, c)| (x - c).powi(2)).sum::<f64>().sqrt();
        self.points.iter().map(|&point| self.area(point) * distance(cloud.point(point))).sum()
    }

    fn centre(&self) -> Vec<f64> {
        let mut centre = vec![0.0; self.sampled.cloud.dimension()];
        let total: f64 = self.points.iter().map(|&point| self.area(point)).sum();
        for &point in self.points {
            let share = self.area(point) / total;
            centre.iter_mut().zip(self.sampled.cloud.point(point)).for_each(|(c, x)| *c += share * x);
        }
        centre
    }

    fn area(&self, point: usize) -> f64 {
        area(self.sampled.sampling, point, self.sampled.cloud.dimension())
    }
}

/// Area that a point stands for, in proportion: h_q^{d−1}.
pub(super) fn area(sampling: &Sampling, point: usize, dimension: usize) -> f64 {
    sampling.spacing(point).powi(dimension as i32 - 1)
}

/// Most pieces of one surface that [`is_large`] can hold for.
pub(super) const MAX_LARGE: usize = 100;

/// Returns whether a piece has a hundredth of the points or more, and at least one. Others may lie inside it.
pub(super) fn is_large(n_points: usize, n_of_all: usize) -> bool {
    n_points >= n_of_all.div_ceil(MAX_LARGE).max(1)
}

/// The axis-parallel box around some points.
#[derive(Default)]
pub(super) struct Bounds {
    pub least: Vec<f64>,
    pub greatest: Vec<f64>,
}

impl Bounds {
    pub(super) fn of(cloud: &Cloud, points: &[usize]) -> Self {
        let corners = points.iter().map(|&point| cloud.point(point));
        corners.fold(Self::default(), |bounds, x| bounds.with(x, x))
    }

    /// The box around this one and another, which has these corners.
    pub(super) fn with(mut self, lower: &[f64], upper: &[f64]) -> Self {
        if self.least.is_empty() {
            return Self { least: lower.to_vec(), greatest: upper.to_vec() };
        }
        self.least.iter_mut().zip(lower).for_each(|(own, other)| *own = own.min(*other));
        self.greatest.iter_mut().zip(upper).for_each(|(own, other)| *own = own.max(*other));
        self
    }

    pub(super) fn contain(&self, other: &Self) -> bool {
        self.least.iter().zip(&other.least).all(|(own, other)| own < other)
            && self.greatest.iter().zip(&other.greatest).all(|(own, other)| own > other)
    }
}
