//! The offset model: a signed distance from two more layers of points, for places where the signature
//! function has no gradient.
//!
//! The signature function cannot tell the sides of a surface whose mean curvature vanishes locally (a plane,
//! a saddle with a = b). Two layers X ± δν with the data ±δ break that symmetry (Carr et al. 2001, for radial
//! basis functions). The interpolant of 0, +δ, −δ is a signed distance near the surface, |∇F| ≈ 1. Normals
//! and curvatures follow from it by the same formulas. It is fitted to the nearest points only, in units of
//! their distance. So it costs the same for every query and does not depend on the kernel of the request.

use std::sync::Arc;

use crate::error::Result;
use crate::kernel::{Family, Kernel};
use crate::machine::small::Small;
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::points::patch::Patch;
use crate::points::quadric::n_coefficients;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::solver::{Solver, System};
use crate::regression::sums::jets::JetOrder;
use crate::regression::sums::regularization::Regularization;

/// Neighbours per coefficient of a quadric in a patch: 42 for surfaces in space.
const NEIGHBOURS_PER_COEFFICIENT: usize = 7;

/// Length scale ℓ of the Gauss kernel over the radius of the patch.
const LENGTH_SCALE: f64 = 3.0;

/// Offset δ over the mean spacing of the patch.
const OFFSET_SPACINGS: f64 = 0.5;

/// Values of α over k₀: the layers are ill-conditioned by design. The second and third are for patches for
/// which float64 has no interpolant with the first. These bend very much, or very little beyond the rounding
/// of their coordinates.
const ALPHAS: [f64; 3] = [1e-12, 1e-9, 1e-6];

/// Height over the radius of the patch below which it is rounding.
const ROUNDING: f64 = 1e-13;

/// Returns the number of points of a patch.
pub(crate) fn n_patch_points(dimension: usize) -> usize {
    NEIGHBOURS_PER_COEFFICIENT * n_coefficients(dimension)
}

/// Gradient ∇F and Hessian D²F at a query, F a signed distance that is positive on the side that the normals
/// point to.
#[derive(Debug, Clone)]
pub(crate) struct OffsetJet {
    /// `[d]`, unitless.
    pub gradient: Small,
    /// `[d, d]`, 1/L.
    pub hessian: Small,
}

/// Computes the jet at x of F, fitted to a patch around x.
///
/// `normals` are one unit normal per point of the patch, `[k, d]`, consistently oriented.
///
/// # Errors
/// Returns the errors of the fit, and never `NumericsError::Cancelled`.
pub(crate) fn offset_jet(patch: &Patch, normals: &[f64]) -> Result<OffsetJet> {
    let d = patch.dimension();
    let delta = OFFSET_SPACINGS * mean_spacing(patch);
    let normals: Vec<f64> = normals.chunks_exact(d).flat_map(|normal| patch.to_frame(normal)).collect();
    let up = if normals.chunks_exact(d).map(|normal| normal[d - 1]).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let (mut nodes, mut data) = (Vec::new(), Vec::new());
    for side in [0.0, delta, -delta] {
        for (x, normal) in patch.coordinates().chunks_exact(d).zip(normals.chunks_exact(d)) {
            nodes.extend(x.iter().zip(normal).map(|(x, n)| x + side * n));
            data.push(side);
        }
    }
    // The distance from the tangent plane is most of F. The kernel is left with the bend of the surface,
    // which on a plane is rounding.
    for (x, y) in nodes.chunks_exact(d).zip(&mut data) {
        *y -= up * x[d - 1];
        if y.abs() < ROUNDING {
            *y = 0.0;
        }
    }
    let kernel = Kernel::new(Family::Gauss, LENGTH_SCALE, 1.0)?;
    let nodes = Arc::new(Cloud::new(nodes, d)?);
    let fit = |alpha| {
        let alpha = Regularization::Uniform(alpha);
        let solver = System::new(nodes.clone(), kernel.clone(), alpha)
            .and_then(|system| Solver::dense(system, &Unobserved))?;
        Interpolant::fit(Arc::new(solver), &data, &Unobserved)
    };
    let model = fit(ALPHAS[0]).or_else(|_| fit(ALPHAS[1])).or_else(|_| fit(ALPHAS[2]))?;
    let origin = Cloud::new(vec![0.0; d], d)?;
    let jets = model.at(&origin, JetOrder::Hessian, &Unobserved)?;
    let mut gradient = Small::from_slice(jets.gradient(0));
    gradient[d - 1] += up;
    Ok(OffsetJet { gradient: patch.in_space(&gradient), hessian: rotated(patch, &jets.hessian(0)) })
}

