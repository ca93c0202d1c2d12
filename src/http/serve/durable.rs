//! Clouds that outlive the process, where there is a store: written before they are acknowledged, read again where memory has let them go.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use tokio::sync::Notify;

use super::app::App;
use crate::http::compute::{Admission, JobObserver};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::store::Owner;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::{CloudHead, decode, encode, object_bytes};
use crate::store::objects::{Listed, Objects, OwnerName, Place, Retention, Swept, Unavailable, Written};

/// When to come back to a store that does not answer, and how often clouds that it has not taken are offered to it again.
pub const SECONDS_UNTIL_BACK: u64 = 5;

/// How often it is looked what of the store is to go, unless more comes than may be there.
const SWEEPING: Duration = Duration::from_secs(600);

/// The least time between two looks at all of it: once it is full, every new cloud makes it fuller than it may be.
const BETWEEN_SWEEPS: Duration = Duration::from_secs(1);

/// Memory that reading a cloud takes, of the bytes of its object: as they come, in one piece, and as numbers.
const READING: usize = 3;

/// How long a cloud in memory is taken to be in the store as well: another process may have deleted it there.
pub const TRUST: Duration = Duration::from_secs(10);

/// How long an object waits for memory before the request is refused.
const PATIENCE: Duration = Duration::from_secs(1);

/// Work of hashing and copying a byte.
const FLOPS_PER_BYTE: f64 = 8.0;

/// The store, and whether it takes what it is given.
pub struct Durable {
    pub objects: Arc<Objects>,
    /// Clouds that it did not take, and how many of them it has been offered again since.
    n_refused: AtomicU64,
    n_made_up: AtomicU64,
    /// What the last sweep found, and what was written since.
    n_clouds: AtomicU64,
    n_bytes: AtomicU64,
    pub(super) n_factor_bytes: AtomicU64,
    pub(super) is_full: Notify,
    /// Held while a factor is written.
    pub(super) writing_factor: tokio::sync::Mutex<()>,
}

impl Durable {
    /// # Errors
    /// Says what is wrong with the place.
    pub async fn open(place: &Place) -> Result<Self, String> {
        let variables = std::env::vars_os();
        let variables =
            variables.filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)));
        let objects = Objects::open(place, variables).await?;
        Ok(Self {
            objects: Arc::new(objects),
            n_refused: AtomicU64::new(0),
            n_made_up: AtomicU64::new(0),
            n_clouds: AtomicU64::new(0),
            n_bytes: AtomicU64::new(0),
            n_factor_bytes: AtomicU64::new(0),
            is_full: Notify::new(),
            writing_factor: tokio::sync::Mutex::default(),
        })
    }

    /// Whether all that was acknowledged outlives the process.
    pub fn is_up_to_date(&self) -> bool {
        self.n_made_up.load(Ordering::Acquire) == self.n_refused.load(Ordering::Acquire)
    }

    /// Bytes of factors in the store, about.
    pub fn factor_bytes(&self) -> u64 {
        self.n_factor_bytes.load(Ordering::Relaxed)
    }

    /// How many clouds the store has, and bytes of them, about.
    pub fn size(&self) -> (u64, u64) {
        (self.n_clouds.load(Ordering::Relaxed), self.n_bytes.load(Ordering::Relaxed))
    }

    fn grew_by(&self, n_bytes: u64, limits: Retention) {
        self.n_clouds.fetch_add(1, Ordering::Relaxed);
        let n_bytes = n_bytes + self.n_bytes.fetch_add(n_bytes, Ordering::Relaxed);
        if limits.n_bytes.is_some_and(|most| n_bytes > most) {
            self.is_full.notify_one();
        }
    }

    fn fell_behind(&self, reason: &dyn std::fmt::Display) {
        let was_up_to_date = self.is_up_to_date();
        self.n_refused.fetch_add(1, Ordering::AcqRel);
        if was_up_to_date {
            tracing::error!(%reason, "clouds are kept in memory alone until the store takes them");
        }
    }
}

