//! A grid of kernels that are compared on values, taken in an order.

use super::agreement::{Agreement, CellChoice};
use super::grid::Grid;
use super::likelihood::Evidence;
use super::order::Order;
use super::search::Search;
use super::values::Values;
use super::{LearnedModel, ObservedCloud};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::observer::Observer;
use crate::points::sampling::Sampling;

/// Values in groups, and the kernels to compare on them.
pub(super) struct Comparison<'a> {
    values: &'a Values<'a>,
    all: Evidence<'a>,
    order: Order,
    grid: Grid,
}

impl<'a> Comparison<'a> {
    /// Prepares a comparison of kernels with one length scale for all columns.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn of(values: &'a Values<'a>, observer: &dyn Observer) -> Result<Self> {
        let order = Order::of(&values.observed, observer)?;
        Ok(Self { values, all: Evidence::of(values, &order.searched), order, grid: Grid::of(values) })
    }

    /// Prepares a comparison of kernels whose length scales are multiples of these, `[d]`. Points are near
    /// each other if they are near in units of these scales.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn of_columns(
        values: &'a Values<'a>,
        scales: &[f64],
        observer: &dyn Observer,
    ) -> Result<Self> {
        let factors: Vec<f64> = scales.iter().map(|scale| 1.0 / scale).collect();
        let cloud = values.observed.cloud.stretched(&factors);
        let sampling = Sampling::of(&cloud, observer)?;
        let stretched = ObservedCloud { cloud: &cloud, sampling: &sampling, ..values.observed };
        let order = Order::of(&stretched, observer)?;
        let grid = Grid::of_columns(values, scales.to_vec(), sampling.scales().spacing);
        Ok(Self { values, all: Evidence::of(values, &order.searched), order, grid })
    }

    /// Searches the grid on all values, or on a sample and from there on all values in groups. `None` if no
    /// kernel explains the values in float64.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`. `NumericsError::WeightsOverflow` for values whose squares exceed
    /// float64.
    pub(super) fn decided(&self, observer: &dyn Observer) -> Result<Option<CellChoice>> {
        let Self { values, all, order, grid } = self;
        let deep = Evidence::of(values, &order.deep);
        let mut agreement = Agreement {
            all: Search::new(all, grid, observer),
            deep: (!order.deep.is_empty()).then(|| Search::new(&deep, grid, observer)),
            grid,
            unit: values.unit,
        };
        let best = match order.searched.as_slice() {
            [first, _, ..] => {
                let sample = Evidence::of(values, std::slice::from_ref(first));
                let mut on_sample = Search::new(&sample, grid, observer);
                let Some(best) = on_sample.best()? else { return Ok(None) };
                let Some(begin) = on_sample.likeliest(best.into_iter())? else { return Ok(None) };
                Some(agreement.all.best_from(begin)?)
            }
            _ => agreement.all.best()?,
        };
        best.map_or(Ok(None), |best| agreement.decided(best))
    }

    /// Returns the kernel and noise for values that do not decide.
    pub(super) fn undecided(&self) -> LearnedModel {
        self.grid.undecided(self.values)
    }

    /// Adds the mean of the values, and how they contradict what was decided.
    ///
    /// # Errors
    /// Returns the errors of [`Evidence::concluded`].
    pub(super) fn concluded(
        &self,
        kernel: &Kernel,
        decided: LearnedModel,
        observer: &dyn Observer,
    ) -> Result<LearnedModel> {
        self.all.concluded(kernel, decided, observer)
    }
}
