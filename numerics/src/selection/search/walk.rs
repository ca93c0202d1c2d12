//! What an optimizer sees of a criterion.

use crate::error::NumericsError;
use crate::observer::Observer;
use crate::selection::evaluation::space::Space;
use crate::selection::evaluation::{Evaluator, State};
use crate::selection::parameters::Hyperparameters;

/// Minus the merit, scaled, of logarithms in units of their own.
pub(super) struct Walk<'a, 'b> {
    evaluator: &'a mut Evaluator<'b>,
    space: &'a Space,
    observer: &'a dyn Observer,
    pub(super) scale: f64,
    /// Of each logarithm.
    pub(super) units: Vec<f64>,
    at: Option<Point>,
    /// The best logarithms with their merit.
    pub(super) best: Option<(Vec<f64>, f64)>,
    pub(super) evaluations: usize,
    /// What ended the work.
    pub(super) error: Option<NumericsError>,
}

/// The last point that was looked at.
struct Point {
    logarithms: Vec<f64>,
    hyperparameters: Hyperparameters,
    state: Option<State>,
    /// Of the score.
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

    /// Minus the merit and its slopes; infinite where no solver serves the hyperparameters. After an error everything is flat, so that the
    /// optimizer ends without any work.
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

    fn evaluate(&mut self, x: &[f64], gradient: Option<&mut [f64]>) -> Result<f64, NumericsError> {
        let mut slopes = vec![0.0; x.len()];
        let mut value = 0.0;
        if self.error.is_none() {
            let merit = self.merit(x)?;
            value = merit.map_or(f64::INFINITY, |merit| -self.scale * merit);
            if gradient.is_some() && merit.is_some() {
                slopes = self.slopes(x)?;
                // The optimizer would go to places that are none.
                slopes.iter_mut().filter(|slope| !slope.is_finite()).for_each(|slope| *slope = 0.0);
            }
        }
        if let Some(gradient) = gradient {
            let slopes = slopes.iter().zip(&self.units).map(|(slope, unit)| slope * unit);
            gradient.iter_mut().zip(slopes).for_each(|(g, slope)| *g = -self.scale * slope);
        }
        Ok(value)
    }

    /// The merit at a point; `None` where no solver serves it.
    pub(super) fn merit(&mut self, x: &[f64]) -> Result<Option<f64>, NumericsError> {
        if self.at.as_ref().is_none_or(|at| at.logarithms != x) {
            self.observer.checkpoint()?;
            let hyperparameters = self.space.at(x);
            self.at = None;
            let state = self.evaluator.score(&hyperparameters, self.observer)?;
            let state = state.filter(|state| self.evaluator.is_served(&hyperparameters, state));
            self.evaluations += 1;
            self.at = Some(Point { logarithms: x.to_vec(), hyperparameters, state, gradient: None });
        }
        let Some(state) = self.at.as_ref().and_then(|at| at.state.as_ref()) else { return Ok(None) };
        let (merit, _) = self.evaluator.criterion().merit(state.score, self.evaluator.n_points());
        if self.best.as_ref().is_none_or(|(_, best)| *best < merit) {
            self.best = Some((x.to_vec(), merit));
        }
        Ok(Some(merit))
    }

    /// The slopes of the merit at a point.
    pub(super) fn slopes(&mut self, x: &[f64]) -> Result<Vec<f64>, NumericsError> {
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
        let slopes = found.iter().map(|slope| factor * slope).collect();
        *gradient = Some(found);
        Ok(slopes)
    }

    pub(super) fn best_logarithms(&self, start: &[f64]) -> Vec<f64> {
        self.best.as_ref().map_or_else(|| start.to_vec(), |best| best.0.clone())
    }

    /// The best point with its score and the slopes of score and merit; the evaluator is left there. `None` if there is none.
    pub(super) fn end(mut self, start: &[f64]) -> Result<Option<Best>, NumericsError> {
        let logarithms = self.best_logarithms(start);
        let slopes = self.slopes(&logarithms)?;
        let Some(Point { hyperparameters, state: Some(state), gradient, .. }) = self.at else {
            return Ok(None);
        };
        let (score, gradient) = (state.score, gradient.unwrap_or_default());
        Ok(Some(Best { logarithms, hyperparameters, score, gradient, slopes }))
    }
}

/// Where a walk ended.
pub(super) struct Best {
    pub(super) logarithms: Vec<f64>,
    pub(super) hyperparameters: Hyperparameters,
    pub(super) score: f64,
    /// Of the score.
    pub(super) gradient: Vec<f64>,
    /// Of the merit.
    pub(super) slopes: Vec<f64>,
}
