//! Surfaces and geometry of test clouds, by the library.

use gramian_numerics::kernel::Family;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};

use super::clouds::OrientedCloud;
use super::common::fits;

pub fn surface(points: &[f64], dimension: usize, family: Family, length_scale: f64, alpha: f64) -> Surface {
    let cloud = Cloud::new(points.to_vec(), dimension).unwrap();
    fits::surface(&fits::factorize(&cloud, fits::kernel(family, length_scale), alpha))
}

pub fn surface_of(cloud: &OrientedCloud, family: Family, length_scale: f64) -> Surface {
    surface(&cloud.points, cloud.dimension, family, length_scale, 1e-10)
}

/// The geometry at the points themselves.
pub fn geometry(surface: &Surface, request: &GeometryRequest) -> Geometry {
    Geometry::of(surface, surface.cloud(), request, &Unobserved).unwrap()
}

/// Cosines between the found and the true normals, `None` where the answer is null.
pub fn cosines(geometry: &Geometry, truth: &[Vec<f64>]) -> Vec<Option<f64>> {
    let cosine = |(query, normal): (usize, &Vec<f64>)| {
        let found = geometry.normal(query);
        (!geometry.is_null()[query]).then(|| found.iter().zip(normal).map(|(a, b)| a * b).sum())
    };
    truth.iter().enumerate().map(cosine).collect()
}

/// Counts the answers that point inward.
pub fn n_wrong(cosines: &[Option<f64>]) -> usize {
    cosines.iter().flatten().filter(|&&cosine| cosine <= 0.0).count()
}