/// 503 where the store does not answer.
pub fn unavailable(error: &Unavailable) -> Problem {
    tracing::error!(%error, "the store does not answer");
    Problem::unavailable("the store of clouds does not answer", SECONDS_UNTIL_BACK)
}

/// A cloud of the owner who was admitted, from memory or from the store.
///
/// # Errors
/// 503 if the store does not answer, or there is no memory for the cloud.
pub async fn find_cloud(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    id: CloudId,
) -> Result<Option<Arc<RegisteredCloud>>, Problem> {
    let owner = admission.owner;
    let Some(Durable { objects, .. }) = &app.durable else { return Ok(app.clouds.get(owner, id)) };
    if let Some(cloud) = app.clouds.get(owner, id).filter(|cloud| !cloud.is_trusted(TRUST)) {
        match objects.cloud_bytes(&app.keys.name_of(owner), id).await {
            Ok(None) => forget_in_memory(app, owner, id),
            // It is served from memory while the store does not answer.
            Ok(Some(_)) | Err(_) => cloud.trust(),
        }
    }
    let (shared, admitted) = (app.clone(), admission.clone());
    app.clouds.get_or_read(admission.owner, id, || read_cloud(shared, admitted, id)).await
}

async fn read_cloud(
    app: Arc<App>,
    admission: Arc<Admission>,
    id: CloudId,
) -> Result<Option<Arc<RegisteredCloud>>, Problem> {
    let Some(Durable { objects, .. }) = &app.durable else { return Ok(None) };
    let (owner, name) = (admission.owner, app.keys.name_of(admission.owner));
    let refused = |error: Unavailable| unavailable(&error);
    let Some(n_bytes) = objects.cloud_bytes(&name, id).await.map_err(refused)? else { return Ok(None) };
    let n_reserved = usize::try_from(n_bytes).map_or(usize::MAX, |n| n.saturating_mul(READING));
    if n_reserved > app.intake.largest() {
        // Nothing that is kept today: there was more memory when it was written, or it is damaged.
        tracing::error!(cloud = %id, n_bytes, "a cloud of the store takes more memory than there may be for one");
        return Err(Problem::internal());
    }
    let mut memory = app.intake.try_reserve(owner, 0).ok_or_else(Problem::internal)?;
    if !app.intake.grow(&mut memory, n_reserved, PATIENCE).await {
        return Err(app.compute.out_of_memory());
    }
    let Some(bytes) = objects.get_cloud(&name, id).await.map_err(refused)? else { return Ok(None) };
    let shared = app.clone();
    let job = move |_: &JobObserver| {
        let _memory = memory;
        decode(id, &bytes).map(|cloud| shared.clouds.adopt(owner, cloud))
    };
    match app.compute.run(&admission, n_bytes as f64 * FLOPS_PER_BYTE, job).await?.0 {
        Err(damaged) => {
            objects.put_aside(&name, id, damaged).await;
            Ok(None)
        }
        // Deleted while it was read: it must not come back.
        Ok(_) if objects.cloud_bytes(&name, id).await.map_err(refused)?.is_none() => {
            app.clouds.remove(owner, id);
            Ok(None)
        }
        Ok(cloud) => Ok(Some(cloud)),
    }
}

/// Writes clouds that are in memory alone. A store that does not take them is reported, and offered them again: they are served from memory
/// meanwhile. One that memory has no room for either is not there any more when its request has been answered.
pub async fn keep_all(app: &Arc<App>, owner: Owner, clouds: &[Arc<RegisteredCloud>]) {
    for cloud in clouds {
        if keep(app, owner, cloud).await.is_err() {
            tracing::warn!(cloud = %cloud.id, "a cloud is kept nowhere");
        }
    }
}

