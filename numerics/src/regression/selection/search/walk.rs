//! The objective that an optimizer sees.

use crate::error::{NumericsError, Result};
use crate::observer::Observer;
use crate::regression::selection::evaluation::space::Space;
use crate::regression::selection::evaluation::{Evaluator, State};
use crate::regression::selection::parameters::Hyperparameters;

/// Largest slope of a log likelihood by a logarithm that counts as none. What is left to gain is of the order
/// of its square.
const FLAT: f64 = 1e-2;

/// Relative distance to a bound within which a number is at the bound.
const AT_BOUND: f64 = 1e-9;

/// The end of a descent.
#[derive(Debug, Clone)]
pub(super) struct DescentEnd {
    pub(super) logarithms: Vec<f64>,
    pub(super) hyperparameters: Hyperparameters,
    pub(super) score: f64,
    /// The score on the scale of a log likelihood, plus the logarithm of the prior.
    pub(super) merit: f64,
    /// Derivatives of the score by the logarithms.
    pub(super) gradient: Vec<f64>,
    pub(super) converged: bool,
}

/// The objective for slsqp: −scale · merit, prior included, over log-hyperparameters divided by `units`.
pub(super) struct Walk<'a, 'b> {
    evaluator: &'a mut Evaluator<'b>,
    space: &'a Space,
    observer: &'a dyn Observer,
    pub(super) scale: f64,
    /// Unit of each logarithm.
    pub(super) units: Vec<f64>,
    at: Option<Point>,
    /// The best logarithms so far with their merit.
    pub(super) best: Option<(Vec<f64>, f64)>,
    pub(super) evaluations: usize,
    /// The error that ended the search.
    pub(super) error: Option<NumericsError>,
}

/// The last point that was evaluated.
struct Point {
    logarithms: Vec<f64>,
    hyperparameters: Hyperparameters,
    state: Option<State>,
    /// Derivatives of the score.
    gradient: Option<Vec<f64>>,
}

impl<'a, 'b> Walk<'a, 'b> {
    pub(super) fn new(
        evaluator: &'a mut Evaluator<'b>,
        space: &'a Space,
        observer: &'a dyn Observer,
    ) -> Self {
        let units = vec![1.0; space.n_free()];
        Self {
            evaluator,
            space,
            observer,
            scale: 1.0,
            units,
            at: None,
            best: None,
            evaluations: 0,
            error: None,
        }
    }

    /// Returns minus the merit, scaled, and writes its slopes. The result is infinite if no solver serves the
    /// hyperparameters. After an error the objective is flat, so that the optimizer ends without further
    /// work.
    pub(super) fn objective(&mut self, numbers: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let logarithms: Vec<f64> = numbers.iter().zip(&self.units).map(|(x, unit)| x * unit).collect();
        match self.evaluate(&logarithms, gradient) {
            Ok(value) => value,
            Err(error) => {
                self.error = Some(error);
                0.0
            }
        }
    }

    fn evaluate(&mut self, x: &[f64], gradient: Option<&mut [f64]>) -> Result<f64> {
        let mut slopes = vec![0.0; x.len()];
        let mut value = 0.0;
        if self.error.is_none() {
            let merit = self.merit(x)?;
            value = merit.map_or(f64::INFINITY, |merit| -self.scale * merit);
            if gradient.is_some() && merit.is_some() {
                slopes = self.slopes(x)?;
                // Slopes that are not finite would lead the optimizer to points that are not finite.
                slopes.iter_mut().filter(|slope| !slope.is_finite()).for_each(|slope| *slope = 0.0);
            }
        }
        if let Some(gradient) = gradient {
            let slopes = slopes.iter().zip(&self.units).map(|(slope, unit)| slope * unit);
            gradient.iter_mut().zip(slopes).for_each(|(g, slope)| *g = -self.scale * slope);
        }
        Ok(value)
    }

    /// Returns the merit at a point, or `None` if no solver serves it.
    pub(super) fn merit(&mut self, x: &[f64]) -> Result<Option<f64>> {
        if self.at.as_ref().is_none_or(|at| at.logarithms != x) {
            self.observer.checkpoint()?;
            let hyperparameters = self.space.at(x);
            self.at = None;
            let state = self.evaluator.score(&hyperparameters, self.observer)?;
            let state = state.filter(|state| self.evaluator.is_served(&hyperparameters, state));
            self.evaluations += 1;
            self.at = Some(Point { logarithms: x.to_vec(), hyperparameters, state, gradient: None });
        }
        let Some(Point { hyperparameters, state: Some(state), .. }) = &self.at else { return Ok(None) };
        let (merit, _) = self.evaluator.criterion().merit(state.score, self.evaluator.n_points());
        let merit = merit + self.space.log_prior(hyperparameters);
        if self.best.as_ref().is_none_or(|(_, best)| *best < merit) {
            self.best = Some((x.to_vec(), merit));
        }
        Ok(Some(merit))
    }

    /// Returns the slopes of the merit at a point.
    pub(super) fn slopes(&mut self, x: &[f64]) -> Result<Vec<f64>> {
        self.merit(x)?;
        let (criterion, n) = (self.evaluator.criterion(), self.evaluator.n_points());
        let Some(Point { hyperparameters, state: Some(state), gradient, .. }) = &mut self.at else {
            return Ok(vec![0.0; x.len()]);
        };
        let found = match gradient.take() {
            Some(found) => found,
            None => self.evaluator.gradient(self.space, hyperparameters, state, self.observer)?,
        };
        let (_, factor) = criterion.merit(state.score, n);
        let mut slopes: Vec<f64> = found.iter().map(|slope| factor * slope).collect();
        self.space.add_prior_slopes(hyperparameters, &mut slopes);
        *gradient = Some(found);
        Ok(slopes)
    }

    pub(super) fn best_logarithms(&self, start: &[f64]) -> Vec<f64> {
        self.best.as_ref().map_or_else(|| start.to_vec(), |best| best.0.clone())
    }

    /// Returns the best point within these bounds, or `None` if there is none. Leaves the evaluator there.
    pub(super) fn end(mut self, start: &[f64], bounds: &[(f64, f64)]) -> Result<Option<DescentEnd>> {
        let logarithms = self.best_logarithms(start);
        let slopes = self.slopes(&logarithms)?;
        let merit = self.merit(&logarithms)?.unwrap_or(f64::NEG_INFINITY);
        let Some(Point { hyperparameters, state: Some(state), gradient, .. }) = self.at else {
            return Ok(None);
        };
        let (score, gradient) = (state.score, gradient.unwrap_or_default());
        let converged = free_slopes(&logarithms, &slopes, bounds).all(|slope| slope.abs() <= FLAT);
        Ok(Some(DescentEnd { logarithms, hyperparameters, score, merit, gradient, converged }))
    }
}

/// Slopes that can be followed. They are 0 where a number is at a bound and would move beyond it.
pub(super) fn free_slopes<'a>(
    x: &'a [f64],
    slopes: &'a [f64],
    bounds: &'a [(f64, f64)],
) -> impl Iterator<Item = f64> + 'a {
    // If the bounds are equal, the number is at both.
    x.iter().zip(slopes).zip(bounds).map(|((&x, &slope), &(min, max))| match slope {
        _ if slope > 0.0 && max - x <= near(x) => 0.0,
        _ if slope < 0.0 && x - min <= near(x) => 0.0,
        _ => slope,
    })
}

/// Distance to a bound within which a number is at it.
pub(super) fn near(x: f64) -> f64 {
    AT_BOUND * (1.0 + x.abs())
}
