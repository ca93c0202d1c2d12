//! From one start to an optimum: sequential quadratic programming in the box of logarithms (Kraft 1988; the crate slsqp).
//!
//! It learns curvatures as it goes, beginning with the same for all numbers. Length scales of axes that do not matter have slopes that fall with
//! their square, and curvatures a millionth of those of the noise, so that it takes them for arrived. Hence two steps: descents that go as far as
//! that, and from the best of them one more in which every number is measured by its own curvature.

use std::cell::RefCell;

use slsqp::{Func, StopTols, minimize};

use super::walk::{Best, Walk};
use crate::error::NumericsError;
use crate::observer::Observer;
use crate::selection::evaluation::Evaluator;
use crate::selection::evaluation::space::Space;
use crate::selection::parameters::Hyperparameters;

/// A first descent ends where a step gains less than this in a log likelihood, the last one where it gains less than that.
const LEAST_GAIN: f64 = 1e-6;
const LAST_GAIN: f64 = 1e-8;

/// Slopes of a log likelihood in logarithms up to here count as none: what is left to gain is of the order of their square.
const FLAT: f64 = 1e-2;

/// Slopes up to here are not followed.
const LEAST_SLOPE: f64 = 1e-6;

/// Last descents, each with new curvatures, as long as one gains something.
const ROUNDS: usize = 3;

/// The difference of logarithms that curvatures are taken from.
const PROBE: f64 = 0.05;

/// The least curvature: a step is as long as a slope over it, and a box is not longer than a few hundred.
const LEAST_CURVATURE: f64 = 1e-7;

/// A number this near to its bound is at it.
const AT_BOUND: f64 = 1e-9;

/// Where a descent ended.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) logarithms: Vec<f64>,
    pub(super) hyperparameters: Hyperparameters,
    pub(super) score: f64,
    /// In the logarithms.
    pub(super) gradient: Vec<f64>,
    pub(super) converged: bool,
}

/// Ascends the criterion from these logarithms, with so many evaluations at most; says how many there were. `None` if the matrix is not positive
/// definite at the start.
///
/// # Errors
/// [`NumericsError::Cancelled`]; those of [`Hyperparameters::kernel_on`].
pub(super) fn descend(
    evaluator: &mut Evaluator<'_>,
    space: &Space,
    start: &[f64],
    max_evaluations: usize,
    observer: &dyn Observer,
) -> Result<(Option<Found>, usize), NumericsError> {
    let mut walk = Walk::new(evaluator, space, observer);
    if walk.merit(start)?.is_none() {
        return Ok((None, walk.evaluations));
    }
    let bounds = space.bounds();
    let slopes = walk.slopes(start)?;
    let steepest = free_slopes(start, &slopes, &bounds).map(|slope| slope * slope).sum::<f64>().sqrt();
    // The first step is as long as the slope that the optimizer sees: a factor of e.
    walk.scale = 1.0 / steepest.max(LEAST_SLOPE);
    let left = max_evaluations.saturating_sub(walk.evaluations);
    let walk = run(walk, start, &bounds, left, LEAST_GAIN)?;
    let evaluations = walk.evaluations;
    Ok((walk.end(start)?.map(|best| found(best, &bounds)), evaluations))
}

/// Ascends what is left from where a descent ended, in units of curvatures. The evaluator is left at what is found.
///
/// # Errors
/// Those of [`descend`].
pub(super) fn finish(
    evaluator: &mut Evaluator<'_>,
    space: &Space,
    from: Found,
    max_evaluations: usize,
    observer: &dyn Observer,
) -> Result<(Found, usize), NumericsError> {
    let (bounds, start) = (space.bounds(), from.logarithms.clone());
    let mut walk = Walk::new(evaluator, space, observer);
    let mut merit = walk.merit(&start)?.unwrap_or(f64::NEG_INFINITY);
    // The one at the start was counted before.
    walk.evaluations = 0;
    for _ in 0..ROUNDS {
        let at = walk.best_logarithms(&start);
        let slopes = walk.slopes(&at)?;
        let left = max_evaluations.saturating_sub(walk.evaluations);
        let is_done = free_slopes(&at, &slopes, &bounds).all(|slope| slope.abs() <= LEAST_SLOPE);
        if is_done || left <= 2 * space.n_free() {
            break;
        }
        walk.units = units(&mut walk, &at, &slopes, &bounds)?;
        walk.scale = 1.0;
        walk = run(walk, &at, &bounds, left - space.n_free(), LAST_GAIN)?;
        let best = walk.best.as_ref().map_or(merit, |best| best.1);
        if best - merit <= LEAST_GAIN {
            break;
        }
        merit = best;
    }
    let evaluations = walk.evaluations;
    Ok((walk.end(&start)?.map_or(from, |best| found(best, &bounds)), evaluations))
}

