//! Clouds, fits and comparisons that the tests of conditioning share.

use std::f64::consts::PI;
use std::sync::Arc;

use gramian::numerics::error::NumericsError;
use gramian::numerics::function::interpolant::Interpolant;
use gramian::numerics::kernel::{Family, Kernel, WendlandSmoothness};
use gramian::numerics::observer::Unobserved;
use gramian::numerics::points::cloud::Cloud;
use gramian::numerics::solver::GramFactor;
use gramian::numerics::sums::jets::JetOrder;
use gramian::numerics::sums::regularization::Regularization;
use gramian::numerics::surface::Surface;
use gramian::numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};

pub use crate::random::Random;

pub const EPS: f64 = f64::EPSILON;

/// One kernel of every smoothness, from a kink to analytic.
pub const FAMILIES: [Family; 7] = [
    Family::Matern { order: 0 },
    Family::Matern { order: 1 },
    Family::Matern { order: 2 },
    Family::Wendland { smoothness: WendlandSmoothness::C4 },
    Family::Laplace { epsilon: 1.0 },
    Family::InverseMultiquadric,
    Family::Gauss,
];

pub fn kernel(family: Family, length_scale: f64) -> Kernel {
    Kernel::new(family, length_scale, 1.0).unwrap()
}

pub fn cloud(points: &[[f64; 3]]) -> Cloud {
    Cloud::new(points.concat(), 3).unwrap()
}

pub fn try_factorize(cloud: &Cloud, kernel: Kernel, alpha: f64) -> Result<Arc<GramFactor>, NumericsError> {
    let alpha = Regularization::uniform(alpha).unwrap();
    GramFactor::factorize(Arc::new(cloud.clone()), kernel, alpha, &Unobserved).map(Arc::new)
}

pub fn factorize(cloud: &Cloud, kernel: Kernel, alpha: f64) -> Arc<GramFactor> {
    try_factorize(cloud, kernel, alpha).unwrap()
}

pub fn try_fit(factor: &Arc<GramFactor>, values: &[f64]) -> Result<Interpolant, NumericsError> {
    Interpolant::fit(factor.clone(), values, &Unobserved)
}

pub fn fit(factor: &Arc<GramFactor>, values: &[f64]) -> Interpolant {
    try_fit(factor, values).unwrap()
}

/// The signature function of the factor's cloud with its geometry at queries, by itself: no offset model.
pub fn geometry(factor: &Arc<GramFactor>, queries: &Cloud) -> (Interpolant, Geometry) {
    let signature = Interpolant::signature(factor.clone(), &Unobserved).unwrap();
    let surface = Surface::of(signature.clone(), None, &Unobserved).unwrap();
    let request = GeometryRequest { model: SurfaceModel::Signature, ..GeometryRequest::CURVATURES };
    let geometry = Geometry::of(&surface, queries, &request, &Unobserved).unwrap();
    (signature, geometry)
}

/// Value, gradient and Laplacian of an interpolant at queries, each as one list.
pub fn jets(u: &Interpolant, queries: &Cloud) -> [Vec<f64>; 3] {
    let d = queries.dimension();
    let jets = u.at(queries, JetOrder::Hessian, &Unobserved).unwrap();
    let trace = |hessian: Vec<f64>| (0..d).map(|i| hessian[i * d + i]).sum();
    let m = queries.n_points();
    [
        jets.values(),
        (0..m).flat_map(|query| jets.gradient(query).to_vec()).collect(),
        (0..m).map(|query| trace(jets.hessian(query).to_vec())).collect(),
    ]
}

impl Random {
    /// A point of the unit sphere.
    pub fn on_sphere(&mut self) -> [f64; 3] {
        let (z, angle) = (2.0 * self.uniform() - 1.0, 2.0 * PI * self.uniform());
        let r = (1.0 - z * z).sqrt();
        [r * angle.cos(), r * angle.sin(), z]
    }

    /// Fisher–Yates.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, (self.uniform() * (i + 1) as f64) as usize);
        }
    }
}

/// n points on the unit sphere, z_i = 1 − (2i+1)/n, angle π(1+√5)i (errata.md, "Settled").
pub fn sphere(n: usize) -> Vec<[f64; 3]> {
    let golden = PI * (1.0 + 5f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64);
        [r * t.cos(), r * t.sin(), z]
    };
    (0..n).map(point).collect()
}

/// Points of the sphere moved inwards and outwards: off every cloud on it.
pub fn around_sphere(n: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    (0..n)
        .map(|_| {
            let radius = 0.9 + 0.2 * random.uniform();
            random.on_sphere().map(|x| radius * x)
        })
        .collect()
}

/// A smooth function of size 1, different in every coordinate.
pub fn wave(x: &[f64]) -> f64 {
    (0.3 + x.iter().enumerate().map(|(c, x)| (1.0 + 0.4 * c as f64) * x).sum::<f64>()).sin()
}

pub fn waves(cloud: &Cloud) -> Vec<f64> {
    cloud.points().map(wave).collect()
}

/// Largest magnitude; NaN if there is one, so that no comparison with a tolerance passes it.
pub fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |a, &b| if b.is_nan() || b.abs() > a { b.abs() } else { a })
}

/// Largest difference of two lists of one length.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Largest difference relative to the largest magnitude of the expected list.
pub fn relative_distance(found: &[f64], expected: &[f64]) -> f64 {
    distance(found, expected) / largest(expected)
}
