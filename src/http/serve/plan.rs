//! The fit of a request: checked as far as the request goes, and then with everything that follows from the cloud.

use std::borrow::Cow;
use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::http::fields::DuplicatePolicy;
use crate::http::fields::kernel::PlannedKernel;
use crate::http::problem::{Pointers, Problem};
use crate::http::state::app::FitFailure;
use crate::store::Owner;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::FitKey;
use crate::store::learned::LearnedKey;
use gramian_numerics::defaults::{DEFAULT_ALPHA, Purpose, default_fit};
use gramian_numerics::error::SolverKind;
use gramian_numerics::error::{NotDefinite, NumericsError};
use gramian_numerics::kernel::Kernel as NumericalKernel;
use gramian_numerics::observer::Observer;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::duplicates::Merge;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::selection::{Learned, Noise, Observed, learn, learn_mean};
use gramian_numerics::solver::Disagreement;
use gramian_numerics::solver::choose::{AutoLocal, Choice, Price, choose, choose_local, choose_moving};
use gramian_numerics::solver::trend::{Mean, Trend};
use gramian_numerics::sums::regularization::Regularization;

/// A fit that is checked as far as the request goes; what is left out follows from the cloud.
pub struct PlannedFit {
    pub owner: Owner,
    pub stored: Arc<RegisteredCloud>,
    pub pointers: Pointers,
    pub(super) kernel: Option<PlannedKernel>,
    pub(super) regularization: Option<Regularization>,
    pub(super) duplicates: DuplicatePolicy,
    pub(super) purpose: Purpose,
    pub(super) way: Way,
    /// Those of a fit of values.
    pub(super) values: Option<Box<PlannedValues>>,
    pub(super) mean: Mean,
}

/// Values, and what is learned from them.
pub(super) struct PlannedValues {
    pub(super) values: Arc<Vec<f64>>,
    pub(super) key: LearnedKey,
    pub(super) learned: Option<Arc<Learned>>,
}

/// Values to learn from, with what is known beforehand.
pub(super) struct Learning {
    cloud: Arc<Cloud>,
    sampling: Arc<Sampling>,
    values: Arc<Vec<f64>>,
    mean: Mean,
    kernel: Option<NumericalKernel>,
    regularization: Option<Regularization>,
}

impl Learning {
    pub(super) fn learn(&self, observer: &dyn Observer) -> Result<Learned, NumericsError> {
        let observed = Observed {
            cloud: &self.cloud,
            sampling: &self.sampling,
            values: &self.values,
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

/// How a fit is served.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Way {
    /// By a factorization of the whole matrix.
    Dense,
    /// Values from the points nearest to each query.
    Moving(LocalReason),
    /// A surface by local regressions, which learn at sites, if these are given.
    Regressions { reason: LocalReason, sites: Option<Arc<Cloud>> },
}

/// Why a fit is served locally.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalReason {
    Asked,
    Auto(AutoLocal),
}

impl PlannedFit {
    /// Points that are factorized at most: without the duplicates that may be merged.
    pub fn n_points(&self) -> usize {
        self.stored.cloud.n_points()
    }

    /// Lists of values, each with one for every point.
    pub fn n_lists(&self) -> usize {
        self.values.as_ref().map_or(0, |values| values.values.len() / self.n_points())
    }

    /// Length scales of the kernel: 1, or one for each axis.
    pub fn n_length_scales(&self) -> usize {
        match &self.kernel {
            Some(PlannedKernel::Given(kernel)) => kernel.length_scales().map_or(1, <[f64]>::len),
            _ => 1,
        }
    }

    /// Whether the surface is regressed locally.
    pub fn is_local(&self) -> bool {
        matches!(self.way, Way::Regressions { .. })
    }

    /// Whether values come from the points nearest to each query.
    pub fn is_moving(&self) -> bool {
        matches!(self.way, Way::Moving(_))
    }

    /// Whether the noise is given for each point.
    pub fn has_noise_variances(&self) -> bool {
        matches!(self.regularization, Some(Regularization::PerPoint(_)))
    }

