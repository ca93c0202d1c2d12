//! Connected pieces of a surface, and the sign of each by itself.

use super::{Directions, Sampled};
use crate::points::cloud::Cloud;

/// Factor by which consistent signs may shrink the volume.
const LOST_VOLUME: f64 = 1.05;

/// Share of the gradients that must agree for their sign to be believed without the volume.
const UNANIMITY: f64 = 0.95;

/// Volume of a piece, over that of a ball of as much surface as far from its centre, above which the volume
/// decides. It is then known better than any gradient: those of a wide kernel on an octahedron agree, and
/// point inward. A torus with a tube of a seventh of its radius has twice as much.
const BULKY: f64 = 0.1;

/// A connected part of the surface with signs relative to one another.
pub(super) struct Piece<'a> {
    pub sampled: &'a Sampled<'a>,
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
        let total: f64 = signed().map(|&point| self.area(point)).sum();
        let vote: f64 = signed().map(|&point| self.relative[point] * self.area(point)).sum();
        let volume = self.volume(|point| self.relative[point]);
        let is_bulky = !is_nested && volume.abs() > BULKY * self.volume_of_ball();
        let is_unanimous = vote.abs() >= (2.0 * UNANIMITY - 1.0) * total;
        let decides_itself = has_rim || is_unanimous && !is_bulky;
        let decisive = if total > 0.0 && decides_itself || volume == 0.0 { vote } else { volume };
        if decisive < 0.0 { -1.0 } else { 1.0 }
    }

    /// Returns whether consistent signs enclose less than the gradients do by themselves.
    ///
    /// Then separate surfaces that nearly touch, each of them right, were taken for one. Curves cross their
    /// own inside too often for this to tell.
    pub(super) fn loses_volume(&self) -> bool {
        let signed = |sign: f64, point: usize| if self.directions.has_sign[point] { sign } else { 0.0 };
        let by_gradients = self.volume(|point| signed(1.0, point)).abs();
        let repaired = self.volume(|point| signed(self.relative[point], point)).abs();
        self.sampled.cloud.dimension() > 2 && by_gradients > LOST_VOLUME * repaired
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
        self.sampled.sampling.spacing(point).powi(self.sampled.cloud.dimension() as i32 - 1)
    }
}

/// The axis-parallel box around some points.
pub(super) struct Bounds {
    least: Vec<f64>,
    greatest: Vec<f64>,
}

impl Bounds {
    pub(super) fn of(cloud: &Cloud, points: &[usize]) -> Self {
        let first = points.first().map_or(&[][..], |&point| cloud.point(point));
        let (mut least, mut greatest) = (first.to_vec(), first.to_vec());
        for &point in points {
            for ((x, l), g) in cloud.point(point).iter().zip(&mut least).zip(&mut greatest) {
                (*l, *g) = (l.min(*x), g.max(*x));
            }
        }
        Self { least, greatest }
    }

    pub(super) fn contain(&self, other: &Self) -> bool {
        self.least.iter().zip(&other.least).all(|(own, other)| own < other)
            && self.greatest.iter().zip(&other.greatest).all(|(own, other)| own > other)
    }
}
