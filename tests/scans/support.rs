//! What the service chooses for a cloud, and the geometry that follows.

use std::sync::Arc;

use gramian::numerics::defaults::{Purpose, Scales, default_fit};
use gramian::numerics::function::interpolant::Interpolant;
use gramian::numerics::observer::Unobserved;
use gramian::numerics::points::cloud::Cloud;
use gramian::numerics::points::neighbours::Neighbours;
use gramian::numerics::points::noise::estimate_noise;
use gramian::numerics::solver::GramFactor;
use gramian::numerics::sums::regularization::Regularization;
use gramian::numerics::surface::Surface;
use gramian::numerics::surface::geometry::{Geometry, GeometryRequest};

pub use crate::random::Random;

/// The factorization for a purpose with nothing chosen by the client.
pub fn factor(cloud: &Arc<Cloud>, purpose: Purpose) -> Arc<GramFactor> {
    let neighbours = Neighbours::of(cloud);
    let noise = || estimate_noise(cloud, &neighbours, &Unobserved).unwrap();
    let (kernel, alpha) =
        default_fit(&Scales::of(cloud, &neighbours, &Unobserved).unwrap(), purpose, noise).unwrap();
    let alpha = Regularization::uniform(alpha).unwrap();
    Arc::new(GramFactor::factorize(cloud.clone(), kernel, alpha, &Unobserved).unwrap())
}

/// The geometry at the points of a cloud, by default.
pub fn geometry(cloud: &Arc<Cloud>, purpose: Purpose) -> (Surface, Geometry) {
    let signature = Interpolant::signature(factor(cloud, purpose), &Unobserved).unwrap();
    let surface = Surface::of(signature, None, &Unobserved).unwrap();
    let checks_curvatures = purpose == Purpose::Curvatures;
    let request = GeometryRequest { checks_curvatures, ..GeometryRequest::CURVATURES };
    let geometry = Geometry::of(&surface, cloud, &request, &Unobserved).unwrap();
    (surface, geometry)
}

impl Random {
    /// Standard normal (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

/// The value below which this share of a list lies.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}
