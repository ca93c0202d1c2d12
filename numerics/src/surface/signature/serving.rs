//! The choice of the function that serves each query of a surface, and of the flags of its answer.

use std::borrow::Cow;

use rayon::prelude::*;

use super::SignatureSurface;
use super::confirmation::CurvatureCandidate;
use super::deviations::deviations;
use super::doubt::{is_doubtful, uncertain};
use super::offset::{OffsetJet, offset_jet_at};
use crate::error::{NumericsError, Result};
use crate::machine::small::Small;
use crate::machine::vector::norm;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::{LocalQuadric, LocalQuadrics};
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::neighbours::Neighbour;
use crate::points::quadric::n_quadric_neighbours;
use crate::regression::sums::jets::{JetOrder, Jets};
use crate::surface::curvature::principal_curvatures;
use crate::surface::flags::{FlagReason, is_far, is_weak, lacks_normal, roundings};
use crate::surface::request::{GeometryRequest, Orientation, SurfaceModel};
use crate::surface::served::{GeometryArrays, ServedBy, Verdict};

/// Distance from the local quadric, in spacings, up to which a query counts as on the surface. There the
/// gradient must be normal to the quadric.
const ON_SURFACE_SPACINGS: f64 = 0.5;

/// Computes gradient, Hessian, sign and flag at each query, with deviations if they are requested.
///
/// # Errors
/// Returns the errors of [`crate::regression::function::interpolant::Interpolant::at`].
pub(crate) fn serve(
    surface: &SignatureSurface,
    queries: &Cloud,
    request: &GeometryRequest,
    observer: &dyn Observer,
) -> Result<GeometryArrays> {
    let order = match request.model {
        SurfaceModel::Offset => JetOrder::Value,
        SurfaceModel::Auto | SurfaceModel::Signature | SurfaceModel::Regression => JetOrder::Hessian,
    };
    let are_points = queries == surface.cloud();
    let jets = match surface.signature.jets() {
        Some(jets) if are_points => Cow::Borrowed(jets),
        Some(_) | None => Cow::Owned(surface.signature().at(queries, order, observer)?),
    };
    let is_rounding = match &jets {
        Cow::Borrowed(_) => {
            (0..queries.n_points()).map(|point| surface.signature.is_gradient_rounding_error(point)).collect()
        }
        Cow::Owned(jets) if order == JetOrder::Hessian => {
            roundings(surface.signature(), queries, jets, observer)?
        }
        Cow::Owned(_) => Vec::new(),
    };
    observer.enter(Stage::Evaluate);
    let surroundings = Surroundings::of(surface, queries, are_points, request.checks_curvatures, observer)?;
    let service = Service { surface, queries, request, jets, is_rounding, surroundings };
    let mut served = service.serve(observer)?;
    if request.has_deviations {
        served.deviations = Some(deviations(surface, queries, &served, observer)?);
    }
    Ok(served)
}

/// Points and quadrics around the queries.
enum Surroundings {
    /// The queries are the points of the cloud, so their neighbourhoods are cached.
    OfPoints,
    /// Nearest points of the queries, with quadrics of their own where curvatures are checked against them.
    OfQueries { around: Neighbourhoods, quadrics: Option<LocalQuadrics> },
}

impl Surroundings {
    fn of(
        surface: &SignatureSurface,
        queries: &Cloud,
        are_points: bool,
        checks_curvatures: bool,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (cloud, neighbours) = (surface.cloud(), surface.sampling.neighbours());
        if are_points {
            return Ok(Self::OfPoints);
        }
        if checks_curvatures {
            let count = n_quadric_neighbours(cloud.dimension());
            let around = Neighbourhoods::of(neighbours, queries, count, observer)?;
            let quadrics = Some(LocalQuadrics::of(cloud, &around, queries, observer)?);
            return Ok(Self::OfQueries { around, quadrics });
        }
        let around = Neighbourhoods::of(neighbours, queries, 1, observer)?;
        Ok(Self::OfQueries { around, quadrics: None })
    }
}

/// A query with what surrounds it.
#[derive(Clone, Copy)]
struct Site<'a> {
    query: usize,
    x: &'a [f64],
    nearest: Neighbour,
    spacing: f64,
    quadric: Option<LocalQuadric<'a>>,
}

/// A surface, queries, and the signature function there.
struct Service<'a> {
    surface: &'a SignatureSurface,
    queries: &'a Cloud,
    request: &'a GeometryRequest,
    jets: Cow<'a, Jets>,
    /// True where ∇u is rounding (T1), `[m]`. Empty where the jets have no gradients.
    is_rounding: Vec<bool>,
    surroundings: Surroundings,
}