    /// Whether something decides that is not known yet.
    pub fn lacks_anything(&self) -> bool {
        self.lacks_scales() || self.lacks_noise() || self.lacks_learned()
    }

    /// Whether the lengths of the cloud decide, and are not known yet.
    fn lacks_scales(&self) -> bool {
        !self.is_local()
            && !matches!(self.kernel, Some(PlannedKernel::Given(_)))
            && self.stored.scales().is_none()
    }

    /// Whether the noise of the points decides, and is not known yet.
    pub fn lacks_noise(&self) -> bool {
        self.needs_noise() && self.stored.noise().is_none()
    }

    /// Whether the values decide, and were not looked at yet.
    pub fn lacks_learned(&self) -> bool {
        self.needs_learned() && self.values.as_ref().is_some_and(|values| values.learned.is_none())
    }

    /// A kernel that is not given follows from the values; so does a mean for a solver that never sees all of them at once.
    fn needs_learned(&self) -> bool {
        let has_moving_mean = self.mean != Mean::Zero && self.is_moving();
        self.purpose == Purpose::Values && (self.kernel.is_none() || has_moving_mean)
    }

    /// What is to be learned from the values of this fit.
    ///
    /// # Errors
    /// Those of the kernel that is given.
    pub(super) fn learning(&self, sampling: Arc<Sampling>) -> Result<Learning, Problem> {
        let values = self.values.as_ref().ok_or_else(Problem::internal)?;
        let kernel = self
            .kernel
            .as_ref()
            .map(|kernel| kernel.resolve(Some(sampling.scales()), self.purpose, self.pointers));
        Ok(Learning {
            cloud: self.stored.cloud.clone(),
            kernel: kernel.transpose()?,
            sampling,
            values: values.values.clone(),
            mean: self.mean,
            regularization: self.regularization.clone(),
        })
    }

    fn needs_noise(&self) -> bool {
        !self.is_local()
            && self.kernel.is_none()
            && self.regularization.is_none()
            && self.purpose != Purpose::Values
    }

    /// Fills in what is left out, once the cloud has what it lacks.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn resolve(self) -> Result<FitPlan, Problem> {
        let (owner, pointers, is_moving) = (self.owner, self.pointers, self.is_moving());
        let Self { stored, way, .. } = self;
        if let Way::Regressions { reason, sites } = way {
            let key = FitKey::of_local(owner, stored.id, sites.as_deref());
            let (fitted, model) = (stored.cloud.clone(), FitModel::Local { reason, sites });
            let (scale, is_learned, mean) = (1.0, false, Mean::Zero);
            return Ok(FitPlan {
                stored,
                fitted,
                merge: None,
                model,
                key,
                pointers,
                scale,
                is_learned,
                mean,
                learned: None,
            });
        }
        let refuse = |error| Problem::from_numerics(error, pointers);
        let (mean, learned) = (self.mean, self.values.and_then(|values| values.learned));
        let (kernel, regularization, scale) = match (&self.kernel, &learned) {
            (Some(kernel), _) => {
                let kernel = kernel.resolve(stored.scales(), self.purpose, pointers)?;
                let regularization = given_or(self.regularization, DEFAULT_ALPHA).map_err(refuse)?;
                of_variance_one(kernel, regularization).map_err(refuse)?
            }
            (None, Some(learned)) => by_values(learned, self.regularization).map_err(refuse)?,
            (None, None) => {
                let scales = stored.scales().ok_or_else(Problem::internal)?;
                // With a regularization given, nothing follows from it.
                let noise = || stored.noise().unwrap_or_default();
                let (kernel, alpha) = default_fit(scales, self.purpose, noise).map_err(refuse)?;
                (kernel, given_or(self.regularization, alpha).map_err(refuse)?, 1.0)
            }
        };
        kernel.check_dimension(stored.cloud.dimension()).map_err(refuse)?;
        let merges =
            self.duplicates == DuplicatePolicy::Merge && regularization == Regularization::Uniform(0.0);
        let merged = if merges { Merge::duplicates_of(&stored.cloud) } else { None };
        let solver = if is_moving { SolverKind::Local } else { SolverKind::Dense };
        let key = FitKey::of(solver, owner, stored.id, &kernel, &regularization, merged.is_some());
        let (fitted, merge) = match merged {
            None => (stored.cloud.clone(), None),
            Some((cloud, merge)) => (Arc::new(cloud), Some(Arc::new(merge))),
        };
        let model = match way {
            Way::Moving(reason) => FitModel::Moving { kernel, regularization, reason },
            Way::Dense | Way::Regressions { .. } => FitModel::Dense { kernel, regularization },
        };
        let is_learned = self.kernel.is_none() && learned.is_some();
        Ok(FitPlan { stored, fitted, merge, model, key, pointers, scale, is_learned, mean, learned })
    }
}

