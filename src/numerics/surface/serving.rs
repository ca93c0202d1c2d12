//! The examination of a surface at queries: which function serves each of them, and what is wrong there.

use std::borrow::Cow;

use rayon::prelude::*;

use super::Surface;
use super::confirmation::Claim;
use super::curvature::principal_curvatures;
use super::degeneracy::{DegeneracyReason, is_far, is_weak};
use super::geometry::{Answer, GeometryRequest, Orientation, SurfaceModel};
use super::offset::rescue;
use crate::numerics::error::NumericsError;
use crate::numerics::machine::vector::norm;
use crate::numerics::observer::{Observer, Stage};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::neighbours::Neighbour;
use crate::numerics::points::patch::{LocalFit, n_quadric_neighbours};
use crate::numerics::sums::jets::{JetOrder, Jets};

/// Distance from the local fit, in spacings, up to which a query counts as on the surface: there the gradient must be normal
/// to it.
const ON_SURFACE_SPACINGS: f64 = 0.5;

/// A surface, queries, and the signature function there.
pub(crate) struct Examination<'a> {
    surface: &'a Surface,
    queries: &'a Cloud,
    request: &'a GeometryRequest,
    jets: Cow<'a, Jets>,
    are_points: bool,
}

/// A query with what surrounds it.
struct Site<'a> {
    x: &'a [f64],
    nearest: Neighbour,
    spacing: f64,
    fit: Option<Cow<'a, LocalFit>>,
}

impl<'a> Examination<'a> {
    /// Evaluates the signature function at the queries, to the order that the model needs.
    ///
    /// # Errors
    /// Those of [`crate::numerics::function::interpolant::Interpolant::at`].
    pub(crate) fn of(
        surface: &'a Surface,
        queries: &'a Cloud,
        request: &'a GeometryRequest,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let are_points = queries == surface.cloud();
        let order = match request.model {
            SurfaceModel::Offset => JetOrder::Value,
            SurfaceModel::Auto | SurfaceModel::Signature => JetOrder::HessianWithMagnitudes,
        };
        let jets = match surface.jets_at_points() {
            Some(jets) if are_points => Cow::Borrowed(jets),
            Some(_) | None => Cow::Owned(surface.signature().at(queries, order, observer)?),
        };
        Ok(Self { surface, queries, request, jets, are_points })
    }

    /// u at the queries, `[m]`.
    pub(crate) fn into_levels(self) -> Vec<f64> {
        self.jets.values()
    }

    /// Everything that is known at each query.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn answers(&self, observer: &dyn Observer) -> Result<Vec<Answer>, NumericsError> {
        observer.enter(Stage::Evaluate);
        let survey = |query| {
            observer.checkpoint()?;
            let site = self.site(query);
            let needs_offset = match self.request.model {
                SurfaceModel::Signature => false,
                SurfaceModel::Offset => true,
                SurfaceModel::Auto => self.vanishes(query, &site) || self.is_weak(query, &site),
            };
            Ok((site, needs_offset))
        };
        let m = self.queries.n_points();
        let sites: Vec<(Site<'_>, bool)> =
            (0..m).into_par_iter().map(survey).collect::<Result<_, NumericsError>>()?;
        let first_unaffordable =
            (0..m).filter(|&query| sites[query].1).nth(self.request.max_offsets).unwrap_or(m);
        let answer = |query: usize| {
            observer.checkpoint()?;
            let (site, needs_offset) = &sites[query];
            let mut answer = match (*needs_offset, query < first_unaffordable) {
                (true, true) => self.of_offset(query, site),
                (true, false) => self.without_offset(query, site, DegeneracyReason::UnaffordableRescue),
                (false, _) => self.of_signature(query, site),
            };
            answer.reason = answer.reason.or_else(|| self.flag(&answer, site));
            Ok(answer)
        };
        (0..m).into_par_iter().map(answer).collect()
    }

