//! Search for the likeliest cell of the grid.

use super::grid::{Cell, Grid, N_CELLS, N_FAMILIES, ROUGHEST, Step, along_ridge};
use super::likelihood::{Evidence, Score};
use crate::error::Result;
use crate::observer::Observer;

/// Strides along the ratio axis of the grid, for a search without a first guess. Strides along the length
/// axis are half, rounded up.
const STRIDES: [isize; 3] = [4, 2, 1];

/// Strides of a search that begins at the result on some of the values.
const FINE: [isize; 1] = [1];

/// Least decrease of the negative log posterior that counts as a gain, in nats.
const GAIN: f64 = 1e-6;

/// Largest loss in log posterior, in nats, at which a kernel is as good a guess as the best one.
const AS_LIKELY: f64 = 1.0;

/// Scores of cells, computed on demand.
pub(super) struct Search<'a> {
    evidence: &'a Evidence<'a>,
    grid: &'a Grid,
    observer: &'a dyn Observer,
    /// `None` until computed. `Some(None)` if the cell does not explain the values.
    scores: Vec<Option<Option<Score>>>,
}

impl<'a> Search<'a> {
    pub(super) fn new(evidence: &'a Evidence<'a>, grid: &'a Grid, observer: &'a dyn Observer) -> Self {
        Self { evidence, grid, observer, scores: vec![None; N_CELLS] }
    }

    /// Finds the best cell of each family. `None` if no kernel explains the values in float64.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn best(&mut self) -> Result<Option<[Cell; N_FAMILIES]>> {
        let Some(mut from) = self.likeliest(self.grid.starts())? else { return Ok(None) };
        let mut best = [from; N_FAMILIES];
        for (family, best) in best.iter_mut().enumerate() {
            // Each family starts from the best cell of the previous one.
            from = self.descend(self.grid.of_family(from, family), &STRIDES)?;
            // A long length scale may explain rough values as noise. A rough field with the least noise is
            // tried too. Smoother families start from the better of both.
            if family == ROUGHEST && self.is_mostly_noise(from)? {
                let rough = self.descend(self.grid.rough(family), &STRIDES)?;
                from = self.likeliest([from, rough].into_iter())?.unwrap_or(from);
            }
            *best = from;
        }
        let is_explained = best.iter().any(|cell| self.scores[cell.slot()].flatten().is_some());
        Ok(is_explained.then_some(best))
    }

    /// Finds the best cell of each family near one that was found on some of the values.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn best_from(&mut self, found: Cell) -> Result<[Cell; N_FAMILIES]> {
        let first = self.descend(found, &FINE)?;
        let mut best = [first; N_FAMILIES];
        for (family, best) in best.iter_mut().enumerate().filter(|(family, _)| *family != first.family) {
            *best = self.descend(self.grid.of_family(first, family), &FINE)?;
        }
        Ok(best)
    }

    /// Finds the shortest length scale of all kernels of a family that are [`AS_LIKELY`] as the best one.
    ///
    /// A band from the best kernel alone is too narrow, since where values leave ℓ open the best ℓ is mostly
    /// too long. For each ℓ, the noise is the likeliest one.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn shortest(&mut self, best: Cell) -> Result<Cell> {
        let limit = self.negative_log_posterior(best)? + AS_LIKELY;
        let mut found = best;
        while let Some(next) = self.shorter(found)? {
            if self.negative_log_posterior(next)? > limit {
                break;
            }
            found = next;
        }
        Ok(found)
    }

    /// Finds the next shorter length scale with the likeliest noise for it, if there is one.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn shorter(&mut self, cell: Cell) -> Result<Option<Cell>> {
        let straight = self.grid.moved(cell, Step { lengths: -1, ratios: 0 });
        let along = self.grid.moved(cell, along_ridge(cell.family, -1));
        match self.likeliest(straight.into_iter().chain(along))? {
            Some(from) => self.line(from, Step { lengths: 0, ratios: 1 }).map(Some),
            None => Ok(None),
        }
    }

    fn is_mostly_noise(&mut self, cell: Cell) -> Result<bool> {
        let Some(score) = self.score(cell)? else { return Ok(false) };
        Ok(self.against_noise(cell, score) > 0.0)
    }

    /// Returns the cell with the greatest posterior, the first of equals.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn likeliest(&mut self, cells: impl Iterator<Item = Cell>) -> Result<Option<Cell>> {
        let mut best = None;
        for cell in cells {
            let negative_log = self.negative_log_posterior(cell)?;
            if best.is_none_or(|(_, least)| negative_log < least) {
                best = Some((cell, negative_log));
            }
        }
        Ok(best.map(|(cell, _)| cell))
    }

    /// Moves in every direction that gains, with one stride after the other.
    fn descend(&mut self, mut at: Cell, strides: &[isize]) -> Result<Cell> {
        for &stride in strides {
            let lengths = (stride + 1) / 2;
            let across = [Step { lengths: 0, ratios: stride }, Step { lengths, ratios: 0 }];
            let directions = [across[0], across[1], along_ridge(at.family, lengths)];
            let mut is_moving = true;
            while is_moving {
                is_moving = false;
                for direction in directions {
                    let next = self.line(at, direction)?;
                    is_moving |= next != at;
                    at = next;
                }
            }
        }
        Ok(at)
    }

    /// Moves along a direction or against it as long as that gains. Steps double while they gain.
    fn line(&mut self, begin: Cell, direction: Step) -> Result<Cell> {
        for sign in [1, -1] {
            let (mut at, mut factor) = (begin, sign);
            while let Some(next) = self.grid.moved(at, direction.times(factor)) {
                if self.negative_log_posterior(next)? >= self.negative_log_posterior(at)? - GAIN {
                    break;
                }
                at = next;
                factor *= 2;
            }
            if at != begin {
                return Ok(at);
            }
        }
        Ok(begin)
    }

    /// Returns `−ln(likelihood · prior on noise)`, up to a constant. Infinite if the cell does not explain
    /// the values in float64.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn negative_log_posterior(&mut self, cell: Cell) -> Result<f64> {
        let Some(score) = self.score(cell)? else { return Ok(f64::INFINITY) };
        Ok(score.negative_log + self.against_noise(cell, score))
    }

    fn against_noise(&self, cell: Cell, score: Score) -> f64 {
        self.grid.against_noise(cell, score.variance, self.evidence.values.mean_square)
    }

    /// Returns the score of a cell. `None` if it does not explain the values in float64.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn score(&mut self, cell: Cell) -> Result<Option<Score>> {
        if let Some(known) = self.scores[cell.slot()] {
            return Ok(known);
        }
        let found = match self.grid.kernel(cell) {
            Some((kernel, ratio)) => {
                let variance = self.grid.variance(cell, self.evidence.values.unit);
                self.evidence.score(&kernel, ratio, variance, self.observer)?
            }
            None => None,
        };
        self.scores[cell.slot()] = Some(found);
        Ok(found)
    }
}