fn given_or(given: Option<Regularization>, alpha: f64) -> Result<Regularization, NumericsError> {
    given.map_or_else(|| Regularization::uniform(alpha), Ok)
}

/// Ratios of noise to variance that lose no digit.
const RATIOS: RangeInclusive<f64> = 1e-280..=1e280;

/// Kernel and noise for a process of variance 1, and the variance by which both are scaled afterwards: the factor depends on their ratio alone,
/// and serves values of any size. Noise per point stays as it is.
fn of_variance_one(
    kernel: NumericalKernel,
    regularization: Regularization,
) -> Result<(NumericalKernel, Regularization, f64), NumericsError> {
    let variance = kernel.variance();
    match regularization {
        Regularization::Uniform(alpha) if alpha == 0.0 || RATIOS.contains(&(alpha / variance)) => {
            Ok((kernel.of_variance_one(), Regularization::uniform(alpha / variance)?, variance))
        }
        Regularization::Uniform(_) | Regularization::PerPoint(_) => Ok((kernel, regularization, 1.0)),
    }
}

/// The kernel that was learned, with the noise, likewise.
fn by_values(
    learned: &Learned,
    given: Option<Regularization>,
) -> Result<(NumericalKernel, Regularization, f64), NumericsError> {
    let Learned { family, length_scale, ratio, variance, .. } = *learned;
    match given_or(given, ratio * variance)? {
        // A variance that is learned may leave what kernels take.
        Regularization::Uniform(alpha) => {
            let unit = NumericalKernel::new(family, length_scale, 1.0)?;
            Ok((unit, Regularization::uniform(alpha / variance)?, variance))
        }
        per_point => Ok((NumericalKernel::new(family, length_scale, variance)?, per_point, 1.0)),
    }
}

/// A fit whose inputs are checked and whose cost is known and admitted.
#[derive(Clone)]
pub struct FitPlan {
    pub stored: Arc<RegisteredCloud>,
    /// The cloud that is factorized: without the merged duplicates.
    pub fitted: Arc<Cloud>,
    pub merge: Option<Arc<Merge>>,
    pub model: FitModel,
    pub key: FitKey,
    pub pointers: Pointers,
    /// Kernel and noise are so many times those of the model, unit V².
    pub scale: f64,
    /// Whether the values decided kernel and noise.
    pub is_learned: bool,
    pub mean: Mean,
    /// Kernel, noise and mean as learned from the values; their mean alone where kernel and noise are given.
    learned: Option<Arc<Learned>>,
}

/// What is fitted.
#[derive(Debug, Clone)]
pub enum FitModel {
    Dense {
        kernel: NumericalKernel,
        regularization: Regularization,
    },
    /// Kriging from the points nearest to each query.
    Moving {
        kernel: NumericalKernel,
        regularization: Regularization,
        reason: LocalReason,
    },
    /// Local regressions, which choose all that they need, as it is at sites, if these are given.
    Local {
        reason: LocalReason,
        sites: Option<Arc<Cloud>>,
    },
}

