//! Default kernels, derived from the cloud alone, for clients that choose none.
//!
//! Everything scales with the cloud: millimetres and kilometres get the same geometry.

use super::{Family, Kernel};
use crate::error::Result;
use crate::points::sampling::Scales;

/// Purpose of a fit, which decides its default kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Interpolation or regression of values.
    Values,
    /// Normals of a surface.
    Normals,
    /// Curvatures and operators of a surface, which are sensitive to the kernel's cusp at the points of the
    /// cloud.
    Curvatures,
    /// Level sets of the signature function, which must have no sheets beside the surface.
    LevelSets,
}

/// Default α for values, where none is given.
pub const DEFAULT_ALPHA: f64 = 1e-10;

/// Least α of the rules for surfaces.
///
/// On exact data, its error is far below the error of sampling. The noise estimate may fail on coarse clouds.
/// There, this α keeps the fit from following the noise (docs/defaults.md).
const SURFACE_ALPHA: f64 = 1e-3;

/// Factor of the law for α on noisy surfaces: α = 5 (σ/h₄)^1.5.
///
/// It lies between the linear law, which is best for smooth surfaces, and the quadratic law α = (σ|∇u|)²
/// (docs/defaults.md).
const NOISE_FACTOR: f64 = 5.0;
const NOISE_EXPONENT: f64 = 1.5;

/// Kernel rule for a surface: ℓ = max(`extents` · extent, `spacings` · h₄), and √ε ℓ = `smoothing` · h₄.
struct SurfaceRule {
    extents: f64,
    spacings: f64,
    smoothing: f64,
}

/// Sharp enough for the edges of scans (docs/defaults.md).
const NORMALS: SurfaceRule = SurfaceRule { extents: 0.45, spacings: 4.0, smoothing: 0.4 };

/// Smooth enough for second derivatives at the points, which are sensitive to the kernel's cusp.
const CURVATURES: SurfaceRule = SurfaceRule { extents: 0.9, spacings: 8.0, smoothing: 3.0 };

/// Short enough for a single sheet: it makes the bunny one closed part (`tests/meshes`). In a prototype
/// spurious sheets began at 15 spacings.
const LEVEL_SETS: SurfaceRule = SurfaceRule { extents: 0.0, spacings: 5.0, smoothing: 0.4 };

/// Returns the default kernel and α for a purpose: Matérn 5/2 for values, regularised Laplace for surfaces.
/// `noise` is called for surfaces only. It returns the standard deviation of the points across the surface,
/// unit L.
///
/// # Errors
/// `NumericsError::InvalidKernelParameter` if the cloud is too small or large for any length scale.
pub fn default_fit(scales: &Scales, purpose: Purpose, noise: impl FnOnce() -> f64) -> Result<(Kernel, f64)> {
    let rule = match purpose {
        Purpose::Values => {
            let family = Family::Matern { order: 2 };
            return Ok((Kernel::new(family, family.length_scale_of_values(scales), 1.0)?, DEFAULT_ALPHA));
        }
        Purpose::Normals => NORMALS,
        Purpose::Curvatures => CURVATURES,
        Purpose::LevelSets => LEVEL_SETS,
    };
    let length_scale = (rule.extents * scales.extent).max(rule.spacings * scales.spacing);
    let epsilon = (rule.smoothing * scales.spacing / length_scale).powi(2);
    let alpha = SURFACE_ALPHA.max(NOISE_FACTOR * (noise() / scales.spacing).powf(NOISE_EXPONENT));
    Ok((Kernel::new(Family::Laplace { epsilon }, length_scale, 1.0)?, alpha))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::observer::Unobserved;
    use crate::points::cloud::Cloud;
    use crate::points::noise::estimate_noise;
    use crate::points::sampling::Sampling;
    use crate::regression::function::interpolant::Interpolant;
    use crate::regression::solver::{Solver, System};
    use crate::regression::sums::regularization::Regularization;
    use crate::surface::Surface;
    use crate::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};
    use crate::testing::{circle, fibonacci_sphere};

    fn of(cloud: &Cloud, purpose: Purpose) -> (Kernel, f64) {
        let sampling = Sampling::of(cloud, &Unobserved).unwrap();
        let noise = || estimate_noise(cloud, &sampling, &Unobserved).unwrap();
        default_fit(sampling.scales(), purpose, noise).unwrap()
    }

    #[test]
    fn defaults_scale_with_the_cloud() {
        let cloud = fibonacci_sphere(200);
        let scaled = Cloud::new(cloud.coordinates().iter().map(|x| 1e3 * x).collect(), 3).unwrap();
        for purpose in [Purpose::Values, Purpose::Normals, Purpose::Curvatures] {
            let (a, _) = of(&cloud, purpose);
            let (b, _) = of(&scaled, purpose);
            assert!((b.length_scale() / a.length_scale() - 1e3).abs() < 1e-9);
        }
    }

    #[test]
    fn every_circle_has_normals_by_default() {
        for n in [6, 8, 12, 16, 32, 64, 200] {
            let cloud = Arc::new(circle(n));
            let (kernel, alpha) = of(&cloud, Purpose::Normals);
            let alpha = Regularization::uniform(alpha).unwrap();
            let solver = System::new(cloud.clone(), kernel, alpha)
                .and_then(|system| Solver::dense(system, &Unobserved))
                .unwrap();
            let signature = Interpolant::signature(Arc::new(solver), &Unobserved).unwrap();
            let surface = Surface::of(signature, None, &Unobserved).unwrap();
            let model = SurfaceModel::Signature;
            let request = GeometryRequest { model, checks_curvatures: false, ..GeometryRequest::CURVATURES };
            let geometry = Geometry::of(&surface, &cloud, &request, &Unobserved).unwrap();
            assert!(geometry.flags().is_empty(), "{n} points");
            for query in 0..n {
                let cosine: f64 =
                    geometry.normal(query).iter().zip(cloud.point(query)).map(|(a, b)| a * b).sum();
                // By symmetry, normals are exact up to rounding.
                assert!(cosine > 1.0 - 1e-9, "{n} points: {cosine}");
            }
        }
    }

    #[test]
    fn a_single_point_has_a_default() {
        let cloud = Cloud::new(vec![4.0, 5.0], 2).unwrap();
        let (kernel, alpha) = of(&cloud, Purpose::Values);
        assert!(kernel.length_scale() > 0.0 && alpha == DEFAULT_ALPHA);
    }
}
