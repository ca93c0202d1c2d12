//! Fit of values at the points of a cloud.

use std::sync::Arc;

use super::resolved::{ChosenRecipe, Process};

use super::{FitPlan, FittedCloud, Lack};
use crate::http::fields::kernel::PlannedKernel;
use crate::http::problem::{Problem, from_numerics};
use crate::store::key::ValuesKey;
use crate::store::learned::LearnedKey;
use gramian_numerics::error::{NumericsError, SolverKind};
use gramian_numerics::kernel::Kernel;
use gramian_numerics::kernel::defaults::{DEFAULT_ALPHA, Purpose, default_fit};
use gramian_numerics::model::choose::AutoReason;
use gramian_numerics::model::{Recipe, ScaledProcess};
use gramian_numerics::observer::Observer;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::selection::{
    LearnedModel, Noise, ObservedCloud, is_table, learn, learn_mean,
};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::regularization::Regularization;

/// Values at the points of the client's cloud, with the key of their weights.
pub struct Values {
    /// Shape `[n]`. With k lists, each with a function of its own, shape `[k, n]`.
    pub list: Vec<f64>,
    /// Number k of lists, 1 for a single one.
    pub n_lists: usize,
    /// Key of the values and of the mean of their function.
    pub key: ValuesKey,
    /// Key of the results learned from the values and from the parameters that the request gives.
    pub(in crate::http::serve) learned_key: LearnedKey,
}

/// A fit of values, or of the operators that act on values.
pub struct PlannedValues {
    pub on: FittedCloud,
    pub(in crate::http::serve) kernel: Option<PlannedKernel>,
    pub(in crate::http::serve) regularization: Option<Regularization>,
    pub solver: SolverKind,
    /// Reason why the solver is local, where `auto` chose it.
    pub(in crate::http::serve) reason: Option<AutoReason>,
    pub(in crate::http::serve) mean: Mean,
    pub(in crate::http::serve) values: Option<Arc<Values>>,
    pub(in crate::http::serve) learned: Option<Arc<LearnedModel>>,
}

/// Values to learn from, with the parameters that are given.
pub struct Learning {
    cloud: Arc<Cloud>,
    sampling: Arc<Sampling>,
    values: Arc<Values>,
    mean: Mean,
    kernel: Option<Kernel>,
    regularization: Option<Regularization>,
}

impl PlannedValues {
    /// Largest number of length scales that the kernel may have: 1, or one for each axis.
    pub fn n_length_scales(&self) -> usize {
        let cloud = &self.on.stored.cloud;
        match &self.kernel {
            Some(PlannedKernel::Given(kernel)) => kernel.length_scales().map_or(1, <[f64]>::len),
            None if is_table(cloud) => cloud.dimension(),
            _ => 1,
        }
    }

    /// Whether the noise is given for each point.
    pub fn has_noise_variances(&self) -> bool {
        matches!(self.regularization, Some(Regularization::PerPoint(_)))
    }

    pub(in crate::http::serve) fn lack(&self) -> Option<Lack> {
        if self.unlearned().is_some() {
            return Some(Lack::Learned);
        }
        let is_given = matches!(self.kernel, Some(PlannedKernel::Given(_)));
        (!is_given && self.on.stored.scales().is_none()).then_some(Lack::Scales)
    }

    /// Returns the values, if the fit depends on them and nothing was learned from them yet.
    ///
    /// A kernel that is not given follows from the values. So does a mean, for a solver that never sees all
    /// of them at once.
    pub(in crate::http::serve) fn unlearned(&self) -> Option<&Arc<Values>> {
        let has_local_mean = self.mean != Mean::Zero && self.solver == SolverKind::Local;
        let decides = self.learned.is_none() && (self.kernel.is_none() || has_local_mean);
        self.values.as_ref().filter(|_| decides)
    }

    /// Returns the inputs for learning from values of this fit.
    ///
    /// # Errors
    /// Returns the errors of the given kernel.
    pub(in crate::http::serve) fn learning(
        &self,
        values: Arc<Values>,
        sampling: Arc<Sampling>,
    ) -> Result<Learning, Problem> {
        let kernel = self
            .kernel
            .as_ref()
            .map(|kernel| kernel.resolve(Some(sampling.scales()), Purpose::Values, self.on.pointers));
        Ok(Learning {
            cloud: self.on.stored.cloud.clone(),
            kernel: kernel.transpose()?,
            sampling,
            values,
            mean: self.mean,
            regularization: self.regularization.clone(),
        })
    }

    pub(super) fn resolve(self, observer: &dyn Observer) -> Result<FitPlan, Problem> {
        let Self { on, solver, reason, mean, values, learned, .. } = self;
        let refuse = |error| from_numerics(error, on.pointers);
        let is_learned = self.kernel.is_none() && learned.is_some();
        let has_learned_noise = is_learned && self.regularization.is_none();
        let scaled = match (&self.kernel, &learned) {
            (Some(kernel), _) => {
                let kernel = kernel.resolve(on.stored.scales(), Purpose::Values, on.pointers)?;
                ScaledProcess::of(kernel, self.regularization).map_err(refuse)?
            }
            (None, Some(learned)) => ScaledProcess::learned(learned, self.regularization).map_err(refuse)?,
            (None, None) => {
                let (kernel, alpha) = default_fit(on.scales()?, Purpose::Values, || 0.0).map_err(refuse)?;
                ScaledProcess::by_rule(kernel, alpha, self.regularization).map_err(refuse)?
            }
        };
        let ScaledProcess { kernel, regularization, scale } = scaled;
        let recipe = Recipe::of_values(solver, kernel, regularization);
        let process = Process { scale, is_learned, mean, values, learned, has_learned_noise };
        let recipe = ChosenRecipe { recipe, reason };
        FitPlan::of(on, recipe, process, observer)
    }
}

impl Learning {
    pub(in crate::http::serve) fn learn(
        &self,
        observer: &dyn Observer,
    ) -> Result<LearnedModel, NumericsError> {
        let observed = ObservedCloud {
            cloud: &self.cloud,
            sampling: &self.sampling,
            values: &self.values.list,
            noise: match &self.regularization {
                None if self.kernel.is_some() => Noise::Uniform(DEFAULT_ALPHA),
                None => Noise::Unknown,
                Some(Regularization::Uniform(alpha)) => Noise::Uniform(*alpha),
                Some(Regularization::PerPoint(variances)) => Noise::PerPoint(variances),
            },
            mean: self.mean,
        };
        match &self.kernel {
            None => learn(observed, observer),
            Some(kernel) => learn_mean(observed, kernel, observer),
        }
    }
}
