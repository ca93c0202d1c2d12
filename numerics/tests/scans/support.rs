//! Fits and geometry with the service's default parameters.

use std::sync::Arc;

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::Solver;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};

use crate::common::fits::{default_kernel_and_alpha, factorize, surface};

/// The factorization for a purpose, with nothing chosen by the client.
pub fn factor(cloud: &Cloud, purpose: Purpose) -> Arc<Solver> {
    let (kernel, alpha) = default_kernel_and_alpha(cloud, purpose);
    factorize(cloud, kernel, alpha)
}

/// The geometry at the points of a cloud, with default parameters.
pub fn geometry(cloud: &Cloud, purpose: Purpose) -> Geometry {
    let checks_curvatures = purpose == Purpose::Curvatures;
    let request = GeometryRequest { checks_curvatures, ..GeometryRequest::CURVATURES };
    Geometry::of(&surface(&factor(cloud, purpose)), cloud, &request, &Unobserved).unwrap()
}

/// The quantile of a list below which the given share lies.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}
