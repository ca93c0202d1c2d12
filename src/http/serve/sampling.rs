//! Facts about a cloud and its values that fits depend on, found once for all who ask.

use std::sync::Arc;

use super::plan::{Lack, PlannedFit, PlannedValues, Values};
use super::planner::LandmarkProbe;
use crate::http::problem::{Pointers, Problem, from_numerics};
use crate::http::state::app::App;
use crate::store::clouds::RegisteredCloud;
use gramian_host::compute::{Admission, JobObserver};
use gramian_numerics::error::NumericsError;
use gramian_numerics::points::noise::{estimate_noise, noise_flops};
use gramian_numerics::points::sampling::{Sampling, sampling_flops};
use gramian_numerics::regression::selection::{LearnedModel, learning_price};

/// Finds the facts about cloud or values that a fit lacks.
///
/// # Errors
/// - 413 `problem-too-large` if it takes more memory than there is.
/// - 500 `internal` if the work was cancelled while a request waits for it. That is a bug.
pub async fn find_lacking(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    fit: &mut PlannedFit,
) -> Result<(), Problem> {
    let on = fit.on();
    let sampling = find_sampling(app, admission, &on.stored).await?;
    match fit {
        PlannedFit::Surface(fit) if fit.lack() == Some(Lack::Noise) => {
            let stored = &fit.on.stored;
            let cloud = stored.cloud.clone();
            let flops = noise_flops(cloud.n_points(), cloud.dimension());
            let look = move |observer: &JobObserver| estimate_noise(&cloud, &sampling, observer);
            let looking = look_at(app, admission, flops, look);
            app.clouds.noise(admission.owner, stored, || looking).await?;
        }
        PlannedFit::Surface(_) => {}
        PlannedFit::Values(fit) => {
            let Some(values) = fit.unlearned().cloned() else { return Ok(()) };
            fit.learned = Some(find_learned(app, admission, fit, values, sampling).await?);
        }
    }
    Ok(())
}

/// Learns kernel, noise and mean of values.
async fn find_learned(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    fit: &PlannedValues,
    values: Arc<Values>,
    sampling: Arc<Sampling>,
) -> Result<Arc<LearnedModel>, Problem> {
    let (key, cloud) = (values.learned_key, &fit.on.stored.cloud);
    let price = learning_price(cloud, values.n_lists);
    let asked = fit.learning(values, sampling)?;
    let (shared, admitted) = (app.clone(), admission.clone());
    let looking = async move {
        let memory = shared.reserve(admitted.owner, price.n_bytes, || true).await?;
        // The memory goes with the job, which may run on for a moment after the last client has left.
        let learn = move |observer: &JobObserver| {
            let learned = asked.learn(observer);
            drop(memory);
            learned
        };
        look_at(&shared, &admitted, price.flops, learn).await
    };
    app.learned.get_or_learn(key, || looking).await
}

/// Finds the sampling of a cloud.
///
/// # Errors
/// Returns the errors of [`find_lacking`].
pub async fn find_sampling(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    stored: &RegisteredCloud,
) -> Result<Arc<Sampling>, Problem> {
    let cloud = stored.cloud.clone();
    let flops = sampling_flops(cloud.n_points(), cloud.dimension());
    let looking =
        look_at(app, admission, flops, move |observer: &JobObserver| Sampling::of(&cloud, observer));
    app.clouds.sampling(admission.owner, stored, || looking).await
}

/// Finds how many landmarks the kernel of a request needs.
///
/// # Errors
/// Returns the errors of [`find_lacking`].
pub async fn find_landmarks(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    probe: LandmarkProbe,
) -> Result<Option<usize>, Problem> {
    let (stored, key, price) = (probe.stored.clone(), probe.key(), probe.price());
    let (shared, admitted) = (app.clone(), admission.clone());
    let looking = async move {
        let memory = shared.reserve(admitted.owner, price.n_bytes, || true).await?;
        let look = move |observer: &JobObserver| {
            let found = probe.run(observer);
            drop(memory);
            found
        };
        look_at(&shared, &admitted, price.flops, look).await
    };
    app.clouds.landmarks(admission.owner, &stored, key, || looking).await
}

/// Runs work on a cloud on the pool. It outlives the request that began it, if others wait.
fn look_at<T: Send + 'static>(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    flops: f64,
    look: impl FnOnce(&JobObserver) -> Result<T, NumericsError> + Send + 'static,
) -> impl Future<Output = Result<T, Problem>> + Send + 'static {
    let (app, admission) = (app.clone(), admission.clone());
    async move {
        let outcome = app.compute.run(&admission, flops, look).await?.0;
        outcome.map_err(|error| from_numerics(error, Pointers::REQUEST))
    }
}
