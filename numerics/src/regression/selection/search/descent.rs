//! Ascent from one start to an optimum, by sequential quadratic programming in the box of logarithms (Kraft
//! 1988; the crate slsqp).
//!
//! The optimizer learns curvatures as it goes and begins with the same one for all numbers. Length scales of
//! axes that do not matter have slopes that fall with their square. Their curvatures are a millionth of those
//! of the noise, so the optimizer takes them for converged. Hence the search has two steps. First come
//! descents that stop there. The best of them is followed by one more, in which every number is measured by
//! its own curvature.

use std::cell::RefCell;

use slsqp::{Func, StopTols, minimize};

use super::walk::{DescentEnd, Walk, free_slopes, near};
use crate::error::Result;
use crate::observer::Observer;
use crate::regression::selection::evaluation::Evaluator;
use crate::regression::selection::evaluation::space::Space;

/// Least gain of a step, in log likelihood, below which a first descent ends. [`LAST_GAIN`] ends the last
/// one.
const LEAST_GAIN: f64 = 1e-6;
const LAST_GAIN: f64 = 1e-8;

/// Largest slope that is not followed.
const LEAST_SLOPE: f64 = 1e-6;

/// Largest number of last descents, each with new curvatures. They stop when one gains nothing.
const ROUNDS: usize = 3;

/// Difference of logarithms over which curvatures are measured.
const PROBE: f64 = 0.05;

/// Least curvature. A step is a slope divided by a curvature, and no side of a box is longer than a few
/// hundred.
const LEAST_CURVATURE: f64 = 1e-7;

/// Ascends the criterion from these logarithms. Returns the end of the ascent and the number of evaluations,
/// which `max_evaluations` limits. The end is `None` if the matrix is not positive definite at the start, or
/// if no solver would serve the start.
///
/// # Errors
/// `NumericsError::Cancelled`, and the errors of [`Evaluator::score`].
pub(super) fn descend(
    evaluator: &mut Evaluator<'_>,
    space: &Space,
    start: &[f64],
    max_evaluations: usize,
    observer: &dyn Observer,
) -> Result<(Option<DescentEnd>, usize)> {
    let mut walk = Walk::new(evaluator, space, observer);
    if walk.merit(start)?.is_none() {
        return Ok((None, walk.evaluations));
    }
    let bounds = space.bounds();
    let slopes = walk.slopes(start)?;
    let steepest = free_slopes(start, &slopes, &bounds).map(|slope| slope * slope).sum::<f64>().sqrt();
    // The first step is as long as the slope that the optimizer sees. With this scale it is 1, a factor of e.
    walk.scale = 1.0 / steepest.max(LEAST_SLOPE);
    let left = max_evaluations.saturating_sub(walk.evaluations);
    let walk = run(walk, start, &bounds, left, LEAST_GAIN)?;
    let evaluations = walk.evaluations;
    Ok((walk.end(start, &bounds)?, evaluations))
}

/// Ascends further from the end of a descent, in units of curvatures. Leaves the evaluator at the result.
///
/// # Errors
/// Returns the errors of [`descend`].
pub(super) fn finish(
    evaluator: &mut Evaluator<'_>,
    space: &Space,
    from: DescentEnd,
    max_evaluations: usize,
    observer: &dyn Observer,
) -> Result<(DescentEnd, usize)> {
    let (bounds, start) = (space.bounds(), from.logarithms.clone());
    let mut walk = Walk::new(evaluator, space, observer);
    let mut merit = walk.merit(&start)?.unwrap_or(f64::NEG_INFINITY);
    // The evaluation at the start was counted before.
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
    Ok((walk.end(&start, &bounds)?.unwrap_or(from), evaluations))
}

/// Returns a unit for each logarithm, `1/√|h|`, in which the curvature at an optimum is 1. The curvature h
/// comes from differences of slopes. Its magnitude is at least that of the slope, for numbers that tend to
/// infinity.
fn units(walk: &mut Walk<'_, '_>, at: &[f64], slopes: &[f64], bounds: &[(f64, f64)]) -> Result<Vec<f64>> {
    let mut units = Vec::with_capacity(at.len());
    for (k, &(min, max)) in bounds.iter().enumerate() {
        let mut probe = at.to_vec();
        // The probe goes to the side with more room.
        probe[k] =
            if at[k] < 0.5 * (min + max) { (at[k] + PROBE).min(max) } else { (at[k] - PROBE).max(min) };
        let step = probe[k] - at[k];
        let moved = walk.slopes(&probe)?[k];
        let curvature = if step == 0.0 { 1.0 } else { (moved - slopes[k]) / step };
        units.push(1.0 / curvature.abs().max(slopes[k].abs()).max(LEAST_CURVATURE).sqrt());
    }
    Ok(units)
}

/// Runs the optimizer once. The best point stays in the walk.
fn run<'a, 'b>(
    walk: Walk<'a, 'b>,
    from: &[f64],
    bounds: &[(f64, f64)],
    max_evaluations: usize,
    least_gain: f64,
) -> Result<Walk<'a, 'b>> {
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
    // The status is ignored. Slopes at the end show whether the optimizer converged.
    let _ = minimize(objective, &from, &bounds, &constraints, (), max_evaluations, Some(tolerances));
    let mut walk = walk.into_inner();
    match walk.error.take() {
        Some(error) => Err(error),
        None => Ok(walk),
    }
}

/// The bound of its range that a number has reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Min,
    Max,
}

/// Returns the bound that a number is at.
pub(super) fn side(x: f64, min: f64, max: f64) -> Option<Side> {
    match x {
        _ if x - min <= near(x) => Some(Side::Min),
        _ if max - x <= near(x) => Some(Side::Max),
        _ => None,
    }
}
