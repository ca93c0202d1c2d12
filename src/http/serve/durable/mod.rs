//! Requests and clouds that outlive the process: memory and threads for the work of store/clouds/, and its
//! answers to clients.

pub mod factors;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, SystemTime};

use bytes::Bytes;

use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use crate::http::state::app::App;
use crate::http::state::durable::Durable;
use crate::store::clouds::{CloudLookup, CloudPage, Holder, RegisteredCloud, StoreOutcome};
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::{decode, encode, object_bytes};
use crate::store::objects::{ListWindow, Swept};
use gramian_host::memory::Owner;
use gramian_host::memory::budget::Reservation;
use gramian_host::store::changes::{SECONDS_UNTIL_BACK, to_its_end, unavailable};
use gramian_host::store::{OwnerName, Unavailable};

/// Interval between sweeps of the store, unless it grows beyond its limit earlier.
const SWEEPING: Duration = Duration::from_secs(600);

/// Least time between two sweeps. Once the store is full, every new cloud takes it over its limit.
const BETWEEN_SWEEPS: Duration = Duration::from_secs(1);

/// Memory for reading a cloud, in sizes of its object: the pieces as they come, one whole, and the numbers.
const READING: usize = 3;

/// Time for which a cloud in memory is assumed to be still stored. Another process may have deleted it there.
pub const TRUST: Duration = Duration::from_secs(10);

/// Time for which an object waits for memory before the request is refused.
const MEMORY_TIMEOUT: Duration = Duration::from_secs(1);

/// Flops for hashing and copying one byte.
const FLOPS_PER_BYTE: f64 = 8.0;

fn holder_of(app: &App, owner: Owner) -> Holder {
    Holder { owner, name: app.keys.name_of(owner) }
}

/// Returns a cloud of an owner, from memory or from the store. A read takes no place among computations: the
/// memory for it is reserved.
///
/// # Errors
/// 503 if the store does not answer, or there is no memory for the cloud.
pub async fn find_cloud(
    app: &Arc<App>,
    owner: Owner,
    id: CloudId,
) -> Result<Option<Arc<RegisteredCloud>>, Problem> {
    let Some(Durable { objects, .. }) = &app.durable else { return Ok(app.clouds.get(owner, id)) };
    match app.clouds.recall(objects, &holder_of(app, owner), id, TRUST).await {
        CloudLookup::InMemory(cloud) => return Ok(Some(cloud)),
        CloudLookup::Gone => {
            forget_results(app, owner, id);
            return Ok(None);
        }
        CloudLookup::Unknown => {}
    }
    let read = || read_cloud(app.clone(), owner, id);
    app.clouds.get_or_read(owner, id, read).await
}

async fn read_cloud(
    app: Arc<App>,
    owner: Owner,
    id: CloudId,
) -> Result<Option<Arc<RegisteredCloud>>, Problem> {
    let Some(Durable { objects, .. }) = &app.durable else { return Ok(None) };
    let holder = holder_of(&app, owner);
    let refused = |error: Unavailable| unavailable(&error);
    let Some(n_bytes) = objects.cloud_bytes(&holder.name, id).await.map_err(refused)? else {
        return Ok(None);
    };
    let memory = reserve_for_reading(&app, holder.owner, id, n_bytes).await?;
    let Some(bytes) = objects.get_cloud(&holder.name, id).await.map_err(refused)? else { return Ok(None) };
    let job = move || (decode(id, &bytes), memory);
    let flops = n_bytes as f64 * FLOPS_PER_BYTE;
    let (read, _memory) = app.compute.run_without_place(owner, flops, job).await?;
    app.clouds.take_in(objects, &holder, id, read).await.map_err(refused)
}

