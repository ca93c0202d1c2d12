//! What the process says of itself: health, version, problem pages. None of it needs a key.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::Html;
use serde::Serialize;
use utoipa::ToSchema;

use crate::app::App;
use crate::http::problem::Problem;
use crate::http::responses::{PageProblems, ProbeProblems, ReadyProblems};
use crate::http::slug::Slug;

/// The state of the process.
#[derive(Serialize, ToSchema)]
pub struct Health {
    /// `ok`.
    #[schema(example = "ok")]
    status: &'static str,
}

/// What is running.
#[derive(Serialize, ToSchema)]
pub struct Version {
    /// The name of the service.
    name: &'static str,
    /// Its version.
    version: &'static str,
    /// The interface it serves.
    api: &'static str,
    /// The instruction set that the kernel loops run on, chosen at start.
    instruction_set: &'static str,
    /// Compute threads.
    threads: usize,
}

/// Check that the process lives
///
/// 200 as long as it answers at all, whatever it is busy with.
#[utoipa::path(
    get,
    path = "/health/live",
    operation_id = "check_live",
    tag = "process",
    responses((status = 200, description = "It lives", body = Health), ProbeProblems),
    security(())
)]
pub async fn check_live() -> Json<Health> {
    Json(Health { status: "ok" })
}

/// Check that the process takes requests
///
/// 503 while its queue is full and while it shuts down.
#[utoipa::path(
    get,
    path = "/health/ready",
    operation_id = "check_ready",
    tag = "process",
    responses((status = 200, description = "It takes requests", body = Health), ReadyProblems),
    security(())
)]
pub async fn check_ready(State(app): State<Arc<App>>) -> Result<Json<Health>, Problem> {
    if app.draining.is_cancelled() {
        return Err(Problem::overloaded(1));
    }
    if !app.compute.has_room() {
        app.compute.admit()?;
    }
    Ok(Json(Health { status: "ok" }))
}

/// Describe the build
///
/// The version of the service and what it chose to run on this machine.
#[utoipa::path(
    get,
    path = "/version",
    operation_id = "get_version",
    tag = "process",
    responses((status = 200, description = "What is running", body = Version), ProbeProblems),
    security(())
)]
pub async fn get_version(State(app): State<Arc<App>>) -> Json<Version> {
    Json(Version {
        name: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        api: "v1",
        instruction_set: crate::numerics::instruction_set::InstructionSet::best().name(),
        threads: app.config.n_threads(),
    })
}

/// Explain a problem
///
/// The page behind the `type` of a problem document: what it means and what to do.
#[utoipa::path(
    get,
    path = "/problems/{slug}",
    operation_id = "get_problem_page",
    tag = "process",
    params(("slug" = String, Path, description = "The last segment of a problem's type", example = "duplicate-points")),
    responses((status = 200, description = "The explanation", body = String, content_type = "text/html"), PageProblems),
    security(())
)]
pub async fn get_problem_page(Path(slug): Path<String>) -> Result<Html<String>, Problem> {
    let slug = Slug::parse(&slug).ok_or_else(|| Problem::new(Slug::NotFound, "no such problem type"))?;
    let (title, explanation) = (slug.title(), slug.explanation());
    let (status, name) = (slug.status(), slug.as_str());
    Ok(Html(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title></head>\n\
         <body><h1>{title}</h1>\n<p><code>{name}</code>, HTTP status {status}</p>\n<p>{explanation}</p></body></html>\n"
    )))
}
