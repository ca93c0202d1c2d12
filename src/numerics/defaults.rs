//! Kernels for clients that choose none, from the cloud alone.
//!
//! Everything scales with the cloud: millimetres and kilometres get the same geometry.

use super::cloud::Cloud;
use super::error::NumericsError;
use super::kernel::{Family, Kernel};
use super::neighbours::Neighbours;

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

/// α of the rules for surfaces: between the 1e-8 and 1e-3 that scans were measured to tolerate (numerics.md, Defaults).
const SURFACE_ALPHA: f64 = 1e-6;

/// ℓ of values, in multiples of the median distance to the nearest point: wide enough for a smooth interpolant, narrow
/// enough for Matérn 5/2 to stay positive definite in float64 with α = 1e-10.
const VALUES_SPACINGS: f64 = 10.0;

/// ℓ of normals against the radius, and √ε ℓ against the median spacing (numerics.md, Defaults).
const NORMALS_RADII: f64 = 0.3;
const NORMALS_SMOOTHING: f64 = 0.1;

/// Median spacing against the radius above which a cloud is coarse: the cusps of neighbouring points no longer blend, all
/// gradients at the points fail T2, and the rule for curvatures, which smooths them away, serves normals as well.
const COARSE_SPACING: f64 = 0.1;

/// The same for curvatures and operators: right to 1e-3 on a sphere where the rule for normals is off by factors.
const CURVATURES_RADII: f64 = 0.5;
const CURVATURES_SMOOTHING: f64 = 2.0;

/// The kernel and α for a purpose: Matérn 5/2 for values, regularised Laplace for surfaces.
///
/// # Errors
/// [`NumericsError::InvalidKernelParameter`] if the cloud is too small or large for any length scale.
pub fn default_fit(
    cloud: &Cloud,
    neighbours: &Neighbours,
    purpose: Purpose,
) -> Result<(Kernel, f64), NumericsError> {
    let scales = Scales::of(cloud, neighbours);
    let laplace = |radii: f64, smoothing: f64| {
        let length_scale = radii * scales.radius;
        let epsilon = (smoothing * scales.spacing / length_scale).powi(2);
        Kernel::new(Family::Laplace { epsilon }, length_scale, 1.0)
    };
    match purpose {
        Purpose::Values => {
            let length_scale = default_length_scale(&scales, Family::Matern { order: 2 });
            Ok((Kernel::new(Family::Matern { order: 2 }, length_scale, 1.0)?, DEFAULT_ALPHA))
        }
        Purpose::Normals if scales.spacing < COARSE_SPACING * scales.radius => {
            Ok((laplace(NORMALS_RADII, NORMALS_SMOOTHING)?, SURFACE_ALPHA))
        }
        Purpose::Normals | Purpose::Curvatures => {
            Ok((laplace(CURVATURES_RADII, CURVATURES_SMOOTHING)?, SURFACE_ALPHA))
        }
    }
}

/// A length scale for a family that the client chose, unit L.
pub fn length_scale_for(cloud: &Cloud, neighbours: &Neighbours, family: Family) -> f64 {
    default_length_scale(&Scales::of(cloud, neighbours), family)
}

fn default_length_scale(scales: &Scales, family: Family) -> f64 {
    let spacings = VALUES_SPACINGS * scales.spacing;
    match family {
        // Analytic kernels lose positive definiteness in float64 soonest.
        Family::Gauss | Family::InverseMultiquadric => (0.3 * spacings).min(scales.radius),
        Family::Laplace { .. } => CURVATURES_RADII * scales.radius,
        Family::Matern { .. } => spacings.min(2.0 * scales.radius),
        // The support must reach well past the neighbours.
        Family::Wendland { .. } => spacings.min(4.0 * scales.radius),
    }
}

struct Scales {
    /// Half the diagonal of the bounding box.
    radius: f64,
    /// Median distance to the nearest point elsewhere.
    spacing: f64,
}

impl Scales {
    /// One position alone has no scale; 1 is as good as any.
    fn of(cloud: &Cloud, neighbours: &Neighbours) -> Self {
        match median(neighbours.spacings(cloud)) {
            Some(spacing) => Self { radius: cloud.radius(), spacing },
            None => Self { radius: 1.0, spacing: 1.0 },
        }
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
    use crate::numerics::geometry::{Geometry, GeometryRequest, SurfaceModel};
    use crate::numerics::interpolant::Interpolant;
    use crate::numerics::observer::Unobserved;
    use crate::numerics::regularization::Regularization;
    use crate::numerics::solver::GramFactor;
    use crate::numerics::surface::Surface;
    use crate::numerics::testing::{circle, fibonacci_sphere};

    #[test]
    fn defaults_scale_with_the_cloud() {
        let cloud = fibonacci_sphere(200);
        let scaled = Cloud::new(cloud.coordinates().iter().map(|x| 1e3 * x).collect(), 3).unwrap();
        for purpose in [Purpose::Values, Purpose::Normals, Purpose::Curvatures] {
            let (a, _) = default_fit(&cloud, &Neighbours::of(&cloud), purpose).unwrap();
            let (b, _) = default_fit(&scaled, &Neighbours::of(&scaled), purpose).unwrap();
            assert!((b.length_scale() / a.length_scale() - 1e3).abs() < 1e-9);
        }
    }

    #[test]
    fn every_circle_has_normals_by_default() {
        for n in [6, 8, 12, 16, 32, 64, 200] {
            let cloud = Arc::new(circle(n));
            let neighbours = Neighbours::of(&cloud);
            let (kernel, alpha) = default_fit(&cloud, &neighbours, Purpose::Normals).unwrap();
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
        let (kernel, alpha) = default_fit(&cloud, &Neighbours::of(&cloud), Purpose::Values).unwrap();
        assert!(kernel.length_scale() > 0.0 && alpha == DEFAULT_ALPHA);
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![]), None);
    }
}
