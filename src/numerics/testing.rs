//! Clouds for the unit tests of this layer.

use crate::numerics::points::cloud::Cloud;

/// n points on the unit sphere, z_i = 1 − (2i+1)/n, angle π(1+√5)i (errata.md, "Settled").
pub(crate) fn fibonacci_sphere(n: usize) -> Cloud {
    let golden = std::f64::consts::PI * (1.0 + 5f64.sqrt());
    let coordinates = (0..n)
        .flat_map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64);
            [r * t.cos(), r * t.sin(), z]
        })
        .collect();
    Cloud::new(coordinates, 3).unwrap()
}

/// n equidistant points on the unit circle.
pub(crate) fn circle(n: usize) -> Cloud {
    let coordinates = (0..n)
        .flat_map(|i| {
            let t = 2.0 * std::f64::consts::PI * i as f64 / n as f64;
            [t.cos(), t.sin()]
        })
        .collect();
    Cloud::new(coordinates, 2).unwrap()
}
