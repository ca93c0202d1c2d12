//! Counts of the sides of normals, by truth and flag.

use std::sync::Arc;

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::flags::{Flag, FlagReason};
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use super::clouds::OrientedCloud;
use crate::common::fits::{default_kernel_and_alpha, factorize, surface};

const NORMALS: GeometryRequest = GeometryRequest { checks_curvatures: false, ..GeometryRequest::CURVATURES };

#[derive(Debug, Clone, Copy, Default)]
pub struct SideTally {
    pub n_points: usize,
    /// Normals that point to the wrong side, with a flag or without.
    pub n_flipped: usize,
    pub n_flipped_unflagged: usize,
    /// Points with a flag, for any reason (here) and for an ambiguous side (`n_ambiguous`).
    pub n_flagged: usize,
    pub n_ambiguous: usize,
    /// Normals without a flag that are off by more than 30° as lines, whatever their side.
    pub n_off_unflagged: usize,
}

/// Cosine of 30°, beyond which a normal counts as off.
const OFF: f64 = 0.866;

impl SideTally {
    /// Counts sides by the signature function with default parameters.
    pub fn dense(sided: &OrientedCloud) -> Self {
        let (kernel, alpha) = default_kernel_and_alpha(&sided.cloud, Purpose::Normals);
        Self::of(&surface(&factorize(&sided.cloud, kernel, alpha)), sided)
    }

    /// Counts sides by local regressions.
    pub fn local(sided: &OrientedCloud) -> Self {
        let cloud = Arc::new(sided.cloud.clone());
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        Self::of(
            &LocalSurface::of(cloud, sampling, LocalInputs::default(), &Unobserved).unwrap().into(),
            sided,
        )
    }

    fn of(surface: &Surface, sided: &OrientedCloud) -> Self {
        let geometry = Geometry::of(surface, &sided.cloud, &NORMALS, &Unobserved).unwrap();
        let (n, d) = (sided.cloud.n_points(), sided.cloud.dimension());
        let mut is_flagged = vec![false; n];
        geometry.flags().iter().for_each(|entry| is_flagged[entry.query] = true);
        let is_ambiguous = |entry: &&Flag| entry.reason == FlagReason::AmbiguousSide;
        let along = |point: usize| -> f64 {
            let truth = &sided.normals[point * d..][..d];
            geometry.normal(point).iter().zip(truth).map(|(a, b)| a * b).sum()
        };
        let flipped: Vec<usize> = (0..n).filter(|&point| along(point) < 0.0).collect();
        Self {
            n_points: n,
            n_flipped: flipped.len(),
            n_flipped_unflagged: flipped.iter().filter(|&&point| !is_flagged[point]).count(),
            n_flagged: geometry.flags().len(),
            n_off_unflagged: (0..n).filter(|&point| !is_flagged[point] && along(point).abs() < OFF).count(),
            n_ambiguous: geometry.flags().iter().filter(is_ambiguous).count(),
        }
    }

    /// The counts of two clouds together.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            n_points: self.n_points + other.n_points,
            n_flipped: self.n_flipped + other.n_flipped,
            n_flipped_unflagged: self.n_flipped_unflagged + other.n_flipped_unflagged,
            n_flagged: self.n_flagged + other.n_flagged,
            n_ambiguous: self.n_ambiguous + other.n_ambiguous,
            n_off_unflagged: self.n_off_unflagged + other.n_off_unflagged,
        }
    }

    pub fn flipped(&self) -> f64 {
        self.n_flipped as f64 / self.n_points as f64
    }

    /// Share of all points that are flipped without a flag.
    pub fn flipped_unflagged(&self) -> f64 {
        self.n_flipped_unflagged as f64 / self.n_points as f64
    }

    /// Share of the points without a flag that are flipped.
    pub fn wrong_of_unflagged(&self) -> f64 {
        self.n_flipped_unflagged as f64 / (self.n_points - self.n_flagged).max(1) as f64
    }

    /// Share of all points that are off without a flag.
    pub fn off_unflagged(&self) -> f64 {
        self.n_off_unflagged as f64 / self.n_points as f64
    }

    pub fn flagged(&self) -> f64 {
        self.n_flagged as f64 / self.n_points as f64
    }

    pub fn ambiguous(&self) -> f64 {
        self.n_ambiguous as f64 / self.n_points as f64
    }
}
