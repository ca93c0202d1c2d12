//! A kernel that all groups agree with.

use super::Learned;
use super::grid::{Cell, Grid, N_FAMILIES};
use super::search::Search;
use crate::error::NumericsError;
use crate::observer::Observer;

/// How many times the variance of all groups that of the deep ones may be.
const DISAGREEING: f64 = 1.5;

/// All groups, and those that are given more, if there are such.
pub(super) struct Agreement<'a> {
    pub(super) all: Search<'a>,
    pub(super) deep: Option<Search<'a>>,
    pub(super) grid: &'a Grid,
    /// Unit V.
    pub(super) unit: f64,
}

/// What both kinds of groups say of a cell.
struct Verdict {
    learned: Learned,
    /// Whether those that are given more have about the same variance.
    is_of_groups: bool,
    /// Whether the values of no place contradict it.
    is_of_places: bool,
}

impl Agreement<'_> {
    /// What the best cells of families come to.
    ///
    /// The best one is taken, with the shortest length scale that values leave open; a shorter one where
    /// groups that are given more contradict its variance, or the values of some place do, which have a
    /// feature that it does not expect.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`], [`NumericsError::WeightsOverflow`] of values whose square leaves
    /// float64.
    pub(super) fn decided(
        &mut self,
        best: [Cell; N_FAMILIES],
        observer: &dyn Observer,
    ) -> Result<Option<Learned>, NumericsError> {
        let best = self.best(best, observer)?;
        let mut cell = self.all.shortest(best, observer)?;
        let (mut of_groups, mut last) = (None, None);
        loop {
            if let Some(Verdict { learned, is_of_groups, is_of_places }) = self.verdict(cell, observer)? {
                match (is_of_groups, is_of_places) {
                    (true, true) => return Ok(Some(learned)),
                    (true, false) if of_groups.is_none() => of_groups = Some(learned),
                    _ => last = Some(learned),
                }
            }
            let shorter = self.all.shorter(cell, observer)?;
            let is_local = |cell: &Cell| of_groups.is_none() || self.grid.is_longer_than_outliers(*cell);
            match shorter.filter(is_local) {
                Some(shorter) => cell = shorter,
                // Where groups do not agree with any, the variance that most ask for has to do.
                None => return Ok(of_groups.or(last)),
            }
        }
    }

    /// The first of the best by all groups.
    fn best(&mut self, cells: [Cell; N_FAMILIES], observer: &dyn Observer) -> Result<Cell, NumericsError> {
        let mut best = (cells[0], f64::INFINITY);
        for cell in cells {
            let height = self.height(cell, observer)?;
            if height < best.1 {
                best = (cell, height);
            }
        }
        Ok(best.0)
    }

    fn height(&mut self, cell: Cell, observer: &dyn Observer) -> Result<f64, NumericsError> {
        let of_deep = self.deep.as_mut().map_or(Ok(0.0), |deep| deep.height(cell, observer))?;
        Ok(self.all.height(cell, observer)? + of_deep)
    }

    /// `None` if it does not explain the values in float64.
    fn verdict(&mut self, cell: Cell, observer: &dyn Observer) -> Result<Option<Verdict>, NumericsError> {
        let Some(all) = self.all.score(cell, observer)? else { return Ok(None) };
        let deep = match &mut self.deep {
            Some(deep) => deep.score(cell, observer)?,
            None => Some(all),
        };
        let Some(deep) = deep else { return Ok(None) };
        let variance = all.variance.max(deep.variance);
        Ok(Some(Verdict {
            learned: self.grid.learned(cell, variance, self.unit)?,
            is_of_groups: deep.variance <= DISAGREEING * all.variance,
            is_of_places: all.of_places.max(deep.of_places) <= variance,
        }))
    }
}
