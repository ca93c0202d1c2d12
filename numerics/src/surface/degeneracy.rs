//! Where geometry has no meaning, or less accuracy than it seems: the criteria of docs/numerics.md, Geometry.

use crate::error::NumericsError;
use crate::function::interpolant::Interpolant;
use crate::kernel::{Kernel, MAX_SLOPE};
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::LocalQuadric;
use crate::points::sampling::Scales;
use crate::sums::jets::{JetOrder, Jets};

/// What is wrong at a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DegeneracyReason {
    /// |∇u| is rounding (T1), too small against the Hessian at the scale of the sampling (T2), or oblique to the surface,
    /// and the offset model is of no help: there is no answer.
    VanishingGradient,
    /// The offset model might help, but not within the work that was admitted: there is no answer.
    UnaffordableRescue,
    /// The cusp of the kernel is seen: curvatures are served, and wrong by factors.
    KernelTooRough,
    /// The query is far from every point of the cloud: the level surface through it is not the one that was sampled.
    FarFromCloud,
    /// The curvatures differ from those that the neighbours suggest (T4): the sampling does not resolve the surface.
    UnderResolved,
    /// What is known of the side contradicts itself: the winding number of the oriented points is not ½ there,
    /// or the neighbours point to the other side. The normal is served, and may point inward.
    AmbiguousSide,
}

impl DegeneracyReason {
    /// Whether there is no answer at all.
    pub fn is_null(self) -> bool {
        match self {
            Self::VanishingGradient | Self::UnaffordableRescue => true,
            Self::KernelTooRough | Self::FarFromCloud | Self::UnderResolved | Self::AmbiguousSide => false,
        }
    }
}

/// A query at which geometry has no or less meaning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Degeneracy {
    pub query: usize,
    pub reason: DegeneracyReason,
    /// |∇| of the function that was used, 1/L for the signature function.
    pub gradient_norm: f64,
}

/// What the nodes around a query are good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Resolution {
    Resolved,
    /// They see the curvature of the surface wrong.
    Unresolved,
    /// There are too few of them, or no query: the row is empty.
    #[default]
    Empty,
}

/// T1: multiple of the rounding bound under which a gradient is rounding.
const ROUNDING_FACTOR: f64 = 64.0;

/// T2: fraction of `h_q ‖D²u‖_F` under which the direction of ∇u turns within the sampling distance.
const SCALE_FACTOR: f64 = 0.05;

/// The same fraction below which a gradient is weak: the error that the sampling leaves in it shows in the curvatures.
const WEAK_FACTOR: f64 = 0.25;

/// Cosine between ∇u and the normal of a reliable quadric below which ∇u is not normal to the surface at all.
const OBLIQUE: f64 = 0.5;

/// Spacings from the nearest point beyond which a query is far from the cloud.
const FAR_SPACINGS: f64 = 3.0;

/// T1 at each query: `ℓ|∇u| ≤ 64 [ε(ℓΣ|λ_j||∇k_j| + Σ|λ_j||k_j| + η(1 + v)Σ|λ_j|) + ‖Y − (K+αI)Λ‖_∞]`, η the
/// least normal number; and wherever |∇u| itself is below η: subnormal numbers have lost digits, however
/// small their sum of magnitudes is.
///
/// The sums of magnitudes take half of a pass over all pairs more. They are at most `Σ|λ_j|` times the
/// greatest values of k and ℓ|∇k|, which nearly every gradient exceeds; only the others are asked for theirs.
///
/// # Errors
/// [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
pub(crate) fn roundings(
    signature: &Interpolant,
    queries: &Cloud,
    jets: &Jets,
    observer: &dyn Observer,
) -> Result<Vec<bool>, NumericsError> {
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

/// T2: `|∇u| < 0.05 h_q ‖D²u‖_F`.
fn turns_within_spacing(jets: &Jets, query: usize, spacing: f64) -> bool {
    norm(jets.gradient(query)) < SCALE_FACTOR * spacing * norm(&jets.hessian(query))
}

/// Whether curvatures had better come from the offset model, if it has an answer: `|∇u| < 0.25 h_q ‖D²u‖_F`.
pub(crate) fn is_weak(jets: &Jets, query: usize, spacing: f64) -> bool {
    norm(jets.gradient(query)) < WEAK_FACTOR * spacing * norm(&jets.hessian(query))
}

/// Whether the nearest point is too far away for a query to lie on the surface.
pub(crate) fn is_far(squared_distance: f64, spacing: f64) -> bool {
    squared_distance > (FAR_SPACINGS * spacing).powi(2)
}

/// Whether ∇u, which is no rounding (T1), is no normal at a query all the same: no direction at the scale of the sampling (T2), or
/// oblique to a reliable quadric.
pub(crate) fn is_no_normal(
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

/// Whether second derivatives at the points see a cusp: what rounds it is narrower than the median distance to the nearest point.
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
    use crate::solver::{Solver, System};
    use crate::sums::regularization::Regularization;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn gradients_that_are_subnormal_are_rounding() {
        // e^{−d²} from 26.5 to 27.3 away: 1e-305 to 1e-323, and then nothing. A single point has a residual
        // of exactly 0.
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
