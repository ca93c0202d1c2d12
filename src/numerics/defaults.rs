//! Kernels for clients that choose none, from the cloud alone.
//!
//! Everything scales with the cloud: millimetres and kilometres get the same geometry.

use rayon::prelude::*;

use super::error::NumericsError;
use super::kernel::{Family, Kernel};
use super::observer::Observer;
use crate::numerics::points::cloud::{Cloud, squared_distance};
use crate::numerics::points::neighbours::Neighbours;

/// What a fit is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Interpolation or regression of values.
    Values,
    /// Normals of a surface.
    Normals,
    /// Curvatures and operators of a surface, which see the kernel's cusp at the points of the cloud.
    Curvatures,
}

/// α where none is given.
pub const DEFAULT_ALPHA: f64 = 1e-10;

/// Least α of the rules for surfaces: what it costs on exact data is far below what the sampling costs, and where the
/// estimate of the noise fails (coarse clouds) it keeps the fit from following the noise (docs/defaults.md).
const SURFACE_ALPHA: f64 = 1e-3;

/// α of noisy surfaces, `5 (σ/h₄)^1.5`: between the linear law that is best for smooth surfaces and the square one of
/// α = (σ|∇u|)² (docs/defaults.md).
const NOISE_FACTOR: f64 = 5.0;
const NOISE_EXPONENT: f64 = 1.5;

/// ℓ of values, in multiples of h₄: wide enough for a smooth interpolant, narrow
/// enough for Matérn 5/2 to stay positive definite in float64 with α = 1e-10.
const VALUES_SPACINGS: f64 = 10.0;

/// A rule for a surface: ℓ is the greater of `extents` times the extent and `spacings` times h₄; √ε ℓ is `smoothing` h₄.
struct SurfaceRule {
    extents: f64,
    spacings: f64,
    smoothing: f64,
}

/// Sharp enough for the edges of scans (docs/defaults.md).
const NORMALS: SurfaceRule = SurfaceRule { extents: 0.45, spacings: 4.0, smoothing: 0.4 };

/// Smooth enough for second derivatives at the points, which see the kernel's cusp.
const CURVATURES: SurfaceRule = SurfaceRule { extents: 0.9, spacings: 8.0, smoothing: 3.0 };

/// Lengths of a cloud, unit L; those that kernels follow are 1 for one position alone, which has no scale.
#[derive(Debug, Clone, Copy)]
pub struct Scales {
    /// Half the diagonal of the bounding box.
    radius: f64,
    /// Root mean square distance to the centroid, which no rotation changes.
    extent: f64,
    /// h: median distance to the nearest point elsewhere.
    nearest: f64,
    /// h₄: median of the mean distance to the 4 nearest points elsewhere.
    spacing: f64,
    nearest_range: Option<NearestRange>,
}

/// Distances from each point to the nearest point elsewhere, unit L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestRange {
    pub min: f64,
    pub median: f64,
    pub max: f64,
}

impl Scales {
    /// Looks at the neighbours of every point.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn of(
        cloud: &Cloud,
        neighbours: &Neighbours,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let look_around = |point: usize| {
            observer.checkpoint()?;
            Ok(neighbours.nearest_and_mean(cloud, point, 4))
        };
        let found: Vec<_> =
            (0..cloud.n_points()).into_par_iter().map(look_around).collect::<Result<_, NumericsError>>()?;
        let (nearest, means): (Vec<f64>, Vec<f64>) = found.into_iter().flatten().unzip();
        let range = |of: fn(f64, f64) -> f64| nearest.iter().copied().reduce(of);
        let (min, max) = (range(f64::min), range(f64::max));
        Ok(match (min, median(nearest), max, median(means)) {
            (Some(min), Some(median), Some(max), Some(spacing)) => Self {
                radius: cloud.radius(),
                extent: extent(cloud),
                nearest: median,
                spacing,
                nearest_range: Some(NearestRange { min, median, max }),
            },
            _ => Self { radius: 1.0, extent: 1.0, nearest: 1.0, spacing: 1.0, nearest_range: None },
        })
    }

    /// Flops of [`Scales::of`]: every search visits a few leaves, in many dimensions most of the cloud.
    pub fn flops_needed(n_points: usize, dimension: usize) -> f64 {
        let n = n_points as f64;
        let visited = n.min(60.0 * 2f64.powi(dimension.min(60) as i32));
        // Distance, comparison and descent.
        n * visited * (3.0 * dimension as f64 + 10.0)
    }

    /// `None` if all points coincide.
    pub fn nearest_range(&self) -> Option<NearestRange> {
        self.nearest_range
    }
}

