//! Rules by which `auto` takes another solver than the dense one.

use crate::kernel::Kernel;
use crate::kernel::defaults::Purpose;
use crate::patches::MAX_LOCAL_DIMENSION;
use crate::points::cloud::Cloud;
use crate::regression::sums::regularization::Regularization;

/// Number of points from which `auto` regresses a surface locally, unless kernel or α are given.
///
/// The factorization alone would take more than a second.
pub const LOCAL_FROM: usize = 5_000;

/// Number of points from which `auto` regresses a curve of the plane locally, for its level set.
///
/// With the short kernel of level sets, the signature function of a finer curve exceeds its level only in a
/// shell that is thinner than its dips between the points, and its level set is a row of islands: of 100
/// points on a square or 200 on a circle. Local regressions mesh all curves that were tried from 100 points
/// on, and of 50 all but those too coarse for any method.
pub const LOCAL_CURVES_FROM: usize = 64;

/// Number of points from which `auto` regresses a surface in space locally, for its mesh.
///
/// With the short kernel of level sets, the signature function of thousands of points has sheets inside of
/// the body: from 3,000 points on a cube, or 3,600 on a cone, a star or a bumpy sphere, a fifth of the
/// vertices lay far from any point. Local regressions mesh all bodies that were tried from 300 points on.
pub const LOCAL_MESHES_FROM: usize = 300;

/// Reason why `auto` chose another solver than the dense one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutoReason {
    /// The cloud has more points than the dense solver accepts.
    BeyondDense,
    /// The cloud has many points, and the work of regressions is linear in them.
    ManyPoints,
    /// Standard deviations are requested, which only regressions have.
    Deviations,
    /// The normals of both sheets at sharp edges are requested, which only regressions find.
    EdgeNormals,
    /// The level set of a finely sampled curve is requested.
    FineCurve,
    /// The mesh of a surface is requested.
    Mesh,
    /// Few landmarks span the kernels of all points.
    FewLandmarks,
    /// The cloud has more points than the dense solver accepts, and the request names a tolerance, which only
    /// a function of all values can keep.
    Tolerance,
}

/// Flops of landmarks up to which `auto` takes them for values that are not factorized: about twenty seconds.
const MOST_FLOPS: f64 = 1e12;

/// Least number of points of which `auto` fits values on landmarks. Fewer are factorized within milliseconds.
pub const LANDMARKS_FROM: usize = 1_000;

/// Points per landmark from which landmarks take less time than a factorization of all points: 8 n r² flops
/// are fewer than n³/3.
const POINTS_PER_LANDMARK: usize = 5;

/// Least noise, over k₀, for which landmarks have the digits of a factorization. Rounding leaves 1e-13 k₀ of
/// the diagonal, so with less noise variances would lose digits, and with 1e-8 the iteration is slower than
/// the factorization.
const LEAST_NOISE: f64 = 1e-6;

/// Returns the largest number of landmarks on which `auto` fits values, or 0 if it factorizes all points.
///
/// Up to `max_dense_points`, landmarks must give the digits of the factorization in less time. Beyond, the
/// alternative is a small system around each query.
pub fn most_landmarks(
    cloud: &Cloud,
    kernel: &Kernel,
    noise: &Regularization,
    max_dense_points: usize,
) -> usize {
    let n = cloud.n_points();
    if n > max_dense_points {
        return (MOST_FLOPS / (8.0 * n as f64)).sqrt() as usize;
    }
    let has_noise = || (0..n).all(|point| noise.at(point) >= LEAST_NOISE * kernel.at_zero());
    if n >= LANDMARKS_FROM && has_noise() { n / POINTS_PER_LANDMARK } else { 0 }
}

/// A surface known only by its points, before it is fitted.
#[derive(Debug, Clone, Copy)]
pub struct UnfittedSurface {
    pub n_points: usize,
    pub dimension: usize,
    pub purpose: Purpose,
    /// The first requested quantity that only local regressions have, if there is one.
    pub only_regressed: Option<AutoReason>,
}

/// Returns why a surface is better regressed locally, or `None` if it is not.
pub fn prefers_local(surface: &UnfittedSurface, max_dense_points: usize) -> Option<AutoReason> {
    let UnfittedSurface { n_points, dimension, purpose, only_regressed } = *surface;
    match dimension {
        2..=MAX_LOCAL_DIMENSION if n_points > max_dense_points => Some(AutoReason::BeyondDense),
        2..=MAX_LOCAL_DIMENSION if only_regressed.is_some() => only_regressed,
        2..=MAX_LOCAL_DIMENSION if n_points >= LOCAL_FROM => Some(AutoReason::ManyPoints),
        2 if purpose == Purpose::LevelSets && n_points >= LOCAL_CURVES_FROM => Some(AutoReason::FineCurve),
        3 if purpose == Purpose::LevelSets && n_points >= LOCAL_MESHES_FROM => Some(AutoReason::Mesh),
        _ => None,
    }
}
