//! The surface around a query as a height over a tangent plane of its own.

mod entailed;
mod grown;
mod growth;
mod quadric;
mod sheet;

use super::means::Support;
use super::regression::{Batch, n_terms};
use crate::machine::small::Small;
use crate::points::neighbours::Neighbour;
use crate::solver::choose::MAX_LOCAL_DIMENSION;
use grown::Grown;

/// Points per term of the trend in a whole neighbourhood: 30 for surfaces in space.
const POINTS_PER_TERM: usize = 5;

/// Points, or means, in a neighbourhood: even, and at most as many as there are. None in dimensions that have
/// no regressions, so that nothing is searched or factorized there.
pub(crate) fn n_neighbours(dimension: usize, available: usize) -> usize {
    if dimension > MAX_LOCAL_DIMENSION {
        return 0;
    }
    (POINTS_PER_TERM * n_terms(dimension)).next_multiple_of(2).min(available / 2 * 2)
}

/// A frame at a query with the quadric of the heights above it, in units of its radius.
pub(crate) struct Neighbourhood {
    /// d − 1 tangents, then the normal, `[d, d]`.
    pub frame: Small,
    /// R: greatest distance of a point that is used, unit L.
    pub radius: f64,
    /// Whether no neighbour lies within 75° of the direction opposite to most of them.
    pub is_at_rim: bool,
}

/// Room for the coordinates of one neighbourhood.
#[derive(Default)]
pub(crate) struct Scratch {
    /// x_j − x, `[count, d]`, unit L.
    pub(super) arms: Vec<f64>,
    /// Terms of the trend, 1 left out: tangential coordinates and their products in units of the radius at hand, `[count, p]`.
    pub(super) terms: Vec<f64>,
    /// Heights without what curvature entails, and as they are.
    pub(super) heights: Vec<f64>,
    pub(super) raw: Vec<f64>,
}

impl Scratch {
    fn terms_at<const P: usize>(&self, at: usize) -> &[f64; P] {
        &self.terms.as_chunks().0[at]
    }
}

impl Neighbourhood {
    /// The neighbourhood of x, put into one lane of a batch; `None` if the nearest points determine no surface.
    pub(crate) fn put(
        support: &Support,
        x: &[f64],
        nearest: &mut [Neighbour],
        batch: &mut Batch,
        lane: usize,
        scratch: &mut Scratch,
    ) -> Option<Self> {
        match x.len() {
            2 => Grown::<2, { n_terms(2) }>::put(support, x, nearest, batch, lane, scratch),
            3 => Grown::<3, { n_terms(3) }>::put(support, x, nearest, batch, lane, scratch),
            4 => Grown::<4, { n_terms(4) }>::put(support, x, nearest, batch, lane, scratch),
            _ => None,
        }
    }
}
