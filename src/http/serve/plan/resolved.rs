//! A complete fit, with everything that its preparation depends on.

use std::borrow::Cow;
use std::sync::Arc;

use super::{FittedCloud, Values};
use crate::http::fields::DuplicatePolicy;
use crate::http::problem::{Pointers, Problem, from_numerics};
use crate::http::state::app::FitFailure;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::{FitKey, Merging};
use gramian_numerics::error::{NotDefinite, NumericsError};
use gramian_numerics::model::Recipe;
use gramian_numerics::model::choose::AutoReason;
use gramian_numerics::model::price::CloudSize;
use gramian_numerics::model::price::MakingPrice;
use gramian_numerics::observer::Observer;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::duplicates::{Merge, RowCopy};
use gramian_numerics::regression::selection::LearnedModel;
use gramian_numerics::regression::solver::Disagreement;
use gramian_numerics::regression::solver::trend::{Mean, Trend};
use gramian_numerics::regression::sums::regularization::Regularization;

/// A fit whose inputs are checked and whose cost is known and admitted.
#[derive(Clone)]
pub struct FitPlan {
    pub stored: Arc<RegisteredCloud>,
    /// Cloud that is factorized, without merged duplicates.
    pub fitted: Arc<Cloud>,
    pub merge: Option<Arc<Merge>>,
    pub recipe: Recipe,
    /// Reason why the solver is local, where `auto` chose it.
    pub reason: Option<AutoReason>,
    pub key: FitKey,
    pub pointers: Pointers,
    pub process: Process,
}

/// A recipe with the reason for its solver, where `auto` chose one.
pub(super) struct ChosenRecipe {
    pub recipe: Recipe,
    pub reason: Option<AutoReason>,
}

/// Assumed process of the values, besides the recipe.
#[derive(Clone)]
pub struct Process {
    /// Ratio of kernel and noise to those of the recipe, unit V².
    pub scale: f64,
    /// Whether the values decided kernel and noise.
    pub is_learned: bool,
    pub mean: Mean,
    pub values: Option<Arc<Values>>,
    /// Kernel, noise and mean learned from the values. If kernel and noise are given, only the mean was
    /// learned.
    pub(super) learned: Option<Arc<LearnedModel>>,
    /// Whether the noise was learned too.
    pub(super) has_learned_noise: bool,
}

impl Process {
    /// The rows that count once with the rows that they repeat, because noise was learned from the values.
    fn copies(&self) -> &[RowCopy] {
        self.learned.as_ref().filter(|_| self.has_learned_noise).map_or(&[], |learned| &learned.copies)
    }

    /// Number of rows that count once with the rows that they repeat.
    pub fn n_copies(&self) -> usize {
        self.copies().len()
    }
}

impl Default for Process {
    fn default() -> Self {
        Self {
            scale: 1.0,
            is_learned: false,
            mean: Mean::Zero,
            values: None,
            learned: None,
            has_learned_noise: false,
        }
    }
}

impl FitPlan {
    /// Merges duplicates if requested, and derives the key of the fit.
    pub(super) fn of(
        on: FittedCloud,
        chosen: ChosenRecipe,
        process: Process,
        observer: &dyn Observer,
    ) -> Result<Self, Problem> {
        let FittedCloud { owner, stored, pointers, duplicates, tolerance } = on;
        let ChosenRecipe { recipe, reason } = chosen;
        let recipe = recipe.with_tolerance(tolerance);
        let is_singular_at_duplicates = match recipe.process() {
            None => false,
            Some((kernel, regularization)) => {
                let is_checked = kernel.check_dimension(stored.cloud.dimension());
                is_checked.map_err(|error| from_numerics(error, pointers))?;
                *regularization == Regularization::Uniform(0.0)
            }
        };
        let merges = duplicates == DuplicatePolicy::Merge && is_singular_at_duplicates;
        let refused = |error| from_numerics(error, pointers);
        let merged = if merges {
            Merge::duplicates_of(&stored.cloud, observer).map_err(refused)?
        } else {
            let copies = process.copies();
            (!copies.is_empty()).then(|| Merge::copies(&stored.cloud, copies))
        };
        let merging = match (&merged, merges) {
            (None, _) => Merging::Nothing,
            (Some(_), true) => Merging::Duplicates,
            (Some(_), false) => Merging::Copies(process.copies()),
        };
        let key = FitKey::of(owner, stored.id, &recipe, merging);
        let (fitted, merge) = match merged {
            None => (stored.cloud.clone(), None),
            Some((cloud, merge)) => (Arc::new(cloud), Some(Arc::new(merge))),
        };
        Ok(Self { stored, fitted, merge, recipe, reason, key, pointers, process })
    }

