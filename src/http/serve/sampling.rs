//! What the positions of a cloud say, looked at once for all who leave it to the service.

use std::sync::Arc;

use super::plan::PlannedFit;
use crate::http::compute::{Admission, JobObserver};
use crate::http::problem::{Place, Problem};
use crate::http::serve::app::App;
use crate::numerics::defaults::Scales;
use crate::numerics::error::NumericsError;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::neighbours::Neighbours;
use crate::numerics::points::noise::{estimate_noise, noise_flops_needed};
use crate::store::clouds::StoredCloud;

/// Finds what a fit lacks of its cloud.
///
/// # Errors
/// 500 `internal` if the work was cancelled while somebody waits for it, which is a bug.
pub async fn sample(app: &Arc<App>, admission: &Arc<Admission>, fit: &PlannedFit) -> Result<(), Problem> {
    if fit.lacks_scales() {
        find_scales(app, admission, &fit.stored).await?;
    }
    if fit.lacks_noise() {
        let flops = noise_flops_needed(fit.stored.cloud.n_points(), fit.stored.cloud.dimension());
        let look = look(app, admission, &fit.stored, flops, |cloud, observer| {
            estimate_noise(cloud, &Neighbours::of(cloud), observer)
        });
        app.clouds.noise(admission.owner, &fit.stored, || look).await?;
    }
    Ok(())
}

/// Sees to it that the scales of a cloud are known.
///
/// # Errors
/// Those of [`sample`].
pub async fn find_scales(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    stored: &StoredCloud,
) -> Result<(), Problem> {
    let flops = Scales::flops_needed(stored.cloud.n_points(), stored.cloud.dimension());
    let look = look(app, admission, stored, flops, |cloud, observer| {
        Scales::of(cloud, &Neighbours::of(cloud), observer)
    });
    app.clouds.scales(admission.owner, stored, || look).await
}

/// A look at a cloud on the pool, which outlives whoever began it if others wait.
fn look<T: Send + 'static>(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    stored: &StoredCloud,
    flops: f64,
    at: impl FnOnce(&Cloud, &JobObserver) -> Result<T, NumericsError> + Send + 'static,
) -> impl Future<Output = Result<T, Problem>> + Send + 'static {
    let (app, admission, cloud) = (app.clone(), admission.clone(), stored.cloud.clone());
    async move {
        let outcome = app.compute.run(&admission, flops, move |observer| at(&cloud, observer)).await?.0;
        outcome.map_err(|error| Problem::from_numerics(error, Place::REQUEST))
    }
}