/// The same of one; says whether it is new to the store, or there is none.
///
/// # Errors
/// 413 if there would never be the memory to read it again; 503 if neither the store nor memory keeps it.
pub async fn keep(app: &Arc<App>, owner: Owner, cloud: &Arc<RegisteredCloud>) -> Result<bool, Problem> {
    let Some(Durable { objects, .. }) = &app.durable else { return Ok(true) };
    if let Err(problem) = check_readable(app, cloud) {
        app.clouds.remove(owner, cloud.id);
        return Err(problem);
    }
    // An answer says that it is there: also if another process has deleted it meanwhile.
    if cloud.is_durable()
        && !matches!(objects.cloud_bytes(&app.keys.name_of(owner), cloud.id).await, Ok(None))
    {
        cloud.trust();
        return Ok(true);
    }
    // Another may be writing these points, which were deleted since: that writes nothing, or takes it away again.
    for _ in 0..2 {
        let (shared, kept) = (app.clone(), cloud.clone());
        let written = app.clouds.write(owner, cloud.id, || write_cloud(shared, owner, kept)).await;
        let Some(is_new) = written else { break };
        if cloud.is_durable() || cloud.is_forgotten() {
            return Ok(is_new);
        }
    }
    match app.clouds.hold(owner, cloud) {
        true => Ok(true),
        false => Err(Problem::unavailable(
            "the store of clouds does not answer, and memory is full of clouds that it has not taken",
            SECONDS_UNTIL_BACK,
        )),
    }
}

/// Whether what is written of a cloud could be read again.
fn check_readable(app: &App, cloud: &RegisteredCloud) -> Result<(), Problem> {
    let (n_bytes, most) = (object_bytes(&CloudHead::of(cloud)), app.intake.largest() / READING);
    if n_bytes.is_some_and(|n_bytes| n_bytes <= most) {
        return Ok(());
    }
    let what = "bytes of a cloud, 8 for a coordinate,";
    let remedy = "register it in parts, or raise the memory of the service";
    Err(Problem::too_large(Slug::ProblemTooLarge, what, most, n_bytes).with_remedy(remedy))
}

/// Whether it is new to the store; nothing if that does not take it.
async fn write_cloud(app: Arc<App>, owner: Owner, cloud: Arc<RegisteredCloud>) -> Option<bool> {
    let durable = app.durable.as_ref()?;
    if cloud.is_forgotten() {
        return Some(false);
    }
    let (encoded, named) = (cloud.clone(), (cloud.id, cloud.created_at()));
    let Ok(pieces) = app.compute.run_small(owner, move || encode(&encoded)).await else {
        durable.fell_behind(&"a cloud is not encoded");
        return None;
    };
    let n_bytes = pieces.iter().map(|piece| piece.len() as u64).sum();
    let name = app.keys.name_of(owner);
    let written = match durable.objects.put_cloud(&name, named, pieces).await {
        Ok(written) => written,
        Err(error) => {
            durable.fell_behind(&error);
            return None;
        }
    };
    // Deleted while it was written: it must not come back.
    if cloud.is_forgotten() {
        if let Err(error) = durable.objects.delete_cloud(&name, cloud.id).await {
            tracing::error!(%error, cloud = %cloud.id, "a deleted cloud is in the store again");
        }
        return Some(false);
    }
    match written {
        Written::Now => {
            cloud.set_durable(None);
            durable.grew_by(n_bytes, app.config.retention());
        }
        Written::Before(since) => cloud.set_durable(Some(since)),
    }
    Some(written == Written::Now)
}

