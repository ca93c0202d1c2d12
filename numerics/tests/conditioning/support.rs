//! Clouds and comparisons shared by the tests of conditioning.

use gramian_numerics::kernel::{Family, WendlandSmoothness};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::sums::jets::JetOrder;

pub use crate::common::clouds::{
    cloud, fibonacci_sphere, random_cube, random_sphere, rows, stretched, wave, waves,
};
pub use crate::common::fits::{factorize, fit, geometry, kernel, signature, try_fit};
pub use crate::common::random::Random;

pub const EPS: f64 = f64::EPSILON;

/// Kernels of every smoothness, from a kink to analytic.
pub const FAMILIES: [Family; 7] = [
    Family::Matern { order: 0 },
    Family::Matern { order: 1 },
    Family::Matern { order: 2 },
    Family::Wendland { smoothness: WendlandSmoothness::C4 },
    Family::Laplace { epsilon: 1.0 },
    Family::InverseMultiquadric,
    Family::Gauss,
];

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
    /// Shuffles by Fisher–Yates.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, (self.uniform() * (i + 1) as f64) as usize);
        }
    }
}

/// Random points at radii from 0.9 to 1.1, off every cloud on the unit sphere.
pub fn around_sphere(n: usize, seed: u64) -> Cloud {
    let mut random = Random(seed);
    let mut point = || {
        let radius = 0.9 + 0.2 * random.uniform();
        random.on_sphere().map(|x| radius * x)
    };
    Cloud::new((0..n).flat_map(|_| point()).collect(), 3).unwrap()
}

/// Largest magnitude, or NaN if any entry is NaN, so that no comparison with a tolerance passes it.
pub fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |a, &b| if b.is_nan() || b.abs() > a { b.abs() } else { a })
}

/// Largest difference of two lists of equal length.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Largest difference relative to the largest magnitude of the expected list.
pub fn relative_distance(found: &[f64], expected: &[f64]) -> f64 {
    distance(found, expected) / largest(expected)
}
