//! Surfaces at the queries of a request: flags, arrays and diagnostics of their answers.

use std::sync::Arc;

use crate::http::fields::{
    Diagnostics, Flag, FlagReason, StencilCounts, SurfaceModelUsed, Warning, WarningCode,
};
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use gramian_host::compute::JobObserver;
use gramian_host::wire::write::array::Array;
use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::Family;
use gramian_numerics::model::Report;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::flags::{self, FlagReason as Reason};
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, Orientation};
use gramian_numerics::surface::served::ServedBy;

/// A surface with its geometry at the queries of a request.
pub struct SurfaceGeometry {
    pub surface: Arc<Surface>,
    pub geometry: Geometry,
    /// Rows of the sparse operator over the surface, once there is one.
    pub stencils: Option<StencilCounts>,
    request: GeometryRequest,
}

/// Standard deviations, one entry per query.
pub struct DeviationArrays {
    pub normal: Array,
    pub principal: Array,
    pub mean: Array,
    pub gaussian: Array,
}

impl Fits {
    /// Computes the geometry of the surface at queries.
    ///
    /// # Errors
    /// Returns the errors of [`Geometry::of`] as a [`Problem`].
    pub fn geometry(
        &self,
        queries: &Cloud,
        request: &GeometryRequest,
        observer: &JobObserver,
    ) -> Result<SurfaceGeometry, Problem> {
        let fitted = self.surface();
        let surface = self.made_surface()?.clone();
        let geometry =
            Geometry::of(&surface, queries, request, observer).map_err(|error| fitted.refused(error))?;
        Ok(SurfaceGeometry { surface, geometry, stencils: None, request: *request })
    }
}

impl SurfaceGeometry {
    /// Returns the queries that have no answer or a flag.
    pub fn flags(&self) -> Vec<Flag> {
        let entry = |d: &flags::Flag| Flag {
            query: d.query,
            reason: match d.reason {
                Reason::VanishingGradient => FlagReason::VanishingGradient,
                Reason::UnaffordableRescue => FlagReason::UnaffordableRescue,
                Reason::KernelTooRough => FlagReason::KernelTooRough,
                Reason::FarFromCloud => FlagReason::FarFromCloud,
                Reason::UnderResolved => FlagReason::UnderResolved,
                Reason::AmbiguousSide => FlagReason::AmbiguousSide,
                Reason::Edge => FlagReason::Edge,
            },
            gradient_norm: d.gradient_norm,
        };
        self.geometry.flags().iter().map(entry).collect()
    }

