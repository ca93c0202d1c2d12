//! Standard deviations of operators applied to values.
//!
//! Two things are uncertain: the function, whose posterior has the covariance of all derivatives, and the
//! surface under it. Let δν and δH be the errors of the normal and of `H = tr Dν`, and P the projection onto
//! the tangent plane. Then the operators are off by
//!
//! - `−(2PD²uν + HP∇u)·δν − ∂_νu δH` for `Δ_M u`,
//! - `−∂_νu δν − (∇u·δν)ν` for `∇_M u`.
//!
//! Deviations of the geometry, where it has them, add in squares to those of the function.

use super::{Operator, regular};
use crate::error::{NumericsError, Result};
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::function::COLUMNS_AT_ONCE;
use crate::regression::function::functionals::{JetFunctional, ScaledFit, deviations, has_variance};
use crate::regression::function::interpolant::Interpolant;
use crate::regression::sums::jets::Jets;
use crate::surface::geometry::Geometry;

impl Operator {
    /// Computes standard deviations of the operator on a function, `[m, d]` or `[m]`, 0 at null queries.
    ///
    /// Kernel and noise are `factor` times those of the solver.
    ///
    /// # Errors
    /// - [`NumericsError::DerivativesVary`] where the process has no such derivatives.
    /// - [`NumericsError::NotPositiveDefinite`] without a Cholesky factor.
    /// - Errors of [`Interpolant::at`].
    pub fn deviations(
        self,
        geometry: &Geometry,
        interpolant: &Interpolant,
        factor: f64,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        let mut total =
            AppliedOperator { geometry, interpolant, factor, queries }.of_function(self, observer)?;
        if geometry.deviations().is_some() {
            self.add_surface(geometry, &interpolant.at(queries, self.order(), observer)?, &mut total);
        }
        Ok(total)
    }

    /// Adds the deviations of the surface, if known, to deviations of the operator on a function. The
    /// function is known by its jets.
    pub(super) fn add_surface(self, geometry: &Geometry, jets: &Jets, total: &mut [f64]) {
        match self {
            Self::SurfaceGradient => add_surface_to_gradient(geometry, jets, total),
            Self::LaplaceBeltrami => add_surface_to_laplace_beltrami(geometry, jets, total),
        }
    }
}

/// Adds the deviations of the surface, if known, to deviations `[m]` of `Δ_M u`. The function u is known by
/// its jets.
fn add_surface_to_laplace_beltrami(geometry: &Geometry, jets: &Jets, total: &mut [f64]) {
    let Some(known) = geometry.deviations() else { return };
    for query in regular(geometry) {
        let (normal, gradient, hessian) = (geometry.normal(query), jets.gradient(query), jets.hessian(query));
        let trace = geometry.trace_of_shape_operator(query);
        let d = normal.len();
        let along = dot(gradient, normal);
        let turned: Vec<f64> =
            (0..d).map(|c| 2.0 * dot(&hessian[c * d..][..d], normal) + trace * gradient[c]).collect();
        let normal_part = dot(&turned, normal);
        let tangential: Vec<f64> = turned.iter().zip(normal).map(|(t, n)| t - normal_part * n).collect();
        let of_normal = known.normal[query] * norm(&tangential);
        let of_trace = (d - 1) as f64 * known.mean[query] * along;
        total[query] = norm(&[total[query], of_normal, of_trace]);
    }
}

/// Adds the deviations of the surface, if known, to deviations `[m, d]` of the components of `∇_M u`. The
/// function u is known by its jets.
fn add_surface_to_gradient(geometry: &Geometry, jets: &Jets, total: &mut [f64]) {
    let Some(known) = geometry.deviations() else { return };
    let d = jets.dimension();
    for query in regular(geometry) {
        let (normal, gradient) = (geometry.normal(query), jets.gradient(query));
        let along = dot(gradient, normal);
        let tangential: Vec<f64> = gradient.iter().zip(normal).map(|(g, n)| g - along * n).collect();
        for (c, slot) in total[query * d..][..d].iter_mut().enumerate() {
            let across = along * (1.0 - normal[c] * normal[c]).max(0.0).sqrt();
            let tilted = norm(&tangential) * normal[c];
            *slot = norm(&[*slot, known.normal[query] * across, known.normal[query] * tilted]);
        }
    }
}

/// An operator applied to a function. Kernel and noise are `factor` times those of the solver.
pub(super) struct AppliedOperator<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) interpolant: &'a Interpolant,
    pub(super) factor: f64,
    pub(super) queries: &'a Cloud,
}

impl AppliedOperator<'_> {
    /// Computes the deviations that come from the function alone: `[m]` or `[m, d]`.
    fn of_function(&self, operator: Operator, observer: &dyn Observer) -> Result<Vec<f64>> {
        let Interpolant { solver, solution } = self.interpolant;
        let fit = ScaledFit { solver, solution, factor: self.factor };
        let order = operator.order().degree();
        if !has_variance(solver.kernel(), order) {
            return Err(NumericsError::DerivativesVary { order });
        }
        let width = operator.n_components(self.queries.dimension());
        let all: Vec<usize> = regular(self.geometry).collect();
        let mut total = vec![0.0; self.queries.n_points() * width];
        for some in all.chunks((COLUMNS_AT_ONCE / width).max(1)) {
            let functionals: Vec<JetFunctional> =
                some.iter().flat_map(|&query| functionals(self.geometry, operator, query)).collect();
            let found = deviations(fit, self.queries, &functionals, observer)?;
            for (query, found) in some.iter().zip(found.found.chunks_exact(width)) {
                total[query * width..][..width].copy_from_slice(found);
            }
        }
        Ok(total)
    }
}

/// Returns the operator at a query as functionals of the jet, one for each component.
pub(super) fn functionals(geometry: &Geometry, operator: Operator, query: usize) -> Vec<JetFunctional> {
    let normal = geometry.normal(query);
    let d = normal.len();
    let projection = |a: usize, b: usize| f64::from(u8::from(a == b)) - normal[a] * normal[b];
    match operator {
        Operator::SurfaceGradient => (0..d)
            .map(|c| {
                let row: Vec<f64> = (0..d).map(|b| projection(c, b)).collect();
                JetFunctional::derivative(query, &row)
            })
            .collect(),
        Operator::LaplaceBeltrami => {
            let trace = geometry.trace_of_shape_operator(query);
            let along: Vec<f64> = normal.iter().map(|n| -trace * n).collect();
            let of_hessian = (0..d * d).map(|at| projection(at / d, at % d)).collect();
            vec![JetFunctional { of_hessian, ..JetFunctional::derivative(query, &along) }]
        }
    }
}