/// Room for the gradient and the Hessian of a query, with a buffer for its neighbours.
struct Slot<'a> {
    gradient: &'a mut [f64],
    hessian: &'a mut [f64],
    found: &'a mut Vec<Neighbour>,
}

impl Slot<'_> {
    fn take(&mut self, jet: &OffsetJet) {
        self.gradient.copy_from_slice(&jet.gradient);
        self.hessian.copy_from_slice(&jet.hessian);
    }
}

impl Service<'_> {
    fn serve(&self, observer: &dyn Observer) -> Result<GeometryArrays> {
        let (m, d) = (self.queries.n_points(), self.queries.dimension());
        let look = |query| {
            observer.checkpoint()?;
            Ok(self.needs_offset(&self.site(query)))
        };
        let needs_offset: Vec<bool> = (0..m).into_par_iter().map(look).collect::<Result<_>>()?;
        let first_unaffordable =
            (0..m).filter(|&query| needs_offset[query]).nth(self.request.max_offsets).unwrap_or(m);
        let (mut gradients, mut hessians) = (vec![0.0; m * d], vec![0.0; m * d * d]);
        let mut verdicts = vec![Verdict { sign: 1.0, by: ServedBy::Signature, reason: None }; m];
        let slots = gradients.par_chunks_exact_mut(d).zip(hessians.par_chunks_exact_mut(d * d));
        slots.zip(&mut verdicts).enumerate().try_for_each_init(
            Vec::new,
            |found, (query, ((gradient, hessian), verdict))| {
                observer.checkpoint()?;
                let (site, mut slot) = (self.site(query), Slot { gradient, hessian, found });
                *verdict = match (needs_offset[query], query < first_unaffordable) {
                    (true, true) => self.by_offset(&site, &mut slot),
                    (true, false) => self.without_offset(&site, FlagReason::UnaffordableRescue, &mut slot),
                    (false, _) => self.by_signature(&site, &mut slot),
                };
                verdict.reason = verdict.reason.or_else(|| self.flag(*verdict, &slot, &site));
                Ok::<_, NumericsError>(())
            },
        )?;
        let levels = self.jets.values();
        let (deviations, edges) = (None, Vec::new());
        let mut served =
            GeometryArrays { dimension: d, gradients, hessians, verdicts, levels, deviations, edges };
        if !self.request.checks_curvatures {
            self.flag_normals(&mut served, observer)?;
        }
        Ok(served)
    }

    /// Flags the normals of which too little is known.
    fn flag_normals(&self, served: &mut GeometryArrays, observer: &dyn Observer) -> Result<()> {
        let quadric = |query: usize| self.site(query).quadric;
        let is_doubtful = |&query: &usize| {
            served.verdict(query).reason.is_none() && is_doubtful(served.gradient(query), quadric(query))
        };
        let doubtful: Vec<usize> = (0..self.queries.n_points()).filter(is_doubtful).collect();
        for query in uncertain(self.surface, self.queries, &doubtful, served, quadric, observer)? {
            served.verdicts[query].reason = Some(FlagReason::UnderResolved);
        }
        Ok(())
    }

    fn site(&self, query: usize) -> Site<'_> {
        let (surface, x) = (self.surface, self.queries.point(query));
        let (nearest, quadric) = match &self.surroundings {
            Surroundings::OfPoints => {
                (Neighbour { point: query, squared_distance: 0.0 }, surface.quadrics.at(query))
            }
            Surroundings::OfQueries { around, quadrics: Some(quadrics) } => {
                (around.nearest(query), quadrics.at(query))
            }
            // The quadric only shows whether a normal is oblique, so that of the nearest point is good
            // enough.
            Surroundings::OfQueries { around, quadrics: None } => {
                let nearest = around.nearest(query);
                let quadric = surface.quadrics.at(nearest.point);
                (nearest, quadric.map(|quadric| quadric.seen_from(surface.cloud().point(nearest.point), x)))
            }
        };
        Site { query, x, nearest, spacing: surface.sampling.spacing(nearest.point), quadric }
    }

    fn needs_offset(&self, site: &Site<'_>) -> bool {
        match self.request.model {
            SurfaceModel::Signature | SurfaceModel::Regression => false,
            SurfaceModel::Offset => true,
            SurfaceModel::Auto => self.vanishes(site) || self.is_weak(site),
        }
    }

    fn vanishes(&self, site: &Site<'_>) -> bool {
        let reach = ON_SURFACE_SPACINGS * site.spacing;
        let quadric = site.quadric.filter(|quadric| quadric.height.abs() <= reach);
        let is_on_thread = site.quadric.is_none()
            && site.nearest.squared_distance <= reach * reach
            && self.surface.is_thread(site.x);
        is_on_thread
            || self.is_rounding[site.query]
            || lacks_normal(&self.jets, site.query, site.spacing, quadric)
    }

    /// Returns whether the offset model is preferred for curvatures: the gradient is weak, and the neighbours
    /// are free of noise. The offset model would interpolate noise.
    fn is_weak(&self, site: &Site<'_>) -> bool {
        self.request.checks_curvatures
            && site.quadric.is_some_and(|quadric| quadric.is_smooth())
            && is_weak(&self.jets, site.query, site.spacing)
    }

    fn by_signature(&self, site: &Site<'_>, slot: &mut Slot<'_>) -> Verdict {
        if self.request.model == SurfaceModel::Signature && self.vanishes(site) {
            return self.null(site, FlagReason::VanishingGradient, slot);
        }
        slot.gradient.copy_from_slice(self.jets.gradient(site.query));
        slot.hessian.copy_from_slice(&self.jets.hessian(site.query));
        let sign = match self.request.orientation {
            Orientation::Gradient => 1.0,
            Orientation::Outward => self.surface.outward_sign(site.x, slot.gradient, slot.found),
        };
        Verdict { sign, by: ServedBy::Signature, reason: None }
    }

    /// Serves a query by the offset model, whose gradient points outward.
    fn by_offset(&self, site: &Site<'_>, slot: &mut Slot<'_>) -> Verdict {
        let Some(jet) = offset_jet_at(self.surface, site.x) else {
            return self.without_offset(site, FlagReason::VanishingGradient, slot);
        };
        slot.take(&jet);
        let sign = match self.request.orientation {
            Orientation::Gradient => self.surface.gradient_side(site.x, slot.gradient, slot.found),
            Orientation::Outward => 1.0,
        };
        Verdict { sign, by: ServedBy::Offset, reason: None }
    }

    /// Serves a query without the offset model. A weak gradient is better than nothing.
    fn without_offset(&self, site: &Site<'_>, reason: FlagReason, slot: &mut Slot<'_>) -> Verdict {
        if self.request.model == SurfaceModel::Auto && !self.vanishes(site) {
            self.by_signature(site, slot)
        } else {
            self.null(site, reason, slot)
        }
    }

    fn null(&self, site: &Site<'_>, reason: FlagReason, slot: &mut Slot<'_>) -> Verdict {
        let by = match self.request.model {
            SurfaceModel::Offset => ServedBy::Offset,
            SurfaceModel::Auto | SurfaceModel::Signature | SurfaceModel::Regression => {
                slot.gradient.copy_from_slice(self.jets.gradient(site.query));
                slot.hessian.copy_from_slice(&self.jets.hessian(site.query));
                ServedBy::Signature
            }
        };
        Verdict { sign: 1.0, by, reason: Some(reason) }
    }

    /// Returns the reason why an answer is doubtful.
    fn flag(&self, verdict: Verdict, slot: &Slot<'_>, site: &Site<'_>) -> Option<FlagReason> {
        if is_far(site.nearest.squared_distance, site.spacing) {
            return Some(FlagReason::FarFromCloud);
        }
        let has_side = self.request.orientation == Orientation::Outward;
        if has_side && self.surface.oriented.is_ambiguous[site.nearest.point] {
            return Some(FlagReason::AmbiguousSide);
        }
        if !self.request.checks_curvatures {
            return None;
        }
        if verdict.by == ServedBy::Signature && self.surface.is_too_rough {
            return Some(FlagReason::KernelTooRough);
        }
        (!self.is_resolved(verdict, slot, site)).then_some(FlagReason::UnderResolved)
    }

    fn is_resolved(&self, verdict: Verdict, slot: &Slot<'_>, site: &Site<'_>) -> bool {
        let gradient_norm = norm(slot.gradient);
        let normal: Small = slot.gradient.iter().map(|g| verdict.sign * g / gradient_norm).collect();
        let (curvatures, _) = principal_curvatures(slot.gradient, slot.hessian, verdict.sign);
        let unconfirmed = CurvatureCandidate {
            x: site.x,
            spacing: site.spacing,
            curvatures: &curvatures,
            normal: &normal,
            gradient_norm,
            quadric: site.quadric,
            is_offset: verdict.by == ServedBy::Offset,
            may_use_patch: self.queries.n_points() <= self.request.max_offsets,
        };
        unconfirmed.is_confirmed_by(self.surface)
    }
}