    /// Returns what was learned from the values, for a solver that never sees all of them at once.
    fn learned_of_local(&self) -> Option<&LearnedModel> {
        self.process.learned.as_deref().filter(|_| self.recipe.is_kriged_locally())
    }

    /// Returns the learned mean, for a solver that never sees all values at once.
    pub fn trend(&self) -> Option<&Trend> {
        self.learned_of_local()?.trend.as_ref()
    }

    /// Returns the contradiction between the values and kernel and noise that was found while learning.
    ///
    /// A solver of all values reports outliers and the mean square itself, so only near values count for it.
    pub fn disagreement(&self) -> Option<Disagreement> {
        let found = self.process.learned.as_ref()?.disagreement?;
        (self.learned_of_local().is_some() || found.is_of_near_values()).then_some(found)
    }

    /// Returns whether the values are so small that a greater variance than theirs is assumed.
    pub fn has_least_variance(&self) -> bool {
        let Process { is_learned, learned, .. } = &self.process;
        *is_learned && learned.as_ref().is_some_and(|learned| learned.has_least_variance())
    }

    /// Returns the client's normals at the factorized points: means over merged duplicates.
    pub fn fitted_normals(&self) -> Option<Cow<'_, Cloud>> {
        let normals = self.stored.normals.as_ref()?;
        let Some(merge) = &self.merge else { return Some(Cow::Borrowed(normals)) };
        let d = normals.dimension();
        let component = |c: usize| normals.points().map(|normal| normal[c]).collect::<Vec<f64>>();
        let means: Vec<Vec<f64>> = (0..d).map(|c| merge.mean(&component(c))).collect();
        let interleaved = (0..self.fitted.n_points()).flat_map(|point| means.iter().map(move |m| m[point]));
        Cloud::new(interleaved.collect(), d).ok().map(Cow::Owned)
    }

    /// Returns the values at the factorized points: means over merged duplicates, list by list.
    pub fn merged<'a>(&self, values: &'a [f64]) -> Cow<'a, [f64]> {
        match &self.merge {
            None => Cow::Borrowed(values),
            Some(merge) => {
                let lists = values.chunks_exact(self.stored.cloud.n_points());
                Cow::Owned(lists.flat_map(|list| merge.mean(list)).collect())
            }
        }
    }

    /// The price of making the model and its surface ready.
    pub fn price(&self) -> MakingPrice {
        let (n_points, dimension) = (self.fitted.n_points(), self.fitted.dimension());
        self.recipe.price(CloudSize { n_points, dimension, is_merged: self.merge.is_some() })
    }

    /// Converts a refusal of the numerics. It gets pointers into this fit, and points as the client numbers
    /// them.
    pub fn refused(&self, mut error: NumericsError) -> Problem {
        use NumericsError::{KernelNotSmooth, NotPositiveDefinite};
        if let Some(merge) = &self.merge
            && let KernelNotSmooth { point, .. }
            | NotPositiveDefinite { reason: NotDefinite::NeedsCholesky { point }, .. } = &mut error
        {
            *point = merge.first_point(*point);
        }
        if let NotPositiveDefinite { minimum_alpha, .. } = &mut error {
            *minimum_alpha *= self.process.scale;
        }
        from_numerics(error, self.pointers)
    }

    /// Converts the failure of a fit, with pointers into this request.
    pub fn failed(&self, failure: FitFailure) -> Problem {
        match failure {
            FitFailure::Refused(error) => self.refused(error),
            FitFailure::Broken(problem) => problem,
            // A caller that gets this failure retries with all of the memory.
            FitFailure::NeedsAll => Problem::internal(),
        }
    }
}
