//! Normals of closed surfaces: they are right, or flagged.

use gramian_numerics::observer::Unobserved;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};

use super::closed::{ClosedSurface, outward_normal, sample};
use super::common::clouds::cloud;
use super::common::fits::{factorize, kernel};
use super::common::random::Random;
use super::sweep::KERNELS;

/// Cosine of 30°, beyond which a normal counts as off.
const OFF: f64 = 0.866;

/// Counts of normals at the points, by accuracy and flag.
#[derive(Debug, Clone, Copy, Default)]
pub struct NormalTally {
    pub n_points: usize,
    pub n_flagged: usize,
    /// Normals off by more than 30° as lines, with a flag (here) and without (`n_off`).
    pub n_off_flagged: usize,
    pub n_off: usize,
    /// Normals without a flag that are right to 30° as lines but point inward.
    pub n_flipped: usize,
}

impl NormalTally {
    pub fn add(self, other: Self) -> Self {
        Self {
            n_points: self.n_points + other.n_points,
            n_flagged: self.n_flagged + other.n_flagged,
            n_off_flagged: self.n_off_flagged + other.n_off_flagged,
            n_off: self.n_off + other.n_off,
            n_flipped: self.n_flipped + other.n_flipped,
        }
    }

    pub fn n_unflagged(&self) -> usize {
        self.n_points - self.n_flagged
    }
}

/// Counts normals at n random points of one surface, moved by noise of this deviation per coordinate. The
/// kernel is number `at` of [`KERNELS`], with `scale` times its length scale.
pub fn tally(surface: ClosedSurface, at: usize, scale: f64, n: usize, noise: f64) -> NormalTally {
    let (_, f, half_sides) = surface;
    let mut random = Random(77 + n as u64);
    let points = sample(f, half_sides, n, &mut random);
    let moved: Vec<[f64; 3]> = points.iter().map(|x| x.map(|c| c + noise * random.normal())).collect();
    let (_, family, length_scale) = KERNELS[at];
    let factor = factorize(&cloud(&moved), kernel(family, scale * length_scale), 1e-10);
    let Ok(signature) = Interpolant::signature(factor, &Unobserved) else { return NormalTally::default() };
    let surface = Surface::of(signature, None, &Unobserved).unwrap();
    let request = GeometryRequest { checks_curvatures: false, ..GeometryRequest::CURVATURES };
    let geometry = Geometry::of(&surface, &cloud(&moved), &request, &Unobserved).unwrap();
    let mut is_flagged = vec![false; n];
    geometry.flags().iter().for_each(|entry| is_flagged[entry.query] = true);
    let mut tally = NormalTally { n_points: n, ..NormalTally::default() };
    for (i, &x) in points.iter().enumerate() {
        let truth = outward_normal(f, x);
        let along: f64 = geometry.normal(i).iter().zip(truth).map(|(a, b)| a * b).sum();
        let is_off = along.abs() < OFF;
        tally.n_flagged += usize::from(is_flagged[i]);
        tally.n_off_flagged += usize::from(is_flagged[i] && is_off);
        tally.n_off += usize::from(!is_flagged[i] && is_off);
        tally.n_flipped += usize::from(!is_flagged[i] && !is_off && along < 0.0);
    }
    tally
}