/// The clouds of the owner who was admitted behind a place of the list, in its order and no more than `limit` of them, those in memory with what
/// is known of them; and whether they are the last.
///
/// # Errors
/// 503 if the store does not answer.
pub async fn list_clouds(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    after: Option<Listed>,
    limit: usize,
) -> Result<(Vec<(Listed, Option<Arc<RegisteredCloud>>)>, bool), Problem> {
    let owner = admission.owner;
    let stored = match &app.durable {
        None => BTreeSet::new(),
        Some(Durable { objects, .. }) => {
            // One more says whether they are the last.
            let stored = objects.list_first(&app.keys.name_of(owner), after, limit + 1).await;
            stored.map_err(|error| unavailable(&error))?
        }
    };
    let shared = app.clone();
    // Nothing is computed: it only takes longer than an async worker may be held.
    let job = move |_: &JobObserver| {
        let mut all: BTreeMap<Listed, Option<Arc<RegisteredCloud>>> =
            stored.into_iter().map(|listed| (listed, None)).collect();
        // What is in memory alone is there as well; what was in the store and is no longer is nowhere. One that is behind these in the store is
        // on another page.
        let in_store: HashSet<CloudId> = all.keys().map(|listed| listed.id).collect();
        let is_there = |cloud: &Arc<RegisteredCloud>| !cloud.is_durable() || in_store.contains(&cloud.id);
        for cloud in shared.clouds.list(owner).into_iter().filter(is_there) {
            let listed = Listed { created_at: cloud.created_at(), id: cloud.id };
            if after.is_none_or(|last| listed > last) {
                all.insert(listed, Some(cloud));
            }
        }
        let is_last = all.len() <= limit;
        (all.into_iter().take(limit).collect(), is_last)
    };
    Ok(app.compute.run(admission, 0.0, job).await?.0)
}

/// Forgets a cloud wherever it is; says whether it was anywhere.
///
/// # Errors
/// 503 if the store does not answer: nothing is forgotten then.
pub async fn forget_cloud(app: &Arc<App>, owner: Owner, id: CloudId) -> Result<bool, Problem> {
    let kept = app.clouds.get(owner, id);
    // First: whoever writes it leaves it, or takes it away again.
    if let Some(cloud) = &kept {
        cloud.set_forgotten(true);
    }
    let was_stored = match &app.durable {
        None => Ok(false),
        Some(Durable { objects, .. }) => objects.delete_cloud(&app.keys.name_of(owner), id).await,
    };
    let was_stored = was_stored.map_err(|error| {
        if let Some(cloud) = &kept {
            cloud.set_forgotten(false);
            // Who wrote it meanwhile may have left that.
            if let Some(durable) = app.durable.as_ref().filter(|_| !cloud.is_durable()) {
                durable.fell_behind(&error);
            }
        }
        unavailable(&error)
    })?;
    forget_in_memory(app, owner, id);
    Ok(was_stored || kept.is_some())
}

fn forget_in_memory(app: &App, owner: Owner, id: CloudId) {
    app.clouds.remove(owner, id);
    app.prepared.forget_cloud(owner, id);
    app.learned.forget_cloud(owner, id);
}

/// Lets go of what the store is not to keep, for as long as the process lives.
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
        if let Err(error) = durable.objects.sweep_jobs(knows, app.config.job_retention(), now).await {
            tracing::error!(%error, "jobs of keys that are gone are not let go");
        }
        match durable.objects.sweep(app.config.retention(), now).await {
            Err(error) => tracing::error!(%error, "clouds are not let go"),
            Ok(Swept { n_clouds, n_bytes, n_factor_bytes, gone }) => {
                durable.n_factor_bytes.store(n_factor_bytes, Ordering::Relaxed);
                durable.n_clouds.store(n_clouds, Ordering::Relaxed);
                durable.n_bytes.store(n_bytes, Ordering::Relaxed);
                if !gone.is_empty() {
                    tracing::info!(n_gone = gone.len(), n_clouds, n_bytes, "clouds were let go");
                }
                for (owner, id) in gone {
                    if let Some(owner) = app.keys.owner_named(&owner) {
                        forget_in_memory(&app, owner, id);
                    }
                }
            }
        }
        tokio::time::sleep(BETWEEN_SWEEPS).await;
    }
}

/// Offers what the store has not taken to it again, for as long as the process lives.
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
            for cloud in app.clouds.list(owner) {
                // What the store has had is not missing: if it is not there any more, it was deleted.
                if !cloud.is_durable() && app.clouds.has(owner, &cloud) {
                    keep_all(&app, owner, &[cloud]).await;
                }
            }
        }
        // What was refused meanwhile has its turn next time.
        durable.n_made_up.store(n_refused, Ordering::Release);
        if durable.is_up_to_date() {
            tracing::info!("the store has taken all clouds");
        }
    }
}
