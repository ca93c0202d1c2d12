//! Criteria for queries where geometry is undefined, or less accurate than its digits suggest
//! (docs/numerics.md, Geometry).

use crate::error::Result;
use crate::kernel::{Kernel, MAX_SLOPE};
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::LocalQuadric;
use crate::points::sampling::Scales;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::sums::jets::{JetOrder, Jets};

/// The reason why a query has a flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlagReason {
    /// Null: ∇u is rounding (T1), small against the Hessian at the scale of the sampling (T2), or oblique to
    /// the surface. The offset model has no answer either.
    VanishingGradient,
    /// Null: the offset model might have an answer, but the admitted work is used up.
    UnaffordableRescue,
    /// Curvatures are served, but wrong by factors, because second derivatives see the cusp of the kernel.
    KernelTooRough,
    /// The query is far from every point, so the level surface through it is not the one that was sampled.
    FarFromCloud,
    /// The sampling does not resolve the surface: the neighbours do not confirm the curvatures (T4), or the
    /// normal is too uncertain.
    UnderResolved,
    /// The normal is served, but may point inward. The winding number of the oriented points is not ½ there,
    /// or the neighbours point to the other side.
    AmbiguousSide,
    /// The query is at a sharp edge, and its normal is that of one of the two sheets that meet there, or of
    /// neither.
    Edge,
}

impl FlagReason {
    /// Returns whether the query has no answer at all.
    pub fn is_null(self) -> bool {
        match self {
            Self::VanishingGradient | Self::UnaffordableRescue => true,
            Self::KernelTooRough
            | Self::FarFromCloud
            | Self::UnderResolved
            | Self::AmbiguousSide
            | Self::Edge => false,
        }
    }
}

/// A query without an answer, or with a flag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flag {
    pub query: usize,
    pub reason: FlagReason,
    /// Gradient norm of the function that was used. Unit 1/L for the signature function.
    pub gradient_norm: f64,
}

/// Quality of the nodes around a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Resolution {
    Resolved,
    /// The nodes misrepresent the curvature of the surface.
    Unresolved,
    /// The row is empty, because there are too few nodes or the query has no normal.
    #[default]
    Empty,
}

/// T1: multiple of the rounding bound below which a gradient counts as rounding.
const ROUNDING_FACTOR: f64 = 64.0;

/// T2: fraction of `h_q ‖D²u‖_F` below which the direction of ∇u turns within the sampling distance.
const SCALE_FACTOR: f64 = 0.05;

/// Fraction of `h_q ‖D²u‖_F` below which a gradient is weak: its sampling error shows in the curvatures.
const WEAK_FACTOR: f64 = 0.25;

/// Cosine between ∇u and the normal of a reliable quadric below which ∇u is not normal to the surface at all.
const OBLIQUE: f64 = 0.5;

/// Spacings from the nearest point beyond which a query is far from the cloud.
const FAR_SPACINGS: f64 = 3.0;

/// Finds the queries at which ∇u is rounding (T1), `[m]`.
///
/// The criterion is `ℓ|∇u| ≤ 64 [ε(ℓΣ|λ_j||∇k_j| + Σ|λ_j||k_j| + η(1 + v)Σ|λ_j|) + ‖Y − (K+αI)Λ‖_∞]`, η the
/// least normal number. It also holds where |∇u| < η: subnormal numbers have lost digits, however small their
/// sum of magnitudes is.
///
/// Sums of magnitudes cost half of a pass over all pairs. They are at most `Σ|λ_j|` times the greatest values
/// of k and ℓ|∇k|. Nearly every gradient exceeds that bound, so magnitudes are evaluated only for the others.
///
/// # Errors
/// `NumericsError::Overflow`, `NumericsError::Cancelled`.
pub(crate) fn roundings(
    signature: &Interpolant,
    queries: &Cloud,
    jets: &Jets,
    observer: &dyn Observer,
) -> Result<Vec<bool>> {
    let (kernel, solution) = (signature.solver.kernel(), &signature.solution);
    let length_scale = kernel.length_scale();
    let total: f64 = solution.weights.iter().map(|weight| weight.abs()).sum();
    let underflow = f64::MIN_POSITIVE * (1.0 + kernel.variance()) * total;
    let is_rounding = |query: usize, magnitudes: f64| {
        let rounding = f64::EPSILON * (magnitudes + underflow) + solution.residual_max;
        let length = norm(jets.gradient(query));
        length < f64::MIN_POSITIVE || length_scale * length <= ROUNDING_FACTOR * rounding
    };
    let at_most = total * (kernel.at_zero() + kernel.variance() * MAX_SLOPE);
    let mut found: Vec<bool> = (0..jets.n_queries()).map(|query| is_rounding(query, at_most)).collect();
    let suspects: Vec<usize> = (0..found.len()).filter(|&query| found[query]).collect();
    if suspects.is_empty() {
        return Ok(found);
    }
    let order = JetOrder::HessianWithMagnitudes;
    let expansion = signature.solver.expansion(&solution.weights);
    let with_magnitudes = expansion.at(&queries.select(&suspects), order, observer)?;
    for (at, query) in suspects.into_iter().enumerate() {
        let (value, slope) = with_magnitudes.magnitudes(at);
        found[query] = is_rounding(query, length_scale * slope + value);
    }
    Ok(found)
}

