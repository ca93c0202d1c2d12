//! The surface that a cloud samples: the level surface of a function, or local regressions.

pub mod flags;
pub mod geometry;
pub mod local;
pub mod price;
pub mod served;
pub mod signature;

pub(crate) mod curvature;
mod request;

use crate::error::{NumericsError, Quantity, Result, SolverKind};
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::orientation::{SurfaceOrientation, tiles};
use crate::points::cloud::Cloud;
use crate::points::neighbours::{Neighbour, Neighbours};
use crate::points::sampling::{SPACING_NEIGHBOURS, Sampling};
use crate::regression::function::interpolant::Interpolant;
use geometry::GeometryRequest;
use local::LocalSurface;
use served::GeometryArrays;
use signature::SignatureSurface;

/// A surface with consistently oriented normals at the points, d ≥ 2.
///
/// Building it costs one evaluation at all points and a look at the neighbours of each, so it is made once.
pub enum Surface {
    /// Level surface of a global function.
    Signature(Box<SignatureSurface>),
    /// Local regressions.
    Local(Box<LocalSurface>),
}

impl Surface {
    /// Builds the surface of a signature function. `given` are normals of the points, `[n, d]`, of any length
    /// but 0.
    ///
    /// # Errors
    /// Returns the errors of [`SignatureSurface::of`].
    pub fn of(signature: Interpolant, given: Option<&Cloud>, observer: &dyn Observer) -> Result<Self> {
        Ok(SignatureSurface::of(signature, given, observer)?.into())
    }

    /// Finds the regions of a tile; see [`LocalSurface::regions`].
    ///
    /// # Errors
    /// Returns the errors of that, and [`NumericsError::Unsupported`] for a signature function.
    pub fn regions(
        &self,
        tile: &tiles::Tile<'_>,
        directions: &Cloud,
        observer: &dyn Observer,
    ) -> Result<tiles::LabelledRegions, NumericsError> {
        match self {
            Self::Local(surface) => surface.regions(tile, directions, observer),
            Self::Signature(_) => {
                Err(NumericsError::Unsupported { solver: SolverKind::Dense, quantity: Quantity::Regions })
            }
        }
    }

    pub fn cloud(&self) -> &Cloud {
        match self {
            Self::Signature(surface) => surface.cloud(),
            Self::Local(surface) => surface.cloud(),
        }
    }

    /// Returns the function u whose level surface this is, if there is one.
    pub fn signature(&self) -> Option<&Interpolant> {
        match self {
            Self::Signature(surface) => Some(surface.signature()),
            Self::Local(_) => None,
        }
    }

    pub fn orientation(&self) -> SurfaceOrientation {
        match self {
            Self::Signature(surface) => surface.orientation(),
            Self::Local(surface) => surface.orientation(),
        }
    }

    /// Neighbour search among the points of the surface.
    pub fn neighbours(&self) -> &Neighbours {
        self.sampling().neighbours()
    }

    /// Spacings of the points of the surface.
    pub fn sampling(&self) -> &Sampling {
        match self {
            Self::Signature(surface) => &surface.sampling,
            Self::Local(surface) => surface.sampling(),
        }
    }

    /// Bytes held on the heap beside the factor and the cloud.
    pub fn n_bytes(&self) -> usize {
        match self {
            Self::Signature(surface) => surface.n_bytes(),
            Self::Local(surface) => surface.n_bytes(),
        }
    }

    fn serve(
        &self,
        queries: &Cloud,
        request: &GeometryRequest,
        observer: &dyn Observer,
    ) -> Result<GeometryArrays> {
        match self {
            Self::Signature(surface) => signature::serve(surface, queries, request, observer),
            Self::Local(surface) => surface.serve(queries, request, observer),
        }
    }
}

/// Normals at the points of a cloud, `[n, d]`, with a side.
struct NearNormals<'a> {
    sampling: &'a Sampling,
    normals: &'a [f64],
}

/// Squared distance, in spacings, at which a point has half of the greatest weight. Near a thin sheet the
/// point on the side of the query decides.
const SOFTENING: f64 = 1e-3;

impl NearNormals<'_> {
    /// Returns how much a direction at x goes along the normals of the nearest points, each weighted by the
    /// inverse of its squared distance. `found` is a buffer.
    fn along(&self, x: &[f64], direction: &[f64], found: &mut Vec<Neighbour>) -> f64 {
        let d = direction.len();
        self.sampling.neighbours().nearest_into(x, SPACING_NEIGHBOURS, found);
        let of_point = |found: &Neighbour| {
            let spacing = self.sampling.spacing(found.point);
            let weight = 1.0 / (found.squared_distance + SOFTENING * spacing.powi(2));
            weight * dot(&self.normals[found.point * d..][..d], direction)
        };
        found.iter().map(of_point).sum()
    }
}

impl From<SignatureSurface> for Surface {
    fn from(surface: SignatureSurface) -> Self {
        Self::Signature(Box::new(surface))
    }
}

impl From<LocalSurface> for Surface {
    fn from(surface: LocalSurface) -> Self {
        Self::Local(Box::new(surface))
    }
}
