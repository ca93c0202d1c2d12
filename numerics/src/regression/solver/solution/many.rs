//! Weights for many lists of values at once: solves and residuals in matrix products.

use std::borrow::Cow;

use faer::MatMut;

use super::Solution;
use super::candidate::Candidate;
use crate::error::{NumericsError, Result};
use crate::observer::{Observer, Stage};
use crate::regression::solver::trend::{Mean, Trend};
use crate::regression::solver::{Method, Solver};
use crate::regression::sums::many::values_of_each;

/// Number of lists that are solved together.
const LISTS_PER_BLOCK: usize = 256;

impl Solution {
    /// Computes [`Solution::with_mean`], without its outlier, for each of k lists of values `[k, n]`.
    ///
    /// # Errors
    /// [`NumericsError::LengthMismatch`] for a list that is incomplete. Also the errors of
    /// [`Solution::with_mean`].
    pub fn of_each(
        solver: &Solver,
        values: &[f64],
        mean: Mean,
        observer: &dyn Observer,
    ) -> Result<Vec<Self>> {
        let n = solver.n_points();
        let lists = values.chunks_exact(n);
        if !lists.remainder().is_empty() {
            solver.cloud().check_one_per_point(lists.remainder())?;
        }
        // The least squares of the fallback gain by a step of refinement for each list (`Solution::of`).
        if solver.method() != Method::Cholesky {
            return lists.map(|list| Self::with_mean(solver, list, mean, observer)).collect();
        }
        observer.enter(Stage::Solve);
        let trends = Trend::fit_each(solver, values, mean, observer)?;
        let rest = match &trends {
            None => Cow::Borrowed(values),
            Some(trends) => {
                let rest =
                    lists.zip(trends).flat_map(|(list, trend)| trend.removed_from(list, solver.cloud()));
                Cow::Owned(rest.collect())
            }
        };
        let mut solutions = Vec::with_capacity(rest.len() / n);
        for lists in rest.chunks(LISTS_PER_BLOCK * n) {
            Self::add_block(solver, lists, &mut solutions, observer)?;
        }
        for (solution, trend) in solutions.iter_mut().zip(trends.into_iter().flatten()) {
            solution.trend = Some(trend);
        }
        Ok(solutions)
    }

    fn add_block(
        solver: &Solver,
        lists: &[f64],
        solutions: &mut Vec<Self>,
        observer: &dyn Observer,
    ) -> Result<()> {
        let (n, cloud) = (solver.n_points(), solver.cloud());
        let mut weights = lists.to_vec();
        let columns = MatMut::from_column_major_slice_mut(&mut weights, n, lists.len() / n);
        solver.solve_in_place(columns, observer)?;
        if weights.iter().any(|weight| !weight.is_finite()) {
            return Err(NumericsError::WeightsOverflow);
        }
        let at_points = values_of_each(cloud, solver.kernel(), &weights, cloud, observer)?;
        let parts = lists.chunks_exact(n).zip(weights.chunks_exact(n)).zip(at_points.chunks_exact(n));
        for ((list, weights), at_points) in parts {
            let found = Candidate::evaluated(solver, list, weights.to_vec(), at_points.to_vec());
            solutions.push(if found.wants_refinement(solver, list) {
                Self::of(solver, list, observer)?
            } else {
                found.accept(solver, list, false)?.0
            });
        }
        Ok(())
    }
}
