//! What holds at a moment, and what others count: read when it is asked for.

use std::sync::{Mutex, PoisonError};

use prometheus::core::Collector;
use prometheus::process_collector::ProcessCollector;
use prometheus::{Error, IntCounterVec, IntGauge, IntGaugeVec, Opts, Registry};

use crate::http::serve::app::App;
use crate::store::Counts;
use crate::store::objects::Verb;

pub(super) struct Gauges {
    places: IntGauge,
    admitted: IntGauge,
    queue_depth: IntGauge,
    threads: IntGauge,
    running: IntGaugeVec,
    waiting: IntGaugeVec,
    memory_used: IntGaugeVec,
    memory_limit: IntGaugeVec,
    entries: IntGaugeVec,
    evictions: IntCounterVec,
    store_operations: IntCounterVec,
    store_damaged: IntCounterVec,
    store_up_to_date: IntGauge,
    store_clouds: IntGauge,
    store_bytes: IntGauge,
    store_factor_bytes: IntGauge,
    store_job_bytes: IntGauge,
    jobs: IntGaugeVec,
    reading: Mutex<()>,
}

impl Gauges {
    pub(super) fn new(registry: &Registry) -> Result<Self, Error> {
        let gauge = |name: &str, help: &str| kept(registry, IntGauge::new(name, help)?);
        let gauges = |name: &str, help: &str, label: &str| {
            kept(registry, IntGaugeVec::new(Opts::new(name, help), &[label])?)
        };
        let counters = |name: &str, help: &str, labels: &[&str]| {
            kept(registry, IntCounterVec::new(Opts::new(name, help), labels)?)
        };
        let build = gauges("gramian_build_info", "1, with the version", "version")?;
        build.with_label_values(&[env!("CARGO_PKG_VERSION")]).set(1);
        registry.register(Box::new(ProcessCollector::for_self()))?;
        Ok(Self {
            places: gauge("gramian_compute_places", "Requests that are admitted at once at most")?,
            admitted: gauge("gramian_compute_admitted", "Requests that are admitted")?,
            queue_depth: gauge(
                "gramian_queue_depth",
                "What waits for its turn: requests on all lanes, and jobs",
            )?,
            threads: gauge("gramian_compute_threads", "Threads of each lane")?,
            running: gauges("gramian_compute_running", "Jobs that run", "lane")?,
            waiting: gauges("gramian_compute_waiting", "Jobs that wait for their turn", "lane")?,
            memory_used: gauges("gramian_memory_used_bytes", "Bytes that are held", "part")?,
            memory_limit: gauges("gramian_memory_limit_bytes", "Bytes that may be held", "part")?,
            entries: gauges("gramian_cache_entries", "Clouds and solvers in memory", "part")?,
            evictions: counters("gramian_cache_evictions_total", "What made room for others", &["part"])?,
            store_operations: counters(
                "gramian_store_operations_total",
                "What was asked of the store",
                &["operation", "outcome"],
            )?,
            store_damaged: counters(
                "gramian_store_damaged_total",
                "Objects that were not as they were written",
                &[],
            )?,
            store_up_to_date: gauge(
                "gramian_store_up_to_date",
                "0 while clouds that were acknowledged are in memory alone",
            )?,
            store_clouds: gauge("gramian_store_clouds", "Clouds in the store, about")?,
            store_bytes: gauge("gramian_store_bytes", "Bytes of clouds in the store, about")?,
            store_factor_bytes: gauge("gramian_store_factor_bytes", "Bytes of factors in the store, about")?,
            store_job_bytes: gauge("gramian_store_job_bytes", "Bytes of jobs in the store, about")?,
            jobs: gauges("gramian_jobs", "Jobs of this process that have not ended", "status")?,
            reading: Mutex::default(),
        })
    }

    /// Reads everything. One at a time: what others count would be added twice.
    #[expect(clippy::disallowed_methods, reason = "numbers are read while it is held, nothing is computed")]
    pub(super) fn read(&self, app: &App) {
        let _alone = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        self.read_load(app);
        self.read_memory(app);
        self.read_store(app);
    }

    fn read_load(&self, app: &App) {
        let load = app.compute.load();
        self.places.set(load.n_places as i64);
        self.admitted.set(load.n_admitted as i64);
        self.threads.set(app.compute.n_threads() as i64);
        let jobs = app.jobs.load();
        // Jobs wait for a turn of their own before they come to a lane.
        let n_waiting = load.lanes.iter().map(|lane| lane.n_waiting).sum::<usize>() + jobs.n_waiting;
        self.queue_depth.set(n_waiting as i64);
        self.jobs.with_label_values(&["queued"]).set(jobs.n_waiting as i64);
        self.jobs.with_label_values(&["running"]).set(jobs.n_running as i64);
        for lane in load.lanes {
            self.running.with_label_values(&[lane.name]).set(lane.n_running as i64);
            self.waiting.with_label_values(&[lane.name]).set(lane.n_waiting as i64);
        }
    }

    fn read_memory(&self, app: &App) {
        for (part, used, limit) in [
            ("clouds", app.clouds.n_bytes(), app.memory.clouds),
            ("cache", app.prepared.n_bytes(), app.memory.cache),
            ("work", app.prepared.n_reserved(), app.memory.work),
            ("intake", app.intake.n_held(), app.memory.intake),
            ("jobs", app.jobs.n_bytes_in_memory(), app.memory.jobs),
        ] {
            self.memory_used.with_label_values(&[part]).set(used as i64);
            self.memory_limit.with_label_values(&[part]).set(limit as i64);
        }
        for (part, Counts { n_kept, n_evicted }) in
            [("clouds", app.clouds.counts()), ("cache", app.prepared.counts())]
        {
            self.entries.with_label_values(&[part]).set(n_kept as i64);
            advance(&self.evictions, &[part], n_evicted);
        }
    }

    fn read_store(&self, app: &App) {
        self.store_up_to_date
            .set(i64::from(app.durable.as_ref().is_none_or(|durable| durable.is_up_to_date())));
        let (n_clouds, n_bytes) = app.durable.as_ref().map_or((0, 0), |durable| durable.size());
        self.store_clouds.set(n_clouds as i64);
        self.store_bytes.set(n_bytes as i64);
        let n_factor_bytes = app.durable.as_ref().map_or(0, |durable| durable.factor_bytes());
        self.store_factor_bytes.set(n_factor_bytes as i64);
        self.store_job_bytes.set(app.jobs.n_bytes_in_store() as i64);
        let tally = app.durable.as_ref().map(|durable| durable.objects.tally());
        for verb in Verb::ALL {
            let [n_answered, n_failed] = tally.map_or([0; 2], |tally| tally.of(verb));
            advance(&self.store_operations, &[verb.name(), "ok"], n_answered);
            advance(&self.store_operations, &[verb.name(), "error"], n_failed);
        }
        advance(
            &self.store_damaged,
            &[],
            app.durable.as_ref().map_or(0, |durable| durable.objects.n_damaged()),
        );
    }
}

/// A family that was registered.
fn kept<F: Collector + Clone + 'static>(registry: &Registry, family: F) -> Result<F, Error> {
    registry.register(Box::new(family.clone()))?;
    Ok(family)
}

/// Brings a counter to what somebody else counted.
fn advance(counters: &IntCounterVec, labels: &[&str], to: u64) {
    let counter = counters.with_label_values(labels);
    counter.inc_by(to.saturating_sub(counter.get()));
}
