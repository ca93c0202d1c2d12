//! State of the process: health, metrics and version. None of these needs a key.

use std::sync::Arc;

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use super::gauges;
use crate::http::openapi::responses::{ProbeProblems, ReadyProblems};
use crate::http::problem::Problem;
use crate::http::state::app::App;
use gramian_host::state::metrics;
use gramian_host::wire::write::json::Json;

/// The state of the process.
#[derive(Serialize, ToSchema)]
pub struct Health {
    /// `ok`.
    #[schema(example = "ok")]
    status: &'static str,
}

/// The build that is running, and what it runs on.
#[derive(Serialize, ToSchema)]
pub struct Version {
    /// The name of the service.
    name: &'static str,
    /// The version of the service.
    version: &'static str,
    /// The version of the interface.
    api: &'static str,
    /// The instruction set of the kernel loops, chosen at start.
    instruction_set: &'static str,
    /// Number of compute threads.
    threads: usize,
}

/// Check that the process lives
///
/// Answers 200 as long as the process answers at all, whatever it is busy with.
#[utoipa::path(
    get,
    path = "/health/live",
    tag = "process",
    responses((status = 200, description = "It lives", body = Health), ProbeProblems)
)]
pub async fn check_live() -> Json<Health> {
    Json(Health { status: "ok" })
}

/// Check that the process takes requests
///
/// Answers 503 in each of these cases:
///
/// - the queue is full
/// - the process shuts down
/// - the compute threads make no progress
/// - the store is required and does not take what it is given
#[utoipa::path(
    get,
    path = "/health/ready",
    tag = "process",
    responses((status = 200, description = "It takes requests", body = Health), ReadyProblems)
)]
pub async fn check_ready(State(app): State<Arc<App>>) -> Result<Json<Health>, Problem> {
    if app.draining.is_cancelled() {
        return Err(Problem::overloaded(1));
    }
    if app.config.store_required && app.durable.as_ref().is_some_and(|durable| !durable.is_up_to_date()) {
        return Err(Problem::unavailable("the store does not accept writes", 5));
    }
    app.compute.check_ready().await?;
    Ok(Json(Health { status: "ok" }))
}

/// Read the metrics
///
/// Returns counters, histograms and gauges in the text format of Prometheus, version 0.0.4. They cover
/// requests by route and status, the queue, memory, caches, solvers, refusals, the store and the process. No
/// label has text that clients send.
#[utoipa::path(
    get,
    path = "/metrics",
    tag = "process",
    responses((status = 200, description = "The metrics", body = String, content_type = "text/plain"), ProbeProblems)
)]
pub async fn get_metrics(State(app): State<Arc<App>>) -> Result<Response, Problem> {
    let text = gauges::gather(&app).and_then(|now| app.metrics.text(now)).map_err(|error| {
        tracing::error!(%error, "metrics cannot be written");
        Problem::internal()
    })?;
    Ok(([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response())
}

/// Describe the build
///
/// Returns the version of the service, and the instruction set and number of threads that it chose on this
/// machine.
#[utoipa::path(
    get,
    path = "/version",
    tag = "process",
    responses((status = 200, description = "What is running", body = Version), ProbeProblems)
)]
pub async fn get_version(State(app): State<Arc<App>>) -> Json<Version> {
    Json(Version {
        name: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        api: "v1",
        instruction_set: gramian_numerics::machine::instruction_set::InstructionSet::best().name(),
        threads: app.settings.n_threads(),
    })
}
