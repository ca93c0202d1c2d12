//! Factors in the store, which outlive the process.
//!
//! They are written after the answers. They are read where that takes less time than making them.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use bytes::Bytes;

use crate::http::serve::plan::FitPlan;
use crate::http::state::app::App;
use crate::store::objects::factors::{FactorHead, FactorName, FoundFactor};
use crate::store::prepared::PreparedFit;
use gramian_host::compute::Admission;
use gramian_host::store::pieces::HASH_BYTES;
use gramian_host::store::{DamagedObject, Unavailable};
use gramian_numerics::model::Model;
use gramian_numerics::regression::solver::{FactorBuilder, Solver, System};

/// Number of points from which a factor is stored: reading 4 n² bytes takes less time than n³/3 flops.
const WORTH_IT: usize = 4000;

/// Bytes that are read at once and consumed by one small job.
const PIECE: u64 = 8 << 20;

/// Bytes that are written at once.
const WRITTEN: usize = 1 << 20;

/// Reason why a factor could not be read.
enum Lost {
    Damaged(DamagedObject),
    Unavailable(Unavailable),
    /// The factor was deleted meanwhile, there is no memory, or a job ended in a panic.
    Gone,
}

impl From<Unavailable> for Lost {
    fn from(error: Unavailable) -> Self {
        Self::Unavailable(error)
    }
}

/// Returns the model of a fit from the store, if the store has its factor.
///
/// This never fails: a factor that cannot be read is made again.
pub async fn restore(app: &Arc<App>, admission: &Admission, plan: &FitPlan) -> Option<Model> {
    let durable = app.durable.as_ref()?;
    if plan.fitted.n_points() < WORTH_IT || app.config.store_factor_bytes == 0 {
        return None;
    }
    // An invalid system is refused again where the model is made.
    let system = plan.recipe.factorized_system(&plan.fitted).ok()??;
    let name = name_of(app, plan);
    match read(app, admission, &name, &system).await {
        Ok(solver) => solver.map(|solver| Model::System(Arc::new(solver))),
        Err(Lost::Gone) => None,
        Err(Lost::Unavailable(error)) => {
            tracing::warn!(%error, "a stored factor is discarded and computed again");
            None
        }
        Err(Lost::Damaged(damaged)) => {
            durable.objects.drop_factor(&name, damaged).await;
            None
        }
    }
}

async fn read(
    app: &Arc<App>,
    admission: &Admission,
    name: &FactorName,
    system: &System,
) -> Result<Option<Solver>, Lost> {
    let Some(durable) = &app.durable else { return Ok(None) };
    let Some(found) = durable.objects.find_factor(name).await? else { return Ok(None) };
    let FoundFactor { head, line, n_bytes } = found;
    let n_points = system.n_points();
    let (spare, owner) = (app.prepared.spare().clone(), admission.owner);
    let begin = move || {
        let builder = FactorBuilder::new(&spare, n_points).ok()?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(&line);
        Some(Reading { builder, hasher, weights: Vec::with_capacity(n_points), at: line.len() as u64 })
    };
    let mut reading = app.compute.run_small(owner, begin).await.ok().flatten().ok_or(Lost::Gone)?;
    let expected = reading.at + 8 * (n_points + reading.builder.n_missing()) as u64 + HASH_BYTES as u64;
    if head.n_points != n_points || n_bytes != expected {
        return Err(Lost::Damaged(DamagedObject("its length is wrong")));
    }
    let end = n_bytes - HASH_BYTES as u64;
    while reading.at < end {
        let range = reading.at..end.min(reading.at + PIECE);
        let piece = durable.objects.factor_range(name, range).await?.ok_or(Lost::Gone)?;
        let take = move || reading.with(&piece);
        reading = app.compute.run_small(owner, take).await.map_err(|_| Lost::Gone)?;
    }
    let hash = durable.objects.factor_range(name, end..n_bytes).await?.ok_or(Lost::Gone)?;
    let Reading { builder, hasher, weights, .. } = reading;
    if hasher.finalize().as_bytes()[..] != hash[..] {
        return Err(Lost::Damaged(DamagedObject("its checksum does not match")));
    }
    let restored =
        Solver::restore(builder, system.clone(), weights, head.norm1(), head.reciprocal_condition());
    restored.map(Some).ok_or(Lost::Damaged(DamagedObject("it is not a factor of its system")))
}