fn extent(cloud: &Cloud) -> f64 {
    let n = cloud.n_points() as f64;
    let mut centroid = vec![0.0; cloud.dimension()];
    for x in cloud.points() {
        centroid.iter_mut().zip(x).for_each(|(c, x)| *c += x / n);
    }
    cloud.points().map(|x| squared_distance(x, &centroid) / n).sum::<f64>().sqrt()
}

/// The kernel and α for a purpose: Matérn 5/2 for values, regularised Laplace for surfaces. `noise` is asked for surfaces
/// only: the standard deviation of the points across the surface, unit L.
///
/// # Errors
/// [`NumericsError::InvalidKernelParameter`] if the cloud is too small or large for any length scale.
pub fn default_fit(
    scales: &Scales,
    purpose: Purpose,
    noise: impl FnOnce() -> f64,
) -> Result<(Kernel, f64), NumericsError> {
    let rule = match purpose {
        Purpose::Values => {
            let family = Family::Matern { order: 2 };
            return Ok((Kernel::new(family, length_scale_for(scales, family), 1.0)?, DEFAULT_ALPHA));
        }
        Purpose::Normals => NORMALS,
        Purpose::Curvatures => CURVATURES,
    };
    let length_scale = (rule.extents * scales.extent).max(rule.spacings * scales.spacing);
    let epsilon = (rule.smoothing * scales.spacing / length_scale).powi(2);
    let alpha = SURFACE_ALPHA.max(NOISE_FACTOR * (noise() / scales.spacing).powf(NOISE_EXPONENT));
    Ok((Kernel::new(Family::Laplace { epsilon }, length_scale, 1.0)?, alpha))
}

/// A length scale for a family, unit L.
pub fn length_scale_for(scales: &Scales, family: Family) -> f64 {
    match family {
        // Analytic kernels lose positive definiteness in float64 soonest.
        Family::Gauss | Family::InverseMultiquadric => (3.0 * scales.nearest).min(scales.radius),
        Family::Laplace { .. } => 0.5 * scales.radius,
        Family::Matern { .. } => (VALUES_SPACINGS * scales.spacing).min(2.0 * scales.radius),
        // The support must reach well past the neighbours.
        Family::Wendland { .. } => (VALUES_SPACINGS * scales.spacing).min(4.0 * scales.radius),
    }
}

/// The middle of a list, the upper one of two.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::numerics::function::interpolant::Interpolant;
    use crate::numerics::observer::Unobserved;
    use crate::numerics::points::noise::estimate_noise;
    use crate::numerics::solver::GramFactor;
    use crate::numerics::sums::regularization::Regularization;
    use crate::numerics::surface::Surface;
    use crate::numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};
    use crate::numerics::testing::{circle, fibonacci_sphere};

    fn of(cloud: &Cloud, purpose: Purpose) -> (Kernel, f64) {
        let neighbours = Neighbours::of(cloud);
        let scales = Scales::of(cloud, &neighbours, &Unobserved).unwrap();
        let noise = || estimate_noise(cloud, &neighbours, &Unobserved).unwrap();
        default_fit(&scales, purpose, noise).unwrap()
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
            let factor = GramFactor::factorize(cloud.clone(), kernel, alpha, &Unobserved).unwrap();
            let signature = Interpolant::signature(Arc::new(factor), &Unobserved).unwrap();
            let surface = Surface::of(signature, None, &Unobserved).unwrap();
            let model = SurfaceModel::Signature;
            let request = GeometryRequest { model, checks_curvatures: false, ..GeometryRequest::CURVATURES };
            let geometry = Geometry::of(&surface, &cloud, &request, &Unobserved).unwrap();
            assert!(geometry.degenerate().is_empty(), "{n} points");
            for query in 0..n {
                let cosine: f64 =
                    geometry.normal(query).iter().zip(cloud.point(query)).map(|(a, b)| a * b).sum();
                // By symmetry exact but for rounding.
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

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![]), None);
    }
}
