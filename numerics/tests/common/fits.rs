//! Fits by the library's public API in one call each. A refusal panics and so fails the test.

#![allow(dead_code, reason = "each test takes what it needs")]

use std::sync::Arc;

use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::defaults::{Purpose, default_fit};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::noise::estimate_noise;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};

/// A kernel of variance 1.
pub fn kernel(family: Family, length_scale: f64) -> Kernel {
    Kernel::new(family, length_scale, 1.0).unwrap()
}

/// The kernel and the α that the service chooses for a cloud when the request names neither.
pub fn default_kernel_and_alpha(cloud: &Cloud, purpose: Purpose) -> (Kernel, f64) {
    let sampling = Sampling::of(cloud, &Unobserved).unwrap();
    let noise = || estimate_noise(cloud, &sampling, &Unobserved).unwrap();
    default_fit(sampling.scales(), purpose, noise).unwrap()
}

/// Factorizes `K + αI` of a cloud.
pub fn factorize(cloud: &Cloud, kernel: Kernel, alpha: f64) -> Arc<Solver> {
    let alpha = Regularization::uniform(alpha).unwrap();
    Arc::new(
        System::new(Arc::new(cloud.clone()), kernel, alpha)
            .and_then(|system| Solver::dense(system, &Unobserved))
            .unwrap(),
    )
}

/// Fits values at the factor's points, for tests that expect a refusal.
pub fn try_fit(factor: &Arc<Solver>, values: &[f64]) -> Result<Interpolant, NumericsError> {
    Interpolant::fit(factor.clone(), values, &Unobserved)
}

/// Fits values at the factor's points.
pub fn fit(factor: &Arc<Solver>, values: &[f64]) -> Interpolant {
    try_fit(factor, values).unwrap()
}

/// The signature function of the factor's cloud: the fit of the constant 1.
pub fn signature(factor: &Arc<Solver>) -> Interpolant {
    Interpolant::signature(factor.clone(), &Unobserved).unwrap()
}

/// The surface through the factor's cloud, which has no normals of its own.
pub fn surface(factor: &Arc<Solver>) -> Surface {
    Surface::of(signature(factor), None, &Unobserved).unwrap()
}

/// Outward normals and curvatures at queries, by the signature function alone, without the offset model.
pub fn geometry(factor: &Arc<Solver>, queries: &Cloud) -> Geometry {
    let request = GeometryRequest { model: SurfaceModel::Signature, ..GeometryRequest::CURVATURES };
    Geometry::of(&surface(factor), queries, &request, &Unobserved).unwrap()
}