impl FitPlan {
    /// Kernel, noise and mean as learned from values that are never seen all at once.
    fn learned_of_moving(&self) -> Option<&Learned> {
        self.learned.as_deref().filter(|_| matches!(self.model, FitModel::Moving { .. }))
    }

    /// The mean of such values.
    pub fn trend(&self) -> Option<&Trend> {
        self.learned_of_moving()?.trend.as_ref()
    }

    /// How values contradict kernel and noise, as far as that was seen when they were learned from: of values
    /// that a solver sees all at once, it says the rest.
    pub fn disagreement(&self) -> Option<Disagreement> {
        let found = self.learned.as_ref()?.disagreement?;
        (self.learned_of_moving().is_some() || found.place.is_some()).then_some(found)
    }

    /// Whether the values are so small that their variance is taken to be greater than it is.
    pub fn has_least_variance(&self) -> bool {
        self.is_learned && self.learned.as_ref().is_some_and(|learned| learned.has_least_variance())
    }

    /// The client's normals at the points that are factorized: means over merged duplicates.
    pub fn fitted_normals(&self) -> Option<Cow<'_, Cloud>> {
        let normals = self.stored.normals.as_ref()?;
        let Some(merge) = &self.merge else { return Some(Cow::Borrowed(normals)) };
        let d = normals.dimension();
        let component = |c: usize| normals.points().map(|normal| normal[c]).collect::<Vec<f64>>();
        let means: Vec<Vec<f64>> = (0..d).map(|c| merge.mean(&component(c))).collect();
        let interleaved = (0..self.fitted.n_points()).flat_map(|point| means.iter().map(move |m| m[point]));
        Cloud::new(interleaved.collect(), d).ok().map(Cow::Owned)
    }

    /// Where local regressions learn, if that is given.
    pub fn sites(&self) -> Option<&Cloud> {
        match &self.model {
            FitModel::Local { sites, .. } => sites.as_deref(),
            FitModel::Dense { .. } | FitModel::Moving { .. } => None,
        }
    }

    /// The solver of this fit with what it and the surface take, within so many bytes of memory.
    pub fn choice(&self, memory: usize) -> Choice {
        let (n, d) = (self.fitted.n_points(), self.fitted.dimension());
        match self.model {
            FitModel::Dense { .. } => choose(n, d, memory),
            FitModel::Moving { ref kernel, .. } => {
                choose_moving(n, d, self.merge.is_some(), kernel.is_stretched())
            }
            FitModel::Local { .. } => choose_local(n, d),
        }
    }

    /// A refusal of the numerics, with pointers into this fit and points as the client numbers them.
    pub fn refused(&self, mut error: NumericsError) -> Problem {
        use NumericsError::{KernelNotSmooth, NotPositiveDefinite};
        if let Some(merge) = &self.merge
            && let KernelNotSmooth { point, .. }
            | NotPositiveDefinite { reason: NotDefinite::NeedsCholesky { point }, .. } = &mut error
        {
            *point = merge.first_point(*point);
        }
        if let NotPositiveDefinite { minimum_alpha, .. } = &mut error {
            *minimum_alpha *= self.scale;
        }
        Problem::from_numerics(error, self.pointers)
    }

    /// Why there is no factorization, with pointers into this request.
    pub fn failed(&self, failure: FitFailure) -> Problem {
        match failure {
            FitFailure::Refused(error) => self.refused(error),
            FitFailure::Broken(problem) => problem,
            // Whoever is told so tries again with all of the memory.
            FitFailure::NeedsAll => Problem::internal(),
        }
    }
}

/// What answering takes beside what the fits take.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// The work, and what lies on the way to the answer.
    pub work: Price,
    /// Numbers of the answer.
    pub n_numbers: usize,
    /// Numbers of the request beside its clouds: values and queries.
    pub n_held: usize,
}

impl Cost {
    /// Bytes of the answer as numbers, once more while it is put together, and of what leads to it.
    pub fn n_bytes(&self) -> usize {
        self.n_numbers.saturating_mul(2 * size_of::<f64>()).saturating_add(self.work.n_bytes)
    }
}
