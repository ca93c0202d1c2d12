//! From one start to an optimum: sequential quadratic programming in the box of logarithms (Kraft 1988; the crate slsqp).

use std::cell::RefCell;

use slsqp::{Func, StopTols, minimize};

use super::criterion::Criterion;
use super::evaluation::{Evaluator, State};
use super::parameters::{Hyperparameters, Space};
use crate::numerics::error::NumericsError;
use crate::numerics::observer::Observer;

/// A descent ends where a step gains less than this in a log likelihood.
const LEAST_GAIN: f64 = 1e-7;

/// Slopes of a log likelihood in logarithms up to here count as none: what is left to gain is of the order of their square.
const FLAT: f64 = 1e-2;

/// Slopes up to here are not followed.
const LEAST_SLOPE: f64 = 1e-6;

/// Descents from where the last one ended, each without what that had learned of the curvature.
const ROUNDS: usize = 5;

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
/// [`NumericsError::Cancelled`]; those of [`Hyperparameters::stretched`].
pub(super) fn descend(
    evaluator: &mut Evaluator<'_>,
    space: &Space,
    start: &[f64],
    max_evaluations: usize,
    observer: &dyn Observer,
) -> Result<(Option<Found>, usize), NumericsError> {
    let mut walk =
        Walk { evaluator, space, observer, scale: 1.0, at: None, best: None, evaluations: 0, error: None };
    let Some(first) = walk.merit(start)? else { return Ok((None, walk.evaluations)) };
    let bounds = space.bounds();
    let mut merit = first;
    let walk = RefCell::new(walk);
    for _ in 0..ROUNDS {
        let from = walk.borrow().best_logarithms(start);
        let left = max_evaluations.saturating_sub(walk.borrow().evaluations);
        let slopes = walk.borrow_mut().slopes(&from)?;
        let steepest = free_slopes(&from, &slopes, &bounds).map(|slope| slope * slope).sum::<f64>().sqrt();
        if left == 0 || steepest <= LEAST_SLOPE {
            break;
        }
        // The first step is as long as the slope that the optimizer sees: a factor of e. With less, scales that tend to infinity, whose slopes
        // fall with their square, would seem to have arrived.
        walk.borrow_mut().scale = 1.0 / steepest;
        run(&walk, &from, &bounds, left);
        if let Some(error) = walk.borrow_mut().error.take() {
            return Err(error);
        }
        let best = walk.borrow().best.as_ref().map_or(merit, |best| best.1);
        if best - merit <= LEAST_GAIN {
            break;
        }
        merit = best;
    }
    walk.into_inner().end(start, &bounds)
}

/// One run of the optimizer, which leaves the best point in the walk.
fn run(walk: &RefCell<Walk<'_, '_>>, from: &[f64], bounds: &[(f64, f64)], max_evaluations: usize) {
    let objective =
        |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| walk.borrow_mut().objective(x, gradient);
    let tolerance = LEAST_GAIN * walk.borrow().scale;
    let constraints: [&dyn Func<()>; 0] = [];
    let tolerances = StopTols { ftol_abs: tolerance, ..StopTols::default() };
    // How it ends is seen from the slopes where it does.
    let _ = minimize(objective, from, bounds, &constraints, (), max_evaluations, Some(tolerances));
}

/// What the optimizer sees: minus the merit, scaled.
struct Walk<'a, 'b> {
    evaluator: &'a mut Evaluator<'b>,
    space: &'a Space,
    observer: &'a dyn Observer,
    scale: f64,
    at: Option<Point>,
    best: Option<(Vec<f64>, f64)>,
    evaluations: usize,
    error: Option<NumericsError>,
}

/// The last point that was looked at.
struct Point {
    logarithms: Vec<f64>,
    hyperparameters: Hyperparameters,
    state: Option<State>,
    /// Of the score.
    gradient: Option<Vec<f64>>,
}

impl Walk<'_, '_> {
    /// Minus the merit and its slopes; infinite where the matrix is not positive definite. After an error everything is flat, so that the
    /// optimizer ends without any work.
    fn objective(&mut self, x: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        match self.evaluate(x, gradient) {
            Ok(value) => value,
            Err(error) => {
                self.error = Some(error);
                0.0
            }
        }
    }