/// Reserves the memory for reading an object of `n_bytes` bytes.
async fn reserve_for_reading(
    app: &App,
    owner: Owner,
    id: CloudId,
    n_bytes: u64,
) -> Result<Reservation, Problem> {
    let n_reserved = usize::try_from(n_bytes).map_or(usize::MAX, |n| n.saturating_mul(READING));
    if n_reserved > app.intake.largest() {
        // Such an object is damaged, or was written when the service had more memory.
        tracing::error!(cloud = %id, n_bytes, "a stored cloud needs more memory than one cloud may take");
        return Err(Problem::internal());
    }
    let mut memory = app.intake.try_reserve(owner, 0).ok_or_else(Problem::internal)?;
    if app.intake.grow(&mut memory, n_reserved, MEMORY_TIMEOUT).await {
        Ok(memory)
    } else {
        Err(app.compute.out_of_memory())
    }
}

/// Writes clouds that only memory holds.
///
/// A store that does not take them is reported, and they are offered to it again. Memory serves them
/// meanwhile. A cloud that neither store nor memory can hold is dropped once its request is answered.
pub async fn keep_all(app: &Arc<App>, owner: Owner, clouds: &[Arc<RegisteredCloud>]) {
    for cloud in clouds {
        if keep(app, owner, cloud).await.is_err() {
            tracing::warn!(cloud = %cloud.id, "a cloud could not be stored");
        }
    }
}

/// Writes a cloud unless the store has it. Returns whether it is new to the store.
///
/// Without a store, every cloud is new.
///
/// # Errors
/// 413 if there would never be enough memory to read it again. 503 if neither the store nor memory can hold
/// it.
pub async fn keep(app: &Arc<App>, owner: Owner, cloud: &Arc<RegisteredCloud>) -> Result<bool, Problem> {
    if app.durable.is_none() {
        return Ok(true);
    }
    let (app, cloud) = (app.clone(), cloud.clone());
    to_its_end(async move {
        let Some(durable) = &app.durable else { return Ok(true) };
        let holder = holder_of(&app, owner);
        if let Err(problem) = check_readable(&app, &cloud) {
            app.clouds.drop_unreadable(owner, &cloud);
            return Err(problem);
        }
        let encode = || encoded(&app, owner, &cloud);
        match app.clouds.keep(&durable.objects, &holder, &cloud, encode).await {
            StoreOutcome::Known => Ok(false),
            StoreOutcome::Deleted => Ok(true),
            StoreOutcome::Written(n_bytes) => {
                durable.grew_by(n_bytes, app.config.retention());
                Ok(true)
            }
            StoreOutcome::Pending(reason) => {
                durable.fell_behind(&reason);
                Ok(true)
            }
            StoreOutcome::Nowhere(reason) => {
                durable.fell_behind(&reason);
                let detail =
                    "the store of clouds does not answer, and memory is full of clouds that are not stored yet";
                Err(Problem::unavailable(detail, SECONDS_UNTIL_BACK))
            }
        }
    })
    .await
}

async fn encoded(app: &App, owner: Owner, cloud: &Arc<RegisteredCloud>) -> Result<Vec<Bytes>, String> {
    let cloud = cloud.clone();
    let encoded = app.compute.run_small(owner, move || encode(cloud.stored())).await;
    encoded.map_err(|_| "a cloud is not encoded".to_owned())
}

/// Checks that the stored object of a cloud could be read again.
fn check_readable(app: &App, cloud: &RegisteredCloud) -> Result<(), Problem> {
    let (n_bytes, most) = (object_bytes(&cloud.head()), app.intake.largest() / READING);
    if n_bytes.is_some_and(|n_bytes| n_bytes <= most) {
        return Ok(());
    }
    let what = "bytes of a cloud, 8 for a coordinate,";
    let remedy = "register it in parts, or raise the memory of the service";
    Err(Problem::too_large(catalogue::PROBLEM_TOO_LARGE, what, most, n_bytes).with_remedy(remedy))
}

/// Returns the first clouds within a window of an owner's list.
///
/// # Errors
/// 503 if the store does not answer.
pub async fn list_clouds(app: &Arc<App>, owner: Owner, window: ListWindow) -> Result<CloudPage, Problem> {
    let shared = app.clone();
    // This computes nothing, but takes longer than an async worker may be held.
    let unstored = app.compute.run_small(owner, move || shared.clouds.unstored_places(owner)).await?;
    let objects = app.durable.as_ref().map(|durable| &durable.objects);
    let page = app.clouds.page(objects, &holder_of(app, owner), window, unstored).await;
    page.map_err(|error| unavailable(&error))
}

