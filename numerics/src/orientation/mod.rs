//! Signs of normals over a whole cloud: checked against the neighbours, and repaired.
//!
//! Minus the gradient of the signature function points out of a closed surface while ℓ is not small against
//! its features. For a small ℓ its sign follows the mean curvature and flips where that changes sign
//! (errata.md, 13). Across such a flip the normals of neighbours are opposite although the surface goes on.
//! Signs are repaired in four steps:
//!
//! 1. Points whose signs agree are joined to regions. Regions are joined to pieces by what their common
//!    border says (`edges`). Pieces are joined across the gaps between them along the shortest edges of the
//!    cloud (`gaps`). Propagation over a neighbour graph is that of Hoppe et al. (1992). Joining whole
//!    regions keeps a single bad edge from deciding.
//! 2. Each piece gets the sign of most of its gradients. If these disagree and the piece is closed, or if it
//!    is bulky, it gets the sign that gives it a positive volume (`pieces`).
//! 3. Pieces are turned where winding numbers, which are ½ on a closed surface, clearly contradict them. This
//!    is a linear problem that sees all pieces together (`gauss`). Parts of a piece are turned likewise
//!    (`turns`).
//! 4. Points whose winding numbers or neighbours still contradict their side are marked as ambiguous.

mod consistent;
mod edges;
mod forest;
mod gaps;
mod parts;
mod pieces;
mod sides;
#[cfg(test)]
mod tests;
pub mod tiles;
mod winding;

pub(crate) use winding::numbers::WindingNumbers;

use crate::error::NumericsError;
use crate::machine::vector::{dot, unit};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::{LocalQuadric, LocalQuadrics};
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::sampling::Sampling;
use consistent::consistent_signs;

/// A cloud with its sampling, its neighbourhoods and an observer.
#[derive(Clone, Copy)]
pub(crate) struct CloudWithNeighbours<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
    /// The nearest positions around each point, [`n_around`] or more.
    pub around: &'a Neighbourhoods,
    pub observer: &'a dyn Observer,
}

/// Normals before their signs are made consistent.
pub(crate) struct Directions {
    /// Unit vectors at the points, `[n, d]`: outward where that is known, of unknown sign elsewhere, or zero.
    pub normals: Vec<f64>,
    /// True where the sign of the normal means something, `[n]`.
    pub has_sign: Vec<bool>,
    /// True at the rim of an open surface, `[n]`.
    pub is_at_rim: Vec<bool>,
}

impl Directions {
    /// Takes the directions of reliable quadrics and keeps the signs.
    ///
    /// Where the cloud is dense, positions alone give the better direction. The signature function gives the
    /// sign.
    fn straightened(mut self, quadrics: &LocalQuadrics) -> Self {
        let d = self.normals.len() / self.has_sign.len().max(1);
        for (point, normal) in self.normals.chunks_exact_mut(d.max(1)).enumerate() {
            if let Some(quadric) = quadrics.at(point).filter(LocalQuadric::is_reliable) {
                let sign = dot(normal, quadric.normal).signum();
                normal.iter_mut().zip(quadric.normal).for_each(|(c, n)| *c = sign * n);
            }
        }
        self
    }
}

/// Summary of how the signs of normals were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SurfaceOrientation {
    /// Number of points whose normal along the gradient pointed inward.
    pub n_flipped: usize,
    /// True if part of the surface has a rim, so that outward has no meaning there.
    pub is_open: bool,
    /// True if the signs are those of normals that came with the cloud.
    pub is_given: bool,
}

/// Outward normals at the points.
pub(crate) struct OrientedNormals {
    /// Unit vectors `[n, d]`, zero where nothing is known.
    pub normals: Vec<f64>,
    pub how: SurfaceOrientation,
    /// True if normals of neighbours agree so well as lines that their signs can be compared.
    pub is_consistent: bool,
    /// True where the evidence for the side of a point is contradictory, `[n]`.
    pub is_ambiguous: Vec<bool>,
}

impl OrientedNormals {
    /// Orients normals. If `given` are normals of the client, `[n, d]`, of any length but 0, they decide.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of(
        sampled: &CloudWithNeighbours<'_>,
        directions: Directions,
        quadrics: &LocalQuadrics,
        given: Option<&Cloud>,
    ) -> Result<Self, NumericsError> {
        let directions = match given {
            None => directions.straightened(quadrics),
            Some(given) => Directions { normals: given.points().flat_map(unit).collect(), ..directions },
        };
        Self::of_directions(sampled, directions, given.is_some())
    }

    /// Orients normals without quadrics. Given directions keep their signs.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of_directions(
        sampled: &CloudWithNeighbours<'_>,
        directions: Directions,
        is_given: bool,
    ) -> Result<Self, NumericsError> {
        let found = consistent_signs(sampled, &directions, is_given)?;
        let (is_open, is_consistent) = (found.is_open, found.is_resolved);
        let n_flipped = if is_given { 0 } else { found.n_flipped };
        let how = SurfaceOrientation { n_flipped, is_open, is_given };
        let mut normals = directions.normals;
        if !is_given {
            for (normal, sign) in normals.chunks_exact_mut(sampled.cloud.dimension()).zip(&found.signs) {
                normal.iter_mut().for_each(|c| *c *= sign);
            }
        }
        Ok(Self { normals, how, is_consistent, is_ambiguous: found.is_ambiguous })
    }
}

/// Returns how many positions must be known around each point, itself among them.
pub(crate) fn n_around(cloud: &Cloud) -> usize {
    n_neighbours(cloud) + 1
}

/// Returns how many neighbours a point shares edges with.
fn n_neighbours(cloud: &Cloud) -> usize {
    n_neighbours_in(cloud.dimension())
}

fn n_neighbours_in(dimension: usize) -> usize {
    2 * dimension + 2
}
