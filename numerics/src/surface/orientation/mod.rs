//! Signs of normals over a whole cloud: checked against the neighbours, and repaired.
//!
//! The gradient of the signature function points out of a closed surface while ℓ is not small against its
//! features; for a small ℓ its sign follows the mean curvature and flips where that changes sign (errata.md,
//! 13). Across such a flip the normals of neighbours are opposite although the surface goes on. Therefore:
//!
//! 1. Points whose signs agree are joined to regions, regions by what their common border says (`edges`), and
//!    pieces across the gaps between them along the shortest edges of the cloud (`gaps`). Propagation over a
//!    neighbour graph is that of Hoppe et al. (1992); joining whole regions keeps a single bad edge from deciding.
//! 2. Each piece gets the sign of most of its gradients or, if they disagree and the piece is closed, or it is
//!    bulky, the sign that gives it a positive volume (`pieces`).
//! 3. Pieces are turned where winding numbers, which are ½ on a closed surface, clearly contradict: a linear
//!    problem that sees all of them together (`gauss`). So are parts of a piece that they contradict (`turns`).
//! 4. Points whose winding numbers or neighbours still contradict have an ambiguous side.

mod areas;
mod cell;
mod consistent;
mod edges;
mod field;
mod forest;
mod gaps;
mod gauss;
mod parts;
mod pieces;
mod sides;
#[cfg(test)]
mod tests;
mod turns;

use crate::error::NumericsError;
use crate::machine::vector::{dot, unit};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::{LocalQuadric, LocalQuadrics};
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::sampling::Sampling;
use consistent::consistent_signs;

/// A cloud with what is known of how it is sampled, and who watches.
#[derive(Clone, Copy)]
pub(crate) struct Sampled<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
    /// The nearest positions around each point, [`n_around`] or more.
    pub around: &'a Neighbourhoods,
    pub observer: &'a dyn Observer,
}

/// What is known of normals before their signs are made consistent.
pub(crate) struct Directions {
    /// Unit vectors at the points, `[n, d]`: outward where that is known, of unknown sign elsewhere, or zero.
    pub normals: Vec<f64>,
    /// Whether the sign means something, `[n]`.
    pub has_sign: Vec<bool>,
    /// Whether the point is at the rim of an open surface, `[n]`.
    pub is_at_rim: Vec<bool>,
}

impl Directions {
    /// Positions alone give the better direction where the cloud is dense; the signature function has given the
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

/// How the signs of normals were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SurfaceOrientation {
    /// Points whose gradient pointed inward.
    pub n_flipped: usize,
    /// Whether part of the surface has a rim, so that outward has no meaning there.
    pub is_open: bool,
    /// Whether the signs are those of normals that came with the cloud.
    pub is_given: bool,
}

/// Outward normals at the points.
pub(crate) struct Oriented {
    /// Unit vectors `[n, d]`; zero where nothing is known.
    pub normals: Vec<f64>,
    pub how: SurfaceOrientation,
    /// Whether neighbours have so much to do with one another that their signs can be compared.
    pub is_consistent: bool,
    /// Whether what is known of the side of a point contradicts itself, `[n]`.
    pub is_ambiguous: Vec<bool>,
}

impl Oriented {
    /// Orients what is known of the normals; `given` are normals of the client, `[n, d]`, of any length but
    /// 0, which decide.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of(
        sampled: &Sampled<'_>,
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

    /// [`Oriented::of`] without quadrics. Directions that are given keep their signs.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of_directions(
        sampled: &Sampled<'_>,
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

/// Positions that must be known around each point, itself among them.
pub(crate) fn n_around(cloud: &Cloud) -> usize {
    n_neighbours(cloud) + 1
}

/// Neighbours that a point shares edges with.
fn n_neighbours(cloud: &Cloud) -> usize {
    2 * cloud.dimension() + 2
}
