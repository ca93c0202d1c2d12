//! Values of a group given those of others, without what the others explain.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{MatMut, Par};

use super::order::Conditional;
use super::values::Values;
use crate::kernel::Kernel;
use crate::points::cloud::Cloud;
use crate::regression::sums::gram::fill_kernel_column;
use crate::regression::sums::nodes::Nodes;

/// A conditional with the data for comparing kernels on it.
pub(super) struct Group {
    cloud: Cloud,
    nodes: Nodes,
    n_given: usize,
    /// Functions of the mean, then lists of values, at the points: `[n, p + k]` column by column.
    columns: Vec<f64>,
    /// Noise variances in units of their mean. `None` unless they are given per point.
    noise: Option<Vec<f64>>,
}

/// Noise that is added to the covariances of a process of variance 1.
#[derive(Clone, Copy)]
pub(super) struct Nugget {
    /// Mean variance of the noise.
    pub(super) ratio: f64,
    /// Least variance at each point, so that points without noise may coincide.
    pub(super) least: f64,
}

/// Functions and values of the responses without what the given values explain: rows of `L⁻¹[F Y]`, L the
/// Cholesky factor of the group. The unit is the deviation that is left of the process.
pub(super) struct WhitenedGroup {
    /// `[r, p + k]`, column by column.
    pub(super) columns: Vec<f64>,
    /// `ln det` of the covariance of the responses given the others, for a process of variance 1.
    pub(super) log_determinant: f64,
}

impl Group {
    pub(super) fn of(values: &Values<'_>, conditional: &Conditional) -> Self {
        let Conditional { points, n_given } = conditional;
        let cloud = values.observed.cloud.select(points);
        let mut columns = values.basis.columns(&cloud);
        let lists = 0..values.n_lists();
        columns.extend(lists.flat_map(|list| points.iter().map(move |&point| values.at(list, point))));
        Self {
            nodes: Nodes::of(&cloud),
            cloud,
            n_given: *n_given,
            columns,
            noise: values.relative_noise(points),
        }
    }

    pub(super) fn n_responses(&self) -> usize {
        self.cloud.n_points() - self.n_given
    }

    /// Returns the whitened responses. `None` if the matrix is not positive definite in float64.
    pub(super) fn whitened(&self, kernel: &Kernel, nugget: Nugget) -> Option<WhitenedGroup> {
        let (n, given) = (self.cloud.n_points(), self.n_given);
        let mut gram = self.gram(kernel, nugget);
        let mut factor = MatMut::from_column_major_slice_mut(&mut gram, n, n);
        let requirement = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
        let mut scratch = MemBuffer::new(requirement);
        let scratch = MemStack::new(&mut scratch);
        llt::factor::cholesky_in_place(
            factor.rb_mut(),
            Default::default(),
            Par::Seq,
            scratch,
            Default::default(),
        )
        .ok()?;
        let mut columns = self.columns.clone();
        let right = MatMut::from_column_major_slice_mut(&mut columns, n, self.columns.len() / n);
        solve_lower_triangular_in_place(factor.rb(), right, Par::Seq);
        let log_determinant = (given..n).map(|i| factor[(i, i)].ln()).sum::<f64>() * 2.0;
        let columns = columns.chunks_exact(n).flat_map(|column| &column[given..]).copied().collect();
        Some(WhitenedGroup { columns, log_determinant })
    }

    /// Returns the lower triangle of the covariances under a kernel of variance 1.
    fn gram(&self, kernel: &Kernel, nugget: Nugget) -> Vec<f64> {
        let n = self.cloud.n_points();
        let mut gram = vec![0.0; n * n];
        for (j, column) in gram.chunks_exact_mut(n).enumerate() {
            fill_kernel_column(&self.nodes, kernel, self.cloud.point(j), j..n, &mut column[j..]);
            let relative = self.noise.as_ref().map_or(1.0, |noise| noise[j]);
            column[j] += (nugget.ratio * relative).max(nugget.least);
        }
        gram
    }
}