    fn site(&self, query: usize) -> Site<'a> {
        let (surface, cloud) = (self.surface, self.surface.cloud());
        let x = self.queries.point(query);
        if self.are_points {
            let nearest = Neighbour { point: query, squared_distance: 0.0 };
            let fit = surface.fit(query).map(Cow::Borrowed);
            return Site { x, nearest, spacing: surface.spacing(query), fit };
        }
        // Normals are held against a local fit to see whether they are oblique; that of the nearest point is good enough.
        let count = if self.request.checks_curvatures { n_quadric_neighbours(cloud.dimension()) } else { 1 };
        let found = surface.neighbours().nearest_positions(cloud, x, count);
        let nearest = found.first().copied().unwrap_or(Neighbour { point: 0, squared_distance: 0.0 });
        let fit = match self.request.checks_curvatures {
            true => LocalFit::of(cloud, x, &found),
            false => surface.fit(nearest.point).map(|fit| fit.seen_from(cloud.point(nearest.point), x)),
        };
        let fit = fit.map(Cow::Owned);
        Site { x, nearest, spacing: surface.spacing(nearest.point), fit }
    }

    fn vanishes(&self, query: usize, site: &Site<'_>) -> bool {
        let fit = site.fit.as_deref().filter(|fit| fit.height.abs() <= ON_SURFACE_SPACINGS * site.spacing);
        let reach = ON_SURFACE_SPACINGS * site.spacing;
        let is_on_thread = site.fit.is_none()
            && site.nearest.squared_distance <= reach * reach
            && self.surface.is_thread(site.x);
        is_on_thread || self.surface.vanishes(&self.jets, query, site.spacing, fit)
    }

    /// Whether the offset model is preferred for curvatures: the gradient is weak, and the neighbours are free of noise, which
    /// the offset model interpolates.
    fn is_weak(&self, query: usize, site: &Site<'_>) -> bool {
        self.request.checks_curvatures
            && site.fit.as_ref().is_some_and(|fit| fit.is_smooth())
            && is_weak(&self.jets, query, site.spacing)
    }

    fn of_signature(&self, query: usize, site: &Site<'_>) -> Answer {
        if self.request.model == SurfaceModel::Signature && self.vanishes(query, site) {
            return self.null(query, DegeneracyReason::VanishingGradient);
        }
        let gradient = self.jets.gradient(query).to_vec();
        let sign = match self.request.orientation {
            Orientation::Gradient => 1.0,
            Orientation::Outward => self.surface.outward_sign(site.x, &gradient),
        };
        Answer { gradient, hessian: self.jets.hessian(query), sign, is_offset: false, reason: None }
    }

    /// The offset model, whose gradient points outward.
    fn of_offset(&self, query: usize, site: &Site<'_>) -> Answer {
        let Some(jet) = rescue(self.surface, site.x) else {
            return self.without_offset(query, site, DegeneracyReason::VanishingGradient);
        };
        let sign = match self.request.orientation {
            Orientation::Gradient => self.surface.gradient_side(site.x, &jet.gradient),
            Orientation::Outward => 1.0,
        };
        Answer { gradient: jet.gradient, hessian: jet.hessian, sign, is_offset: true, reason: None }
    }

    /// What there is without the offset model: a weak gradient is better than nothing.
    fn without_offset(&self, query: usize, site: &Site<'_>, reason: DegeneracyReason) -> Answer {
        match self.request.model == SurfaceModel::Auto && !self.vanishes(query, site) {
            true => self.of_signature(query, site),
            false => self.null(query, reason),
        }
    }

    fn null(&self, query: usize, reason: DegeneracyReason) -> Answer {
        let d = self.queries.dimension();
        let (gradient, hessian) = match self.request.model {
            SurfaceModel::Offset => (vec![0.0; d], vec![0.0; d * d]),
            SurfaceModel::Auto | SurfaceModel::Signature => {
                (self.jets.gradient(query).to_vec(), self.jets.hessian(query))
            }
        };
        let is_offset = self.request.model == SurfaceModel::Offset;
        Answer { gradient, hessian, sign: 1.0, is_offset, reason: Some(reason) }
    }

    /// What makes an answer doubtful.
    fn flag(&self, answer: &Answer, site: &Site<'_>) -> Option<DegeneracyReason> {
        if is_far(site.nearest.squared_distance, site.spacing) {
            return Some(DegeneracyReason::FarFromCloud);
        }
        if !self.request.checks_curvatures {
            return None;
        }
        if !answer.is_offset && self.surface.is_too_rough() {
            return Some(DegeneracyReason::KernelTooRough);
        }
        (!self.is_resolved(answer, site)).then_some(DegeneracyReason::UnderResolved)
    }

    fn is_resolved(&self, answer: &Answer, site: &Site<'_>) -> bool {
        let gradient_norm = norm(&answer.gradient);
        let normal: Vec<f64> = answer.gradient.iter().map(|g| answer.sign * g / gradient_norm).collect();
        let (curvatures, _) = principal_curvatures(&answer.gradient, &answer.hessian, answer.sign);
        let claim = Claim {
            x: site.x,
            spacing: site.spacing,
            curvatures: &curvatures,
            normal: &normal,
            gradient_norm,
            fit: site.fit.as_deref(),
            is_offset: answer.is_offset,
            may_use_patch: self.queries.n_points() <= self.request.max_offsets,
        };
        claim.is_confirmed(self.surface)
    }
}