/// Deletes a cloud from memory and from the store. Returns whether it was in either.
///
/// # Errors
/// 503 if the store does not answer. Nothing is deleted then.
pub async fn forget_cloud(app: &Arc<App>, owner: Owner, id: CloudId) -> Result<bool, Problem> {
    let app = app.clone();
    to_its_end(async move {
        let objects = app.durable.as_ref().map(|durable| &durable.objects);
        let was_there = app.clouds.forget(objects, &holder_of(&app, owner), id).await;
        let was_there = was_there.map_err(|error| unavailable(&error))?;
        forget_results(&app, owner, id);
        Ok(was_there)
    })
    .await
}

/// Drops all results computed from a cloud.
fn forget_results(app: &App, owner: Owner, id: CloudId) {
    app.prepared.forget_cloud(owner, id);
    app.learned.forget_cloud(owner, id);
}

/// Sweeps objects out of the store that it should not keep, for as long as the process lives.
pub async fn retain(app: Arc<App>) {
    let Some(durable) = &app.durable else { return };
    let mut ticks = tokio::time::interval(SWEEPING);
    loop {
        tokio::select! {
            _ = ticks.tick() => {}
            () = durable.is_full.notified() => {}
        }
        let now = SystemTime::now();
        let knows = |name: &OwnerName| app.keys.owner_named(name).is_some();
        let (kept, longest) = app.settings.job_retention();
        if let Err(error) = durable.objects.sweep_jobs(knows, kept, longest, now).await {
            tracing::error!(%error, "jobs of removed keys could not be deleted");
        }
        match durable.objects.sweep(app.config.retention(), now).await {
            Err(error) => tracing::error!(%error, "expired clouds could not be deleted"),
            Ok(Swept { n_clouds, n_bytes, n_factor_bytes, gone }) => {
                durable.n_factor_bytes.store(n_factor_bytes, Ordering::Relaxed);
                durable.n_clouds.store(n_clouds, Ordering::Relaxed);
                durable.n_bytes.store(n_bytes, Ordering::Relaxed);
                if !gone.is_empty() {
                    tracing::info!(n_gone = gone.len(), n_clouds, n_bytes, "expired clouds were deleted");
                }
                for (owner, id) in gone {
                    if let Some(owner) = app.keys.owner_named(&owner) {
                        app.clouds.distrust(owner, id);
                        forget_results(&app, owner, id);
                    }
                }
            }
        }
        tokio::time::sleep(BETWEEN_SWEEPS).await;
    }
}

/// Offers clouds to the store that it has not taken, for as long as the process lives.
pub async fn catch_up(app: Arc<App>) {
    let Some(durable) = &app.durable else { return };
    let mut ticks = tokio::time::interval(Duration::from_secs(SECONDS_UNTIL_BACK));
    loop {
        ticks.tick().await;
        if durable.is_up_to_date() {
            continue;
        }
        let n_refused = durable.n_refused.load(Ordering::Acquire);
        for owner in app.keys.owners() {
            offer_again(&app, durable, owner).await;
        }
        // Clouds refused meanwhile are offered in the next round.
        durable.n_offered_again.store(n_refused, Ordering::Release);
        if durable.is_up_to_date() {
            tracing::info!("the store has taken all clouds");
        }
    }
}

async fn offer_again(app: &Arc<App>, durable: &Durable, owner: Owner) {
    let holder = holder_of(app, owner);
    for cloud in app.clouds.unstored(owner) {
        let encode = || encoded(app, owner, &cloud);
        match app.clouds.offer(&durable.objects, &holder, &cloud, encode).await {
            Some(StoreOutcome::Written(n_bytes)) => durable.grew_by(n_bytes, app.config.retention()),
            Some(StoreOutcome::Pending(reason) | StoreOutcome::Nowhere(reason)) => {
                durable.fell_behind(&reason)
            }
            Some(StoreOutcome::Known | StoreOutcome::Deleted) | None => {}
        }
    }
}
