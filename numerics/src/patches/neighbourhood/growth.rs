//! Growth of a neighbourhood: how far it may reach, and which points belong to other sheets.

use smallvec::SmallVec;

use super::quadric::{Fit, Sums, largest_curvature};
use super::{Scratch, Support};
use crate::points::neighbours::Neighbour;

/// Greatest product of curvature and radius of a neighbourhood: about the angle by which the normal turns.
const MAX_BEND: f64 = 0.7;

/// Standard error of a second derivative times √k, from k heights of unit noise over the unit disc.
const DISC_ERROR: f64 = 8.5;

/// Standard errors of a curvature that noise explains: by the residuals of the points, and by the noise of
/// the whole cloud. Nine points say little of the noise and much of a bend, which then ended half of the
/// neighbourhoods of clouds with noise. From two to four the errors are the same, with one a tenth larger.
const DISC_ERRORS: f64 = 2.0;
const NOISE_ERRORS: f64 = 2.5;

/// Height above the quadric of nearer points, relative to the distance, beyond which a point is on another
/// sheet. [`RESIDUALS`] standard deviations are allowed on top.
const OTHER_SHEET: f64 = 0.3;
/// Standard deviations of the heights from the quadric that are allowed on top of [`OTHER_SHEET`].
const RESIDUALS: f64 = 3.0;

/// A quadric over more and more points, in one frame and one unit.
pub(super) struct Growth<const D: usize, const P: usize> {
    sums: Sums<P>,
    /// The quadric over the points taken in.
    fit: Option<Fit<P>>,
    /// Standard deviation of the heights from the quadric.
    residual: f64,
    /// Largest curvature that noise does not explain.
    curvature: f64,
    /// Number of nearest points considered so far.
    n_seen: usize,
    /// Places in the list of the nearest points that were taken in, ascending.
    taken: SmallVec<[u32; 64]>,
    /// Greatest height above the quadric, beside the residual, of a point on the sheet.
    reach: f64,
    /// Standard deviation of the noise of a point, as far as the whole cloud tells.
    noise: f64,
}

impl<const D: usize, const P: usize> Growth<D, P> {
    /// Returns a quadric over no points yet.
    pub(super) fn up_to(reach: f64, noise: f64) -> Self {
        Self {
            sums: Sums::default(),
            fit: None,
            residual: 0.0,
            curvature: 0.0,
            n_seen: 0,
            taken: SmallVec::new(),
            reach,
            noise,
        }
    }

    /// The quadric over the points taken in, or 0 if there are none.
    pub(super) fn quadric(&self) -> [f64; P] {
        self.fit.map_or([0.0; P], |fit| fit.quadric)
    }

    /// Takes in the points up to `count`. Returns `None` if the surface bends too much over them, or is not
    /// determined.
    pub(super) fn take(
        &mut self,
        count: usize,
        unit: f64,
        support: &Support,
        nearest: &[Neighbour],
        scratch: &Scratch,
    ) -> Option<()> {
        let radius = nearest[count - 1].squared_distance.sqrt() / unit;
        if self.curvature * radius > MAX_BEND {
            return None;
        }
        let (mut sums, n_taken) = (self.sums, self.taken.len());
        for (at, found) in nearest.iter().enumerate().take(count).skip(self.n_seen) {
            let (terms, height) = (scratch.terms_at::<P>(at), scratch.heights[at]);
            if self.n_seen == 0 || self.is_of_sheet(terms, height) {
                sums.add(terms, height, support.count(found.point));
                self.taken.push(at as u32);
            }
        }
        let found = self.settle(&sums, radius);
        match found {
            Some(()) => (self.sums, self.n_seen) = (sums, count),
            None if self.n_seen > 0 => self.taken.truncate(n_taken),
            None => {}
        }
        found
    }

    /// Fits the quadric to the points taken in. Returns `None` if the surface bends too much over them.
    fn settle(&mut self, sums: &Sums<P>, radius: f64) -> Option<()> {
        let fit = sums.fit()?;
        let residual = fit.residuals;
        let n_used = self.taken.len() as f64;
        let freedom = (n_used - P as f64).max(1.0);
        let by_residuals =
            DISC_ERRORS * DISC_ERROR * (residual / freedom / n_used).sqrt() / (radius * radius);
        let by_noise = match self.noise > 0.0 {
            true => NOISE_ERRORS * self.noise * fit.unit_error::<D>(),
            false => 0.0,
        };
        let bend = largest_curvature::<D, P>(&fit.quadric);
        let curvature = (bend - by_residuals.max(by_noise)).max(0.0);
        // The first points are kept however much they bend: nothing else is known.
        if !bend.is_finite() || self.n_seen > 0 && curvature * radius > MAX_BEND {
            return None;
        }
        self.curvature = self.curvature.max(curvature);
        (self.fit, self.residual) = (Some(fit), (residual / freedom).sqrt());
        Some(())
    }

    fn is_of_sheet(&self, terms: &[f64; P], height: f64) -> bool {
        let expected: f64 = self.quadric().iter().zip(terms).map(|(q, t)| q * t).sum();
        let distance = (terms[1..D].iter().map(|t| t * t).sum::<f64>() + height * height).sqrt();
        let most =
            (OTHER_SHEET * distance).min(self.reach) + RESIDUALS * self.residual.max(self.error(terms));
        (height - expected).abs() <= most
    }

    /// Standard error of the height of a point above the quadric by the noise of the cloud.
    fn error(&self, terms: &[f64; P]) -> f64 {
        let of_quadric = self.fit.filter(|_| self.noise > 0.0).map_or(0.0, |fit| fit.height_error(terms));
        self.noise * of_quadric.hypot(1.0)
    }

    /// Moves the points that were taken in to the front of both lists and returns their number.
    pub(super) fn keep(&self, nearest: &mut [Neighbour], arms: &mut [f64]) -> usize {
        for (to, from) in self.taken.iter().map(|&at| at as usize).enumerate() {
            nearest.swap(to, from);
            (0..D).for_each(|c| arms.swap(to * D + c, from * D + c));
        }
        self.taken.len()
    }
}