/// Returns whether T2 holds: `|∇u| < 0.05 h_q ‖D²u‖_F`.
fn turns_within_spacing(jets: &Jets, query: usize, spacing: f64) -> bool {
    norm(jets.gradient(query)) < SCALE_FACTOR * spacing * norm(&jets.hessian(query))
}

/// Returns whether the offset model, if it has an answer, gives better curvatures: `|∇u| < 0.25 h_q ‖D²u‖_F`.
pub(crate) fn is_weak(jets: &Jets, query: usize, spacing: f64) -> bool {
    norm(jets.gradient(query)) < WEAK_FACTOR * spacing * norm(&jets.hessian(query))
}

/// Returns whether the nearest point is too far away for a query to lie on the surface.
pub(crate) fn is_far(squared_distance: f64, spacing: f64) -> bool {
    squared_distance > (FAR_SPACINGS * spacing).powi(2)
}

/// Returns whether ∇u, which is not rounding (T1), is still no normal at a query.
///
/// Either it has no direction at the scale of the sampling (T2), or it is oblique to a reliable quadric.
pub(crate) fn lacks_normal(
    jets: &Jets,
    query: usize,
    spacing: f64,
    quadric: Option<LocalQuadric<'_>>,
) -> bool {
    let gradient = jets.gradient(query);
    let is_oblique =
        |quadric: &LocalQuadric<'_>| dot(gradient, quadric.normal).abs() < OBLIQUE * norm(gradient);
    turns_within_spacing(jets, query, spacing)
        || quadric.filter(LocalQuadric::is_reliable).is_some_and(|quadric| is_oblique(&quadric))
}

/// Returns whether second derivatives at the points see a cusp of the kernel. They do if the cusp is rounded
/// over less than the median distance to the nearest point.
pub(crate) fn is_too_rough(kernel: &Kernel, scales: &Scales) -> bool {
    let nearest = scales.nearest_range().map_or(0.0, |range| range.median);
    kernel.family().cusp_width().is_some_and(|width| width * kernel.length_scale() < nearest)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::Family;
    use crate::observer::Unobserved;
    use crate::regression::solver::{Solver, System};
    use crate::regression::sums::regularization::Regularization;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn gradients_that_are_subnormal_are_rounding() {
        // Values e^{−d²} at distances d from 26.5 to 27.3: 1e-305 to 1e-323, and then 0. A single point has a
        // residual of exactly 0.
        let places: Vec<f64> = (0..9).flat_map(|i| [26.5 + 0.1 * f64::from(i), 0.0, 0.0]).collect();
        let queries = Cloud::new(places, 3).unwrap();
        let cloud = Arc::new(Cloud::new(vec![0.0; 3], 3).unwrap());
        for variance in [1.0, 1e12] {
            let kernel = Kernel::new(Family::Gauss, 1.0, variance).unwrap();
            let system = System::new(cloud.clone(), kernel, Regularization::Uniform(0.0)).unwrap();
            let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
            let signature = Interpolant::signature(solver, &Unobserved).unwrap();
            let jets = signature.at(&queries, JetOrder::Hessian, &Unobserved).unwrap();
            let found = roundings(&signature, &queries, &jets, &Unobserved).unwrap();
            for (query, found) in found.iter().enumerate() {
                let length = norm(jets.gradient(query));
                assert!(*found || length >= f64::MIN_POSITIVE, "{variance}: {length:e}");
            }
            assert!(!found[0] && found[8], "{variance}: {found:?}");
        }
    }

    #[test]
    fn gradients_are_judged_as_if_all_were_asked_for_their_magnitudes() {
        // The centre, where ∇u vanishes, points of the sphere, and places so far away that k underflows.
        let places = [[0.0; 3], [1e-14, 0.0, 0.0], [0.6, 0.8, 0.0], [0.5, 0.0, 0.0], [40.0, 0.0, 0.0]];
        let queries = Cloud::new(places.concat(), 3).unwrap();
        let mut n_rounding = 0;
        for (length_scale, alpha) in [(0.5, 1e-3), (1.0, 0.0), (6.0, 1e-9)] {
            let kernel = Kernel::new(Family::Gauss, length_scale, 1.7).unwrap();
            let cloud = Arc::new(fibonacci_sphere(150));
            let system = System::new(cloud, kernel, Regularization::Uniform(alpha)).unwrap();
            let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
            let signature = Interpolant::signature(solver, &Unobserved).unwrap();
            let order = JetOrder::HessianWithMagnitudes;
            let jets = signature.at(&queries, order, &Unobserved).unwrap();
            let found = roundings(&signature, &queries, &jets, &Unobserved).unwrap();
            for (query, found) in found.into_iter().enumerate() {
                let (value, slope) = jets.magnitudes(query);
                let rounding =
                    f64::EPSILON * (length_scale * slope + value) + signature.solution.residual_max;
                let length = norm(jets.gradient(query));
                let is_subnormal = length < f64::MIN_POSITIVE;
                let expected = is_subnormal || length_scale * length <= ROUNDING_FACTOR * rounding;
                assert_eq!(found, expected, "query {query}, ℓ = {length_scale}");
                n_rounding += usize::from(found);
            }
        }
        // The centre at least, and never all.
        assert!((3..15).contains(&n_rounding), "{n_rounding}");
    }
}
