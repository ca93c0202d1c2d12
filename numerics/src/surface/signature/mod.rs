//! The level surface of a signature function, with local quadrics and normals at its points.

mod confirmation;
mod deviations;
mod directions;
mod doubt;
mod function;
mod noisy;
mod offset;
mod serving;

use std::sync::{Arc, OnceLock};

use super::NearNormals;
use super::flags::is_too_rough;
use crate::error::{NumericsError, Result};
use crate::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::orientation::{CloudWithNeighbours, OrientedNormals, SurfaceOrientation, n_around};
use crate::patches::Patches;
use crate::points::cloud::Cloud;
use crate::points::duplicates::count_duplicates;
use crate::points::local_quadrics::LocalQuadrics;
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::neighbours::Neighbour;
use crate::points::patch::Patch;
use crate::points::quadric::n_quadric_neighbours;
use crate::points::sampling::{SPACING_NEIGHBOURS, Sampling};
use crate::regression::function::interpolant::Interpolant;
use crate::regression::solver::MAX_INVERSE_DIAGONAL;
use directions::directions;
pub use function::Signature;
use noisy::oriented_curve;
pub(crate) use serving::serve;

/// A surface with local quadrics and consistently oriented normals at the points, d ≥ 2.
///
/// Building it costs one evaluation at all points and a quadric through the neighbours of each. So it is made
/// once per factorization.
pub struct SignatureSurface {
    signature: Signature,
    pub(super) sampling: Arc<Sampling>,
    quadrics: LocalQuadrics,
    oriented: OrientedNormals,
    is_too_rough: bool,
    radius: f64,
    left_out_misses: OnceLock<Option<Vec<f64>>>,
    patches: OnceLock<Arc<Patches>>,
}

impl SignatureSurface {
    /// Builds the surface of a signature function. `given` are normals of the points, `[n, d]`, of any length
    /// but 0.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Overflow`],
    /// [`NumericsError::Cancelled`].
    pub fn of(signature: Interpolant, given: Option<&Cloud>, observer: &dyn Observer) -> Result<Self> {
        let sampling = Arc::new(Sampling::of(signature.solver.cloud(), observer)?);
        Self::over(sampling, Signature::of(signature, observer)?, given, observer)
    }

    /// Builds the surface over a sampling of the same cloud that exists already.
    ///
    /// # Errors
    /// Returns the errors of [`SignatureSurface::of`].
    pub fn over(
        sampling: Arc<Sampling>,
        signature: Signature,
        given: Option<&Cloud>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let solver = signature.function().solver.clone();
        let cloud = solver.cloud();
        if cloud.dimension() < 2 {
            return Err(NumericsError::DimensionTooSmall { found: cloud.dimension() });
        }
        let count = n_quadric_neighbours(cloud.dimension());
        let around = Neighbourhoods::of(sampling.neighbours(), cloud, count, observer)?;
        let quadrics = LocalQuadrics::of(cloud, &around, cloud, observer)?;
        let around = around.narrowed(n_around(cloud));
        let of_noisy_curve = match given {
            None => oriented_curve(cloud, &sampling, observer)?,
            Some(_) => None,
        };
        let oriented = match of_noisy_curve {
            Some(oriented) => oriented,
            None => {
                let directions = directions(&signature, &sampling, &quadrics, observer)?;
                let sampled = CloudWithNeighbours { cloud, sampling: &sampling, around: &around, observer };
                OrientedNormals::of(&sampled, directions, &quadrics, given)?
            }
        };
        let is_too_rough = is_too_rough(solver.kernel(), sampling.scales());
        let radius = if cloud.radius() > 0.0 { cloud.radius() } else { 1.0 };
        let left_out_misses = OnceLock::new();
        Ok(Self {
            signature,
            sampling,
            quadrics,
            oriented,
            is_too_rough,
            radius,
            left_out_misses,
            patches: OnceLock::new(),
        })
    }

    /// The function u whose level surface this is.
    pub fn signature(&self) -> &Interpolant {
        self.signature.function()
    }

    pub fn cloud(&self) -> &Cloud {
        self.signature().solver.cloud()
    }

    pub fn orientation(&self) -> SurfaceOrientation {
        self.oriented.how
    }

    /// Returns whether the points around x lie on a line, or span for another reason fewer directions than a
    /// surface has.
    pub(crate) fn is_thread(&self, x: &[f64]) -> bool {
        let count = n_quadric_neighbours(self.cloud().dimension());
        let nearest = self.sampling.neighbours().nearest_positions(x, count);
        let patch = Patch::of(self.cloud(), x, nearest.iter().map(|found| found.point));
        patch.is_some_and(|patch| patch.n_points() == count && patch.is_thread())
    }

