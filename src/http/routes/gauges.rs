//! Metrics that are read at each scrape: the current state of the app, and counts that its parts keep.

use prometheus::core::Collector;
use prometheus::proto::MetricFamily;
use prometheus::{Counter, Error, IntCounterVec, IntGaugeVec, Opts, Registry};

use crate::http::state::app::App;
use crate::store::Counts;
use gramian_host::process::counters::Usage;
use gramian_host::store::Verb;

/// Reads the metrics of load, memory, stores and process.
///
/// # Errors
/// Fails only if two families have the same name.
pub fn gather(app: &App) -> Result<Vec<MetricFamily>, Error> {
    let moment = Moment::default();
    moment.gauges(
        "gramian_build_info",
        "1, with the version",
        "version",
        &[(env!("CARGO_PKG_VERSION"), 1)],
    )?;
    read_process(&moment)?;
    read_load(app, &moment)?;
    read_memory(app, &moment)?;
    read_store(app, &moment)?;
    Ok(moment.0.gather())
}

fn read_process(moment: &Moment) -> Result<(), Error> {
    let Some(usage) = Usage::read() else { return Ok(()) };
    let help = "Processor time of all threads, in seconds";
    moment.add(Counter::new("process_cpu_seconds_total", help)?)?.inc_by(usage.cpu_seconds);
    moment.gauge("process_open_fds", "Open files", usage.n_open_files)?;
    if let Some(max_open_files) = usage.max_open_files {
        moment.gauge("process_max_fds", "Most open files", max_open_files as usize)?;
    }
    let help = "Addresses in use, in bytes";
    moment.gauge("process_virtual_memory_bytes", help, usage.virtual_bytes as usize)?;
    moment.gauge("process_resident_memory_bytes", "Memory in use", usage.resident_bytes as usize)?;
    moment.gauge("process_start_time_seconds", "Start, in seconds since 1970", usage.started as usize)?;
    moment.gauge("process_threads", "Threads", usage.n_threads as usize)
}

fn read_load(app: &App, moment: &Moment) -> Result<(), Error> {
    let (load, jobs) = (app.compute.load(), app.jobs.load());
    // Jobs wait in a queue of their own before they enter a lane.
    let n_waiting = load.lanes.iter().map(|lane| lane.n_waiting).sum::<usize>() + jobs.n_waiting;
    let (running, waiting): (Vec<_>, Vec<_>) =
        load.lanes.iter().map(|lane| ((lane.name, lane.n_running), (lane.name, lane.n_waiting))).unzip();
    let of_jobs = [("queued", jobs.n_waiting), ("running", jobs.n_running)];
    moment.gauge("gramian_compute_places", "Most requests admitted at once", load.n_places)?;
    moment.gauge("gramian_compute_admitted", "Requests admitted now", load.n_admitted)?;
    moment.gauge("gramian_compute_threads", "Threads of each lane", app.compute.n_threads())?;
    let help = "Requests and jobs waiting for a thread";
    moment.gauge("gramian_queue_depth", help, n_waiting)?;
    moment.gauges("gramian_compute_running", "Jobs that run", "lane", &running)?;
    moment.gauges("gramian_compute_waiting", "Jobs waiting for a thread", "lane", &waiting)?;
    moment.gauges("gramian_jobs", "Unfinished jobs of this process", "status", &of_jobs)
}

fn read_memory(app: &App, moment: &Moment) -> Result<(), Error> {
    let used = [
        ("clouds", app.clouds.n_bytes()),
        ("cache", app.prepared.n_bytes()),
        ("work", app.prepared.n_reserved()),
        ("intake", app.intake.n_held()),
        ("jobs", app.jobs.n_bytes_in_memory()),
    ];
    let limits = [
        ("clouds", app.memory.clouds),
        ("cache", app.memory.cache),
        ("work", app.memory.shares.work),
        ("intake", app.memory.shares.intake),
        ("jobs", app.memory.shares.jobs),
    ];
    moment.gauges("gramian_memory_used_bytes", "Bytes in use", "part", &used)?;
    moment.gauges("gramian_memory_limit_bytes", "Most bytes that may be in use", "part", &limits)?;
    let counts = [("clouds", app.clouds.counts()), ("cache", app.prepared.counts())];
    let kept = counts.map(|(part, Counts { n_kept, .. })| (part, n_kept));
    let evicted = counts.map(|(part, Counts { n_evicted, .. })| (vec![part], n_evicted));
    moment.gauges("gramian_cache_entries", "Clouds and solvers in memory", "part", &kept)?;
    let help = "Entries evicted to make room";
    moment.counters("gramian_cache_evictions_total", help, &["part"], &evicted)
}

