//! Rows by which a model is selected: without those that repeat an earlier one.

use std::borrow::Cow;

use crate::http::fields::Diagnostics;
use crate::http::serve::answers::repeated_rows;
use crate::http::serve::plan::FitPlan;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::duplicates::{Merge, row_copies};
use gramian_numerics::regression::selection::LeaveOneOut;

/// Points with their values, and where the rows of the client are among them.
pub(super) struct Rows<'a> {
    pub(super) cloud: Cow<'a, Cloud>,
    pub(super) values: Cow<'a, [f64]>,
    merge: Option<Cow<'a, Merge>>,
    /// Number of rows that the fit before the search counted and that the search does not.
    n_found: usize,
}

impl<'a> Rows<'a> {
    /// Returns the rows of a fit. If the search is for the noise, rows that repeat point and value of an
    /// earlier one are left out: as measurements, they would say that there is no noise.
    pub(super) fn of(plan: &'a FitPlan, values: &'a [f64], finds_noise: bool) -> Self {
        let (cloud, values) = (&*plan.fitted, plan.merged(values));
        let copies =
            if finds_noise && plan.merge.is_none() { row_copies(cloud, &values) } else { Vec::new() };
        if copies.is_empty() {
            let merge = plan.merge.as_deref().map(Cow::Borrowed);
            return Self { cloud: Cow::Borrowed(cloud), values, merge, n_found: 0 };
        }
        let (cloud, merge) = Merge::copies(cloud, &copies);
        Self {
            cloud: Cow::Owned(cloud),
            values: Cow::Owned(merge.mean(&values)),
            n_found: merge.n_merged(),
            merge: Some(Cow::Owned(merge)),
        }
    }

    /// Says which rows were left out, unless the diagnostics do so already.
    pub(super) fn warn(&self, diagnostics: &mut Diagnostics) {
        if self.n_found > 0 {
            diagnostics.warnings.push(repeated_rows(self.n_found));
        }
    }

    /// Returns the predictions for all rows of the client. A row that repeats another has its prediction.
    pub(super) fn left_out(&self, found: LeaveOneOut) -> LeaveOneOut {
        let Some(merge) = &self.merge else { return found };
        LeaveOneOut {
            means: merge.repeated(&found.means),
            variances: merge.repeated(&found.variances),
            observation_variances: merge.repeated(&found.observation_variances),
            log_predictive_densities: merge.repeated(&found.log_predictive_densities),
        }
    }
}