/// Returns `QᵀHQ/radius`: a Hessian in the frame and scale of the patch, turned into one in space.
fn rotated(patch: &Patch, hessian: &[f64]) -> Small {
    let d = patch.dimension();
    // H is symmetric: rotate its rows, transpose, rotate again.
    let rows: Small = hessian.chunks_exact(d).flat_map(|row| patch.in_space(row)).collect();
    let column = |c: usize| rows.iter().skip(c).step_by(d).copied().collect::<Small>();
    (0..d).flat_map(|c| patch.in_space(&column(c))).map(|h| h / patch.radius).collect()
}

/// Returns the spacing of k points spread over a ball of radius 1 in d − 1 dimensions. Each has `1/k` of the
/// volume of the ball, which is some 1.8^{d−1}.
fn mean_spacing(patch: &Patch) -> f64 {
    let k = patch.n_points() as f64;
    1.8 * k.powf(-1.0 / (patch.dimension() as f64 - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::vector::norm;
    use crate::surface::curvature::principal_curvatures;

    /// Returns the offset model at the origin, from a grid of graph points with their exact upward normals.
    fn model(height: impl Fn(f64, f64) -> f64, slope: impl Fn(f64, f64) -> [f64; 2]) -> OffsetJet {
        let at = |i: usize| ((i % 7) as f64 / 3.0 - 1.0, (i / 7) as f64 / 3.0 - 1.0);
        let points: Vec<f64> = (0..49).map(at).flat_map(|(x, y)| [x, y, height(x, y)]).collect();
        let cloud = Cloud::new(points, 3).unwrap();
        let patch = Patch::of(&cloud, &[0.0; 3], 0..49).unwrap();
        let normal = |(x, y)| {
            let [a, b] = slope(x, y);
            let length = (1.0 + a * a + b * b).sqrt();
            [-a / length, -b / length, 1.0 / length]
        };
        offset_jet(&patch, &(0..49).map(at).flat_map(normal).collect::<Vec<f64>>()).unwrap()
    }

    #[test]
    fn a_plane_has_its_normal_and_no_curvature() {
        let jet = model(|x, y| 0.3 * x - 0.2 * y, |_, _| [0.3, -0.2]);
        let length = (1.0f64 + 0.09 + 0.04).sqrt();
        let normal = [-0.3 / length, 0.2 / length, 1.0 / length];
        assert!((norm(&jet.gradient) - 1.0).abs() < 1e-12, "{:?}", jet.gradient);
        assert!(jet.gradient.iter().zip(normal).all(|(g, n)| (g - n).abs() < 1e-12), "{:?}", jet.gradient);
        let (curvatures, _) = principal_curvatures(&jet.gradient, &jet.hessian, 1.0);
        assert!(curvatures.iter().all(|k| k.abs() < 1e-12), "{curvatures:?}");
    }

    #[test]
    fn a_saddle_has_opposite_curvatures() {
        let (a, b) = (0.5, 0.5);
        let jet = model(|x, y| 0.5 * (a * x * x - b * y * y), |x, y| [a * x, -b * y]);
        let (curvatures, _) = principal_curvatures(&jet.gradient, &jet.hessian, 1.0);
        // The upward normal has the curvatures of −D² of the height: −a and b.
        assert!((curvatures[0] + a).abs() < 1e-3 && (curvatures[1] - b).abs() < 1e-3, "{curvatures:?}");
    }
}
