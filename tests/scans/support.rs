//! What the service chooses for a cloud, and the geometry that follows.

use std::sync::Arc;

use gramian::numerics::cloud::Cloud;
use gramian::numerics::defaults::{Purpose, Scales, default_fit};
use gramian::numerics::geometry::{Geometry, GeometryRequest};
use gramian::numerics::interpolant::Interpolant;
use gramian::numerics::neighbours::Neighbours;
use gramian::numerics::noise::estimate_noise;
use gramian::numerics::observer::Unobserved;
use gramian::numerics::regularization::Regularization;
use gramian::numerics::solver::GramFactor;
use gramian::numerics::surface::Surface;

/// The factorization for a purpose with nothing chosen by the client.
pub fn factor(cloud: &Arc<Cloud>, purpose: Purpose) -> Arc<GramFactor> {
    let neighbours = Neighbours::of(cloud);
    let noise = || estimate_noise(cloud, &neighbours);
    let (kernel, alpha) = default_fit(&Scales::of(cloud, &neighbours), purpose, noise).unwrap();
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

/// Uniform and normal random numbers, the same for the same seed (SplitMix64, Steele et al. 2014).
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Box and Muller (1958).
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