    fn evaluate(&mut self, x: &[f64], gradient: Option<&mut [f64]>) -> Result<f64, NumericsError> {
        let mut slopes = vec![0.0; x.len()];
        let mut value = 0.0;
        if self.error.is_none() {
            let merit = self.merit(x)?;
            value = merit.map_or(f64::INFINITY, |merit| -self.scale * merit);
            if gradient.is_some() && merit.is_some() {
                slopes = self.slopes(x)?;
            }
        }
        if let Some(gradient) = gradient {
            gradient.iter_mut().zip(slopes).for_each(|(g, slope)| *g = -self.scale * slope);
        }
        Ok(value)
    }

    /// The merit at a point; `None` where the matrix is not positive definite.
    fn merit(&mut self, x: &[f64]) -> Result<Option<f64>, NumericsError> {
        if self.at.as_ref().is_none_or(|at| at.logarithms != x) {
            self.observer.checkpoint()?;
            let hyperparameters = self.space.at(x);
            self.at = None;
            let state = self.evaluator.score(&hyperparameters, self.observer)?;
            self.evaluations += 1;
            self.at = Some(Point { logarithms: x.to_vec(), hyperparameters, state, gradient: None });
        }
        let Some(state) = self.at.as_ref().and_then(|at| at.state.as_ref()) else { return Ok(None) };
        let (merit, _) = self.criterion().merit(state.score, self.evaluator.n_points());
        if self.best.as_ref().is_none_or(|(_, best)| *best < merit) {
            self.best = Some((x.to_vec(), merit));
        }
        Ok(Some(merit))
    }

    /// The slopes of the merit at a point.
    fn slopes(&mut self, x: &[f64]) -> Result<Vec<f64>, NumericsError> {
        self.merit(x)?;
        let (criterion, n) = (self.criterion(), self.evaluator.n_points());
        let Some(Point { hyperparameters, state: Some(state), gradient, .. }) = &mut self.at else {
            return Ok(vec![0.0; x.len()]);
        };
        let found = match gradient.take() {
            Some(found) => found,
            None => self.evaluator.gradient(self.space, hyperparameters, state, self.observer)?,
        };
        let (_, factor) = criterion.merit(state.score, n);
        let slopes = found.iter().map(|slope| factor * slope).collect();
        *gradient = Some(found);
        Ok(slopes)
    }

    fn criterion(&self) -> Criterion {
        self.evaluator.criterion()
    }

    fn best_logarithms(&self, start: &[f64]) -> Vec<f64> {
        self.best.as_ref().map_or_else(|| start.to_vec(), |best| best.0.clone())
    }

    /// The best point with its slopes.
    fn end(mut self, start: &[f64], bounds: &[(f64, f64)]) -> Result<(Option<Found>, usize), NumericsError> {
        let logarithms = self.best_logarithms(start);
        let slopes = self.slopes(&logarithms)?;
        let converged = is_flat(&logarithms, &slopes, bounds);
        let evaluations = self.evaluations;
        let Some(Point { hyperparameters, state: Some(state), gradient, .. }) = self.at else {
            return Ok((None, evaluations));
        };
        let (score, gradient) = (state.score, gradient.unwrap_or_default());
        Ok((Some(Found { logarithms, hyperparameters, score, gradient, converged }), evaluations))
    }
}

/// Where a number is at a bound and would go on beyond it, there is no slope to follow: 0.
fn free_slopes<'a>(
    x: &'a [f64],
    slopes: &'a [f64],
    bounds: &'a [(f64, f64)],
) -> impl Iterator<Item = f64> + 'a {
    x.iter().zip(slopes).zip(bounds).map(|((&x, &slope), &bounds)| match side(x, bounds) {
        Some(Side::Max) if slope > 0.0 => 0.0,
        Some(Side::Min) if slope < 0.0 => 0.0,
        _ => slope,
    })
}

fn is_flat(x: &[f64], slopes: &[f64], bounds: &[(f64, f64)]) -> bool {
    free_slopes(x, slopes, bounds).all(|slope| slope.abs() <= FLAT)
}

/// A bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Min,
    Max,
}

/// The bound that a number is at.
pub(super) fn side(x: f64, (min, max): (f64, f64)) -> Option<Side> {
    let near = AT_BOUND * (1.0 + x.abs());
    match x {
        _ if x - min <= near => Some(Side::Min),
        _ if max - x <= near => Some(Side::Max),
        _ => None,
    }
}