/// A factor that has been read in part.
struct Reading {
    builder: FactorBuilder,
    hasher: blake3::Hasher,
    weights: Vec<f64>,
    at: u64,
}

impl Reading {
    /// Consumes the next bytes. They are whole numbers, because pieces and the line before them are.
    fn with(mut self, piece: &Bytes) -> Self {
        self.hasher.update(piece);
        self.at += piece.len() as u64;
        let mut numbers =
            piece.chunks_exact(8).map(|word| f64::from_le_bytes(word.try_into().unwrap_or_default()));
        let n_weights = self.weights.capacity() - self.weights.len();
        self.weights.extend(numbers.by_ref().take(n_weights));
        self.builder.push(numbers);
        self
    }
}

/// Writes a factor to the store after the answer, unless the store has it or another factor is being written.
///
/// A factor holds memory while it is written, and others may need that memory.
pub fn keep(app: &Arc<App>, plan: &FitPlan, stored: &Arc<PreparedFit>) {
    let Ok(solver) = stored.model().solver() else { return };
    let is_worth_it = cfg!(target_endian = "little")
        && solver.n_points() >= WORTH_IT
        && solver.factor().is_some()
        && !stored.is_restored();
    if app.durable.is_none() || !is_worth_it {
        return;
    }
    let (app, name, stored) = (app.clone(), name_of(app, plan), stored.clone());
    tokio::spawn(async move {
        let Some(durable) = &app.durable else { return };
        let Ok(_alone) = durable.writing_factor.try_lock() else { return };
        if let Err(error) = write(&app, &name, stored).await {
            tracing::warn!(%error, "a factor could not be stored");
        }
    });
}

async fn write(app: &App, name: &FactorName, stored: Arc<PreparedFit>) -> Result<(), Unavailable> {
    let Some(durable) = &app.durable else { return Ok(()) };
    let most = app.config.store_factor_bytes;
    let (Some(head), weights, numbers) = parts(&stored) else { return Ok(()) };
    let n_bytes = (weights.len() + numbers.len()) as u64;
    if n_bytes > most / 2 || durable.objects.find_factor(name).await?.is_some() {
        return Ok(());
    }
    let pieces = [weights, numbers].into_iter().flat_map(|all| {
        (0..all.len()).step_by(WRITTEN).map(move |at| all.slice(at..all.len().min(at + WRITTEN)))
    });
    let n_bytes = durable.objects.put_factor(name, &head, pieces).await?;
    // The cloud was deleted during the write, so its factor must go too.
    if durable.objects.cloud_bytes(&name.owner, name.cloud).await?.is_none() {
        durable.objects.delete_factors(&name.owner, name.cloud).await?;
    } else if durable.n_factor_bytes.fetch_add(n_bytes, Ordering::Relaxed) + n_bytes > most {
        durable.is_full.notify_one();
    }
    Ok(())
}

/// Returns a factor as bytes that share its memory, without a copy.
fn parts(stored: &Arc<PreparedFit>) -> (Option<FactorHead>, Bytes, Bytes) {
    let factor = stored.model().solver().ok().and_then(|solver| Some((solver.n_points(), solver.factor()?)));
    let head = factor.map(|(n, factor)| FactorHead::new(n, factor.norm1, factor.reciprocal_condition));
    let bytes = |of_weights| Bytes::from_owner(Numbers { stored: stored.clone(), of_weights });
    (head, bytes(true), bytes(false))
}

struct Numbers {
    stored: Arc<PreparedFit>,
    of_weights: bool,
}

impl AsRef<[u8]> for Numbers {
    fn as_ref(&self) -> &[u8] {
        let factor = self.stored.model().solver().ok().and_then(|solver| solver.factor());
        let numbers = factor
            .map_or(&[][..], |factor| if self.of_weights { factor.weights_of_one } else { factor.numbers });
        bytemuck::cast_slice(numbers)
    }
}

fn name_of(app: &App, plan: &FitPlan) -> FactorName {
    let owner = app.keys.name_of(plan.key.owner);
    FactorName { owner, cloud: plan.key.cloud_id, fit: plan.key.fit_name() }
}
