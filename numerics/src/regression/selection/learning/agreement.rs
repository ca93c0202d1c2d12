//! A kernel with which all groups of values agree.

use super::LearnedModel;
use super::grid::{Cell, Grid, N_FAMILIES};
use super::search::Search;
use crate::error::Result;

/// Largest ratio of the variance of the deep groups to that of all groups.
const DISAGREEING: f64 = 1.5;

/// Searches on all groups and on the deep ones, which are given more points, if there are any.
pub(super) struct Agreement<'a> {
    pub(super) all: Search<'a>,
    pub(super) deep: Option<Search<'a>>,
    pub(super) grid: &'a Grid,
    /// Unit of the values, V.
    pub(super) unit: f64,
}

/// A cell that is decided for.
pub(super) struct CellChoice {
    pub(super) learned: LearnedModel,
    /// `−ln(likelihood · prior on noise)` of all groups, up to a constant of the values.
    pub(super) negative_log: f64,
}

/// Verdict of all groups and of the deep ones on a cell.
struct Verdict {
    decided: CellChoice,
    /// True if the deep groups have about the same variance as all groups.
    is_of_groups: bool,
    /// True if the values of no place contradict the cell.
    is_of_places: bool,
}

impl Agreement<'_> {
    /// Decides between the best cells of the families.
    ///
    /// The best cell is taken, with the shortest length scale that the values leave open. A still shorter one
    /// is taken if the deep groups contradict its variance, or if the values of some place do. Such a place
    /// has a feature that the cell does not expect.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`. `NumericsError::WeightsOverflow` for values whose squares exceed
    /// float64.
    pub(super) fn decided(&mut self, best: [Cell; N_FAMILIES]) -> Result<Option<CellChoice>> {
        let best = self.best(best)?;
        let mut cell = self.all.shortest(best)?;
        let (mut of_groups, mut last) = (None, None);
        loop {
            if let Some(Verdict { decided, is_of_groups, is_of_places }) = self.verdict(cell)? {
                match (is_of_groups, is_of_places) {
                    (true, true) => return Ok(Some(decided)),
                    (true, false) if of_groups.is_none() => of_groups = Some(decided),
                    _ => last = Some(decided),
                }
            }
            let shorter = self.all.shorter(cell)?;
            let is_local = |cell: &Cell| of_groups.is_none() || self.grid.is_longer_than_outliers(*cell);
            match shorter.filter(is_local) {
                Some(shorter) => cell = shorter,
                // No cell suits all groups and places: the first one that suits the groups is taken, or else
                // the last one.
                None => return Ok(of_groups.or(last)),
            }
        }
    }

    /// Returns the best cell by all groups, the first of equals.
    fn best(&mut self, cells: [Cell; N_FAMILIES]) -> Result<Cell> {
        let mut best = (cells[0], f64::INFINITY);
        for cell in cells {
            let negative_log = self.negative_log_posterior(cell)?;
            if negative_log < best.1 {
                best = (cell, negative_log);
            }
        }
        Ok(best.0)
    }

    /// Returns the sum over all groups and the deep ones.
    fn negative_log_posterior(&mut self, cell: Cell) -> Result<f64> {
        let of_deep = self.deep.as_mut().map_or(Ok(0.0), |deep| deep.negative_log_posterior(cell))?;
        Ok(self.all.negative_log_posterior(cell)? + of_deep)
    }

    /// Returns the verdict on a cell, or `None` if it does not explain the values in float64.
    fn verdict(&mut self, cell: Cell) -> Result<Option<Verdict>> {
        let Some(all) = self.all.score(cell)? else { return Ok(None) };
        let deep = match &mut self.deep {
            Some(deep) => deep.score(cell)?,
            None => Some(all),
        };
        let Some(deep) = deep else { return Ok(None) };
        let variance = all.variance.max(deep.variance);
        Ok(Some(Verdict {
            decided: CellChoice {
                learned: self.grid.learned(cell, variance, self.unit)?,
                negative_log: self.all.negative_log_posterior(cell)?,
            },
            is_of_groups: deep.variance <= DISAGREEING * all.variance,
            is_of_places: all.of_places.max(deep.of_places) <= variance,
        }))
    }
}
