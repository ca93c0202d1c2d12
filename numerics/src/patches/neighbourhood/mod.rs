//! Neighbourhoods of queries: the surface as a height over a tangent plane of each query.

mod entailed;
mod grown;
mod growth;
mod quadric;
mod sheet;

use super::means::Support;
use super::regression::{Batch, n_terms};
use crate::machine::small::Small;
use crate::patches::MAX_LOCAL_DIMENSION;
use crate::points::neighbours::Neighbour;
use grown::GrowingNeighbourhood;

/// Points per term of the trend in a whole neighbourhood: 30 points for surfaces in space.
const POINTS_PER_TERM: usize = 5;

/// Number of points, or means, in a neighbourhood: even, and at most `available`.
///
/// It is 0 in dimensions without regressions, so that nothing is searched or factorized there.
pub(crate) fn n_neighbours(dimension: usize, available: usize) -> usize {
    if dimension > MAX_LOCAL_DIMENSION {
        return 0;
    }
    (POINTS_PER_TERM * n_terms(dimension)).next_multiple_of(2).min(available / 2 * 2)
}

/// Frame and size of the neighbourhood of a query. Its points go into a lane of a [`Batch`].
pub(crate) struct Neighbourhood {
    /// Axes of the frame as rows: d − 1 tangents, then the normal, `[d, d]`.
    pub frame: Small,
    /// R: greatest distance of a point that is used, unit L.
    pub radius: f64,
    /// True if no neighbour lies within 75° of the direction opposite to most of them.
    pub is_at_rim: bool,
}

/// Buffers for the points of one neighbourhood.
#[derive(Default)]
pub(crate) struct Scratch {
    /// σ: standard deviation of the noise of a point, as far as the whole cloud tells, unit L.
    pub noise: f64,
    /// Differences x_j − x, `[count, d]`, unit L.
    pub(super) arms: Vec<f64>,
    /// Terms of the trend in units of the current radius: 1, the tangential coordinates and their products,
    /// `[count, p]`.
    pub(super) terms: Vec<f64>,
    /// Heights without the entailed height, in units of the current radius.
    pub(super) heights: Vec<f64>,
    /// Heights as they are, in units of the current radius.
    pub(super) raw: Vec<f64>,
}

impl Scratch {
    fn terms_at<const P: usize>(&self, at: usize) -> &[f64; P] {
        &self.terms.as_chunks().0[at]
    }
}

impl Neighbourhood {
    /// Puts the neighbourhood of x into one lane of a batch. Returns `None` if the nearest points determine
    /// no surface.
    pub(crate) fn put(
        support: &Support,
        x: &[f64],
        nearest: &mut [Neighbour],
        batch: &mut Batch,
        lane: usize,
        scratch: &mut Scratch,
    ) -> Option<Self> {
        match x.len() {
            2 => GrowingNeighbourhood::<2, { n_terms(2) }>::put(support, x, nearest, batch, lane, scratch),
            3 => GrowingNeighbourhood::<3, { n_terms(3) }>::put(support, x, nearest, batch, lane, scratch),
            4 => GrowingNeighbourhood::<4, { n_terms(4) }>::put(support, x, nearest, batch, lane, scratch),
            _ => None,
        }
    }
}