fn read_store(app: &App, moment: &Moment) -> Result<(), Error> {
    let durable = app.durable.as_ref();
    let is_up_to_date = durable.is_none_or(|durable| durable.is_up_to_date());
    let (n_clouds, n_bytes) = durable.map_or((0, 0), |durable| durable.size());
    let n_factor_bytes = durable.map_or(0, |durable| durable.factor_bytes());
    let n_job_bytes = app.jobs.n_bytes_in_store();
    let n_damaged = durable.map_or(0, |durable| durable.objects.n_damaged());
    let tally = durable.map(|durable| durable.objects.tally());
    let operations: Vec<(Vec<&str>, u64)> = Verb::ALL
        .into_iter()
        .flat_map(|verb| {
            let [n_answered, n_failed] = tally.map_or([0; 2], |tally| tally.of(verb));
            [(vec![verb.name(), "ok"], n_answered), (vec![verb.name(), "error"], n_failed)]
        })
        .collect();
    let help = "1 if the store holds every acknowledged cloud, 0 if some are in memory only";
    moment.gauge("gramian_store_up_to_date", help, usize::from(is_up_to_date))?;
    moment.gauge("gramian_store_clouds", "Clouds in the store, about", n_clouds as usize)?;
    moment.gauge("gramian_store_bytes", "Bytes of clouds in the store, about", n_bytes as usize)?;
    let help = "Bytes of factors in the store, about";
    moment.gauge("gramian_store_factor_bytes", help, n_factor_bytes as usize)?;
    moment.gauge("gramian_store_job_bytes", "Bytes of jobs in the store, about", n_job_bytes)?;
    let (help, labels) = ("Operations on the store", ["operation", "outcome"]);
    moment.counters("gramian_store_operations_total", help, &labels, &operations)?;
    let help = "Objects of the store found damaged";
    moment.counters("gramian_store_damaged_total", help, &[], &[(vec![], n_damaged)])
}

/// A registry for one scrape. Each family is added with its values, and never changes.
#[derive(Default)]
struct Moment(Registry);

impl Moment {
    fn gauge(&self, name: &str, help: &str, value: usize) -> Result<(), Error> {
        let gauges = self.add(IntGaugeVec::new(Opts::new(name, help), &[])?)?;
        gauges.with_label_values::<&str>(&[]).set(value as i64);
        Ok(())
    }

    /// Adds a family with a gauge for each value of a label.
    fn gauges(&self, name: &str, help: &str, label: &str, values: &[(&str, usize)]) -> Result<(), Error> {
        let gauges = self.add(IntGaugeVec::new(Opts::new(name, help), &[label])?)?;
        values.iter().for_each(|&(of, value)| gauges.with_label_values(&[of]).set(value as i64));
        Ok(())
    }

    /// Adds a family with a counter for each combination of label values.
    fn counters(
        &self,
        name: &str,
        help: &str,
        labels: &[&str],
        values: &[(Vec<&str>, u64)],
    ) -> Result<(), Error> {
        let counters = self.add(IntCounterVec::new(Opts::new(name, help), labels)?)?;
        values.iter().for_each(|(of, count)| counters.with_label_values(of).inc_by(*count));
        Ok(())
    }

    fn add<F: Collector + Clone + 'static>(&self, family: F) -> Result<F, Error> {
        self.0.register(Box::new(family.clone()))?;
        Ok(family)
    }
}