/// The step of each logarithm to which a slope of 1 belongs at an optimum: `1/√|h|`, h from differences of slopes; not less than the slope itself,
/// for what tends to infinity.
fn units(
    walk: &mut Walk<'_, '_>,
    at: &[f64],
    slopes: &[f64],
    bounds: &[(f64, f64)],
) -> Result<Vec<f64>, NumericsError> {
    let mut units = Vec::with_capacity(at.len());
    for (k, &(min, max)) in bounds.iter().enumerate() {
        let mut probe = at.to_vec();
        // To the side where there is room.
        probe[k] =
            if at[k] < 0.5 * (min + max) { (at[k] + PROBE).min(max) } else { (at[k] - PROBE).max(min) };
        let step = probe[k] - at[k];
        let moved = walk.slopes(&probe)?[k];
        let curvature = if step == 0.0 { 1.0 } else { (moved - slopes[k]) / step };
        units.push(1.0 / curvature.abs().max(slopes[k].abs()).max(LEAST_CURVATURE).sqrt());
    }
    Ok(units)
}

/// One run of the optimizer, which leaves the best point in the walk.
fn run<'a, 'b>(
    walk: Walk<'a, 'b>,
    from: &[f64],
    bounds: &[(f64, f64)],
    max_evaluations: usize,
    least_gain: f64,
) -> Result<Walk<'a, 'b>, NumericsError> {
    if from.is_empty() || max_evaluations == 0 {
        return Ok(walk);
    }
    let from: Vec<f64> = from.iter().zip(&walk.units).map(|(x, unit)| x / unit).collect();
    let bounds: Vec<(f64, f64)> =
        bounds.iter().zip(&walk.units).map(|((min, max), unit)| (min / unit, max / unit)).collect();
    let tolerances = StopTols { ftol_abs: least_gain * walk.scale, ..StopTols::default() };
    let walk = RefCell::new(walk);
    let objective =
        |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| walk.borrow_mut().objective(x, gradient);
    let constraints: [&dyn Func<()>; 0] = [];
    // How it ends is seen from the slopes where it does.
    let _ = minimize(objective, &from, &bounds, &constraints, (), max_evaluations, Some(tolerances));
    let mut walk = walk.into_inner();
    match walk.error.take() {
        Some(error) => Err(error),
        None => Ok(walk),
    }
}

fn found(best: Best, bounds: &[(f64, f64)]) -> Found {
    let Best { logarithms, hyperparameters, score, gradient, slopes } = best;
    let converged = free_slopes(&logarithms, &slopes, bounds).all(|slope| slope.abs() <= FLAT);
    Found { logarithms, hyperparameters, score, gradient, converged }
}

/// Where a number is at a bound and would go on beyond it, there is no slope to follow: 0.
fn free_slopes<'a>(
    x: &'a [f64],
    slopes: &'a [f64],
    bounds: &'a [(f64, f64)],
) -> impl Iterator<Item = f64> + 'a {
    // At both, where the bounds are equal.
    x.iter().zip(slopes).zip(bounds).map(|((&x, &slope), &(min, max))| match slope {
        _ if slope > 0.0 && max - x <= near(x) => 0.0,
        _ if slope < 0.0 && x - min <= near(x) => 0.0,
        _ => slope,
    })
}

/// A bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Min,
    Max,
}

/// The bound that a number is at.
pub(super) fn side(x: f64, (min, max): (f64, f64)) -> Option<Side> {
    match x {
        _ if x - min <= near(x) => Some(Side::Min),
        _ if max - x <= near(x) => Some(Side::Max),
        _ => None,
    }
}

/// What a number at a bound may be off it.
fn near(x: f64) -> f64 {
    AT_BOUND * (1.0 + x.abs())
}