    /// Returns `|λ_i/((K+αI)⁻¹)_ii|`, what u misses at each point when that is left out (Rippa 1999).
    ///
    /// Only small clouds with a Cholesky factor have it.
    pub(crate) fn left_out_misses(&self) -> Option<&[f64]> {
        if self.left_out_misses.get().is_none() {
            // Computed outside the cell. A thread that waits for the others would otherwise hold the cell,
            // and the job that it takes up meanwhile may ask for the same. A few threads may compute it, and
            // the first result is stored.
            let made = self.compute_left_out_misses();
            let _ = self.left_out_misses.set(made);
        }
        self.left_out_misses.get()?.as_deref()
    }

    /// Local regressions of the same points, made when deviations are requested or a normal is in doubt.
    ///
    /// # Errors
    /// Returns the errors of [`Patches::of`].
    fn patches(&self, observer: &dyn Observer) -> Result<Arc<Patches>> {
        if let Some(patches) = self.patches.get() {
            return Ok(patches.clone());
        }
        // Computed outside the cell, as in `left_out_misses`.
        let cloud = self.signature.function().solver.cloud().clone();
        let made = Arc::new(Patches::of(cloud, self.sampling.clone(), observer)?);
        let _ = self.patches.set(made.clone());
        Ok(self.patches.get().unwrap_or(&made).clone())
    }

    fn compute_left_out_misses(&self) -> Option<Vec<f64>> {
        let solver = &self.signature().solver;
        // A repeated observation is predicted by its copy.
        if solver.n_points() > MAX_INVERSE_DIAGONAL || count_duplicates(solver.cloud()) > 0 {
            return None;
        }
        let diagonal = solver.inverse_diagonal().ok()?;
        Some(self.signature().solution.weights.iter().zip(diagonal).map(|(w, d)| (w / d).abs()).collect())
    }

    /// Outward unit normals of the points, `[n, d]`, zero where unknown.
    pub(crate) fn normals(&self) -> &[f64] {
        &self.oriented.normals
    }

    /// The outward unit normal of a point, zero where unknown.
    pub(crate) fn normal(&self, point: usize) -> &[f64] {
        let d = self.cloud().dimension();
        &self.oriented.normals[point * d..][..d]
    }

    /// Returns the sign that turns ∇u at x into an outward direction. `found` is a buffer.
    ///
    /// The points near x decide: a narrow kernel makes u a ridge, and −∇u points inward just inside. On
    /// clouds that do not resolve their surface the sign is −1.
    pub(crate) fn outward_sign(&self, x: &[f64], gradient: &[f64], found: &mut Vec<Neighbour>) -> f64 {
        if !self.oriented.is_consistent && !self.orientation().is_given {
            return -1.0;
        }
        let near = NearNormals { sampling: &self.sampling, normals: &self.oriented.normals };
        if near.along(x, gradient, found) > 0.0 { 1.0 } else { -1.0 }
    }

    /// Returns +1 if ∇u at the points near x goes along `outward`, else −1. `found` is a buffer.
    ///
    /// It is −1, inward, also where there is no ∇u.
    pub(crate) fn gradient_side(&self, x: &[f64], outward: &[f64], found: &mut Vec<Neighbour>) -> f64 {
        let Some(jets) = self.signature.jets() else { return -1.0 };
        self.sampling.neighbours().nearest_positions_into(x, SPACING_NEIGHBOURS, found);
        let along: f64 = found.iter().map(|found| dot(jets.gradient(found.point), outward)).sum();
        if along > 0.0 { 1.0 } else { -1.0 }
    }

    /// Bytes held on the heap beside the factor.
    pub fn n_bytes(&self) -> usize {
        let n = self.cloud().n_points();
        // Counted although they are computed later, if at all.
        let left_out_misses = if n <= MAX_INVERSE_DIAGONAL { block_bytes(n * size_of::<f64>()) } else { 0 };
        self.signature.n_bytes()
            + self.sampling.n_bytes()
            + self.quadrics.n_bytes()
            + vec_bytes(&self.oriented.normals)
            + vec_bytes(&self.oriented.is_ambiguous)
            + left_out_misses
            + block_bytes(arc_payload::<Sampling>())
            + block_bytes(arc_payload::<Self>())
    }
}
