//! Probe before planning: whether few landmarks span a kernel.

use std::sync::Arc;

use super::Planner;
use super::choice::{FitOptions, pointers_of};
use crate::http::fields::kernel::PlannedKernel;
use crate::http::fields::{CloudInput, DuplicatePolicy, HasCloud, SolverChoice};
use crate::http::problem::{Problem, from_numerics};
use crate::http::serve::plan::FittedCloud;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::{CloudId, process_key};
use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::Kernel;
use gramian_numerics::kernel::defaults::DEFAULT_ALPHA;
use gramian_numerics::machine::price::Price;
use gramian_numerics::model::choose::{LANDMARKS_FROM, most_landmarks};
use gramian_numerics::observer::Observer;
use gramian_numerics::regression::solver::{DEFAULT_TOLERANCE, expected_landmarks, probe_price};
use gramian_numerics::regression::sums::regularization::Regularization;

/// What a request fits to values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValuesUse {
    /// Nothing.
    Nothing,
    /// A function on a surface. Up to the dense limit, both share one factorization of all points.
    OnSurface,
    /// A function.
    Alone,
}

/// The question how many landmarks a kernel needs at the points of a cloud.
pub struct LandmarkProbe {
    pub stored: Arc<RegisteredCloud>,
    kernel: Kernel,
    noise: Regularization,
    most: usize,
}

impl LandmarkProbe {
    /// The key of the answer among those of the cloud.
    pub fn key(&self) -> [u8; 32] {
        process_key(&self.kernel, &self.noise)
    }

    pub fn price(&self) -> Price {
        probe_price(self.stored.cloud.n_points(), self.stored.cloud.dimension(), self.most)
    }

    /// Returns the expected number of landmarks, or `None` if `auto` has no use for so many.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn run(&self, observer: &dyn Observer) -> Result<Option<usize>, NumericsError> {
        expected_landmarks(&self.stored.cloud, &self.kernel, &self.noise, self.most, observer)
    }
}

impl Planner<'_> {
    /// Returns the probe that has to run before the request can be planned, if `auto` may choose landmarks
    /// and their number is not known. Points of the request are registered.
    ///
    /// A kernel that is not given follows from cloud or values, and is rough.
    ///
    /// # Errors
    /// Returns the errors of [`Planner::cloud`], and 422 for a kernel or noise that is refused.
    pub fn landmark_probe(
        &mut self,
        request: &mut dyn HasCloud,
        values: ValuesUse,
    ) -> Result<Option<LandmarkProbe>, Problem> {
        let max_dense_points = self.app.config.max_dense_points;
        let least = match values {
            ValuesUse::Nothing => return Ok(None),
            ValuesUse::OnSurface => max_dense_points + 1,
            ValuesUse::Alone => LANDMARKS_FROM.min(max_dense_points + 1),
        };
        let process = request.process();
        if self.known.landmarks.is_some() || process.solver != SolverChoice::Auto || process.kernel.is_none()
        {
            return Ok(None);
        }
        let Some(stored) = self.registered_if_large(request.cloud_mut(), least)? else { return Ok(None) };
        let process = request.process();
        let pointers = pointers_of(request.cloud(), process.noise_variances.is_some());
        let Some(PlannedKernel::Given(kernel)) =
            process.kernel.map(|kernel| kernel.plan(pointers)).transpose()?
        else {
            return Ok(None);
        };
        kernel.check_dimension(stored.cloud.dimension()).map_err(|error| from_numerics(error, pointers))?;
        let options = FitOptions {
            alpha: process.alpha,
            noise_variances: process.noise_variances.cloned(),
            ..FitOptions::default()
        };
        let on = FittedCloud {
            owner: self.owner,
            stored: stored.clone(),
            pointers,
            duplicates: DuplicatePolicy::default(),
            tolerance: DEFAULT_TOLERANCE,
        };
        let noise = options.regularization(&on)?.unwrap_or(Regularization::Uniform(DEFAULT_ALPHA));
        let most = most_landmarks(&stored.cloud, &kernel, &noise, max_dense_points);
        let probe = LandmarkProbe { stored, kernel, noise, most };
        self.known.landmarks = if most == 0 { Some(None) } else { probe.stored.landmarks(probe.key()) };
        Ok(self.known.landmarks.is_none().then_some(probe))
    }

    /// Returns the cloud of a request if it has at least so many points, and registers its points. `None`
    /// also for a cloud that planning refuses.
    fn registered_if_large(
        &mut self,
        cloud: &mut CloudInput,
        least: usize,
    ) -> Result<Option<Arc<RegisteredCloud>>, Problem> {
        let stored = match (&cloud.id, &cloud.points) {
            (Some(id), None) => {
                let found = CloudId::parse(id).and_then(|id| self.registered(id));
                let Some(found) = found else { return Ok(None) };
                // The cache may evict it before the request is planned.
                self.known.clouds.push(found.clone());
                found
            }
            (None, Some(points)) if points.n_rows >= least => {
                let stored = self.cloud(std::mem::take(cloud), "/cloud")?;
                cloud.registered = Some(stored.clone());
                stored
            }
            _ => return Ok(None),
        };
        Ok(Some(stored).filter(|stored| stored.cloud.n_points() >= least))
    }
}