    /// Flags queries where results for the values are doubtful, unless they are flagged already.
    ///
    /// If the judgement itself failed, all queries are flagged.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn flag_uncertain(
        &self,
        judged: Result<Vec<usize>, NumericsError>,
        flags: &mut Vec<Flag>,
    ) -> Result<(), NumericsError> {
        let m = self.geometry.n_queries();
        let queries = match judged {
            Err(NumericsError::Cancelled) => return Err(NumericsError::Cancelled),
            Err(_) => (0..m).collect(),
            Ok(queries) => queries,
        };
        let mut is_flagged = self.geometry.is_null().to_vec();
        flags.iter().for_each(|entry| is_flagged[entry.query] = true);
        for query in queries {
            if !std::mem::replace(&mut is_flagged[query], true) {
                let gradient_norm = self.geometry.gradient_norms()[query];
                flags.push(Flag { query, reason: FlagReason::Uncertain, gradient_norm });
            }
        }
        flags.sort_by_key(|entry| entry.query);
        Ok(())
    }

    /// Array of deviations per query. Null where there is no answer, or where those of the surface are
    /// unknown.
    pub fn known_per_query(&self, data: Vec<f64>, shape: &[usize]) -> Array {
        Array::new(data, shape).with_nulls(0, &self.lacks_deviations())
    }

    /// Returns for each query whether it has no answer, or the surface no deviation there.
    fn lacks_deviations(&self) -> Vec<bool> {
        let is_null = self.geometry.is_null();
        let Some(known) = self.geometry.deviations() else { return is_null.to_vec() };
        known.is_known.iter().zip(is_null).map(|(is_known, is_null)| !is_known || *is_null).collect()
    }

    /// Array of numbers per query, null where there is no answer.
    pub fn per_query(&self, data: Vec<f64>, shape: &[usize]) -> Array {
        Array::new(data, shape).with_nulls(0, self.geometry.is_null())
    }

    /// Returns which function serves each query.
    pub fn surface_models(&self) -> Vec<SurfaceModelUsed> {
        let used = |query| match self.geometry.served_by(query) {
            ServedBy::Signature => SurfaceModelUsed::Signature,
            ServedBy::Offset => SurfaceModelUsed::Offset,
            ServedBy::Regression => SurfaceModelUsed::Regression,
        };
        (0..self.geometry.n_queries()).map(used).collect()
    }

    /// Returns the diagnostics of the fit of this surface.
    pub fn diagnostics(&self, fits: &Fits) -> Diagnostics {
        let (fitted, m) = (fits.surface(), self.geometry.n_queries());
        let mut diagnostics = fitted.diagnostics(&Report::of_surface(&self.surface), m);
        diagnostics.warnings.extend(self.warnings());
        diagnostics.stencils = self.stencils;
        diagnostics
    }

    /// Arrays of deviations per query, null where there is no answer or no deviation of it.
    pub fn deviations(&self) -> Option<DeviationArrays> {
        let deviations = self.geometry.deviations()?;
        let (m, k) = (self.geometry.n_queries(), self.geometry.dimension() - 1);
        let is_null = self.lacks_deviations();
        let array = |data: &[f64], shape: &[usize]| Array::new(data.to_vec(), shape).with_nulls(0, &is_null);
        Some(DeviationArrays {
            normal: array(&deviations.normal, &[m]),
            principal: array(&deviations.principal, &[m, k]),
            mean: array(&deviations.mean, &[m]),
            gaussian: array(&deviations.gaussian, &[m]),
        })
    }

    /// Normals of both sheets at the queries that are at an edge, `[m, 2, d]`, null elsewhere. `None` unless
    /// they were asked for.
    pub fn edge_normals(&self) -> Option<Array> {
        if !self.request.has_edge_normals {
            return None;
        }
        let (m, d) = (self.geometry.n_queries(), self.geometry.dimension());
        let (mut normals, mut is_null) = (vec![0.0; m * 2 * d], vec![true; m]);
        for edge in self.geometry.edges() {
            normals[edge.query * 2 * d..][..2 * d].copy_from_slice(&edge.normals);
            is_null[edge.query] = false;
        }
        Some(Array::new(normals, &[m, 2, d]).with_nulls(0, &is_null))
    }

    /// Warnings about repairs, and counts of the flags of single queries.
    fn warnings(&self) -> Vec<Warning> {
        let (m, n) = (self.geometry.n_queries(), self.surface.cloud().n_points());
        let flagged = |reason| self.geometry.flags().iter().filter(|entry| entry.reason == reason).count();
        let n_offset = (0..m).filter(|&query| self.geometry.served_by(query) == ServedBy::Offset).count();
        let orientation = self.surface.orientation();
        let is_laplace = self.surface.signature().is_some_and(is_laplace);
        let too_rough = if is_laplace { LAPLACE_TOO_ROUGH } else { KERNEL_TOO_ROUGH };
        let disagrees = if self.request.checks_curvatures { DISAGREES } else { UNCERTAIN };
        let counted = [
            (n_offset, WarningCode::OffsetModelUsed, "served by the offset model"),
            (flagged(Reason::KernelTooRough), WarningCode::KernelTooRough, too_rough),
            (flagged(Reason::UnderResolved), WarningCode::DisagreesWithNeighbours, disagrees),
            (flagged(Reason::FarFromCloud), WarningCode::FarFromCloud, FAR),
            (flagged(Reason::Edge), WarningCode::SharpEdges, EDGES),
        ];
        let counted = counted.into_iter().filter(|(count, ..)| *count > 0);
        let mut warnings: Vec<Warning> = counted
            .map(|(count, code, what)| Warning { code, detail: format!("{what} (queries: {count} of {m})") })
            .collect();
        if self.request.orientation == Orientation::Gradient {
            return warnings;
        }
        if orientation.n_flipped > 0 {
            let detail = format!("the gradient pointed inward at {} of {n} points", orientation.n_flipped);
            warnings.push(Warning { code: WarningCode::OrientationRepaired, detail });
        }
        if orientation.is_open && !orientation.is_given {
            warnings.push(Warning { code: WarningCode::OpenCloud, detail: OPEN_CLOUD.to_owned() });
        }
        warnings
    }
}

fn is_laplace(signature: &Interpolant) -> bool {
    matches!(signature.solver.kernel().family(), Family::Laplace { .. })
}

const LAPLACE_TOO_ROUGH: &str = "curvatures see the cusp of the kernel at the points; raise epsilon until sqrt(epsilon)·length_scale is twice the spacing";
const KERNEL_TOO_ROUGH: &str = "curvatures see the cusp of the kernel at the points; take a smoother kernel";
const DISAGREES: &str = "curvatures are not confirmed by the points around them; see flags";
const UNCERTAIN: &str = "normals are uncertain by 17 degrees or more; see flags";
const FAR: &str = "farther from the cloud than three spacings";
const EDGES: &str = "at a sharp edge, where two sheets meet; include edge_normals for the normals of both";
const OPEN_CLOUD: &str =
    "the cloud has a rim, so outward is undefined; normals take the side of most gradients";
